"""The whole chain in virtual time: controller, odometry, driver, SDK, fake motors."""

import math

import pytest

from hil_fakes.virtual_robot import VirtualRobot
from hvcpd.hardware.motion import Forward, Goal, GoTo, MotionState, Turn
from hvcpd.ports import WheelCommand

SQUARE: list[Goal] = [Forward(1.0), Turn(math.pi / 2)] * 4


def test_a_square_of_one_metre_closes_within_one_percent(robot: VirtualRobot) -> None:
    for goal in SQUARE:
        assert robot.carry_out(goal) is MotionState.ARRIVED
    assert math.hypot(robot.pose.x_m, robot.pose.y_m) <= 0.01 * 4.0
    assert math.degrees(robot.pose.heading_rad) == pytest.approx(360.0, abs=2.0)


@pytest.mark.parametrize("kind", ["dynamixel", "opencr"])
def test_places_are_reached_in_truth(robot: VirtualRobot) -> None:
    assert robot.carry_out(Forward(0.5)) is MotionState.ARRIVED
    assert math.hypot(robot.pose.x_m - 0.5, robot.pose.y_m) <= 0.03
    for place in (GoTo(0.2, 0.4), GoTo(-0.2, 0.2), GoTo(0.3, 0.1), GoTo(0.0, 0.0)):
        assert robot.carry_out(place) is MotionState.ARRIVED
        assert math.hypot(robot.pose.x_m - place.x_m, robot.pose.y_m - place.y_m) <= 0.03
    heading_rad = robot.pose.heading_rad
    assert robot.carry_out(Turn(math.pi / 2)) is MotionState.ARRIVED
    assert math.degrees(robot.pose.heading_rad - heading_rad) == pytest.approx(90.0, abs=2.0)


def test_the_same_seed_drives_the_same_way_to_the_bit(robot: VirtualRobot) -> None:
    robot.carry_out(GoTo(0.3, 0.2))
    twin = VirtualRobot(seed=1)
    twin.wheels.open()
    twin.carry_out(GoTo(0.3, 0.2))
    twin.wheels.close()
    assert twin.odometry.pose == robot.odometry.pose
    assert twin.time.now_s == robot.time.now_s


def test_a_blocked_wheel_fails_the_motion(robot: VirtualRobot) -> None:
    for motor in robot.motors:
        motor.blocked = True
    assert robot.carry_out(Forward(0.5)) is MotionState.FAILED
    assert robot.navigator.reason


def test_odometry_knows_the_encoders_only(robot: VirtualRobot) -> None:
    robot.run(WheelCommand(2.0, 2.0), 0.5)
    before = robot.odometry.pose
    for motor in robot.motors:
        motor.memory.set("homing_offset", 1000)  # the encoders now lie by 1000 ticks that no wheel has turned
    robot.exchange(WheelCommand())
    assert robot.odometry.pose.x_m - before.x_m > 0.9 * 1000 / 4096 * 2 * math.pi * 0.033
