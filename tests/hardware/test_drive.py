"""The whole chain in virtual time: controller, odometry, driver, SDK, pty, fake motors."""

import ast
import math
from pathlib import Path

import hvcpd.hardware
from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hvcpd.hardware.kinematics import advance_pose
from hvcpd.hardware.motion import Forward, Goal, GoTo, MotionState, Turn
from hvcpd.hardware.navigator import Navigator
from hvcpd.ports import Pose, WheelCommand
from tests.hardware.conftest import Robot, make_robot

SQUARE: list[Goal] = [Forward(1.0), Turn(math.pi / 2)] * 4


class Body:
    """Where the robot really is, by the true angles of its wheels."""

    def __init__(self, robot: Robot) -> None:
        self._motors = robot.bus.motors
        self._last = (0.0, 0.0)
        self.pose = Pose(0.0, 0.0)
        robot.watch(self.follow)

    def follow(self) -> None:
        left, right = self._motors[1].true_angle_rad, self._motors[2].true_angle_rad
        self.pose = advance_pose(self.pose, left - self._last[0], right - self._last[1])
        self._last = (left, right)


def test_a_square_of_one_metre_closes_within_one_percent(robot: Robot) -> None:
    body = Body(robot)
    motion = Navigator()
    for goal in SQUARE:
        assert robot.carry_out(motion, goal) is MotionState.ARRIVED
    assert math.hypot(body.pose.x_m, body.pose.y_m) <= 0.01 * 4.0
    assert abs(math.degrees(body.pose.heading_rad)) <= 2.0


def test_places_are_reached_in_truth(robot: Robot) -> None:
    body = Body(robot)
    motion = Navigator()
    for place in (GoTo(0.3, 0.1), GoTo(-0.2, 0.2), GoTo(0.0, 0.0)):
        assert robot.carry_out(motion, place) is MotionState.ARRIVED
        assert math.hypot(body.pose.x_m - place.x_m, body.pose.y_m - place.y_m) <= 0.03


def test_the_same_seed_drives_the_same_way_to_the_bit(robot: Robot) -> None:
    robot.carry_out(Navigator(), GoTo(0.3, 0.2))
    with FakeBus(turtlebot3_pair(), seed=1) as bus:
        twin = make_robot(bus)
        twin.wheels.open()
        twin.carry_out(Navigator(), GoTo(0.3, 0.2))
        twin.wheels.close()
        assert twin.odometry.pose == robot.odometry.pose
        assert twin.clock.now_s == robot.clock.now_s


def test_a_blocked_wheel_fails_the_motion(robot: Robot) -> None:
    for motor in robot.bus.motors.values():
        motor.blocked = True
    motion = Navigator()
    assert robot.carry_out(motion, Forward(0.5)) is MotionState.FAILED
    assert motion.reason


def test_odometry_knows_the_encoders_only(robot: Robot) -> None:
    robot.run(WheelCommand(2.0, 2.0), 0.5)
    before = robot.odometry.pose
    for motor in robot.bus.motors.values():
        motor.memory.set("homing_offset", 1000)  # the encoders now lie by 1000 ticks that no wheel has turned
    robot.odometry.update(robot.wheels.exchange(WheelCommand()))
    assert robot.odometry.pose.x_m - before.x_m > 0.9 * 1000 / 4096 * 2 * math.pi * 0.033


def test_no_module_of_the_hardware_room_knows_the_fakes() -> None:
    for path in Path(hvcpd.hardware.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not [name for name in names if name.startswith("hil_fakes")], path.name
