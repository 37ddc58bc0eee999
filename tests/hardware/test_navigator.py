"""Journeys of several legs, obstacles and blindness, on the whole chain in virtual time."""

import math
from itertools import pairwise

import pytest

from hil_fakes.virtual_robot import PERIOD_S, VirtualRobot
from hvcpd.hardware.kinematics import BURGER
from hvcpd.hardware.motion import ACCELERATION_M_S2, Forward, Goal, GoTo, MotionState, Turn
from hvcpd.hardware.navigator import BACK_OFF_M, Dock, Face, Journey, Navigator, Waypoints
from hvcpd.hardware.registers import VELOCITY_UNIT_RAD_S
from hvcpd.hardware.stall import STALL_S, StallWatch
from hvcpd.ports import STANDSTILL, Pose, WheelCommand, WheelReading


def test_waypoints_are_passed_in_order_and_progress_never_falls(robot: VirtualRobot) -> None:
    places = ((0.5, 0.0), (0.5, 0.4), (0.0, 0.4))
    seen: list[float] = []
    trail: list[Pose] = []

    def note() -> None:
        seen.append(robot.navigator.progress)
        trail.append(robot.pose)

    assert robot.carry_out(Waypoints(places), note) is MotionState.ARRIVED
    nearest = [min(range(len(trail)), key=lambda k: math.hypot(trail[k].x_m - x, trail[k].y_m - y)) for x, y in places]
    assert nearest == sorted(nearest)
    for k, (x_m, y_m) in zip(nearest, places, strict=True):
        assert math.hypot(trail[k].x_m - x_m, trail[k].y_m - y_m) <= 0.03
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test_docking_leads_back_to_the_start_and_its_heading(robot: VirtualRobot) -> None:
    assert robot.carry_out(GoTo(0.4, 0.5)) is MotionState.ARRIVED
    assert robot.carry_out(Dock(Pose(0.0, 0.0, 0.0))) is MotionState.ARRIVED
    assert math.hypot(robot.pose.x_m, robot.pose.y_m) <= 0.03
    assert abs(math.degrees(math.remainder(robot.pose.heading_rad, math.tau))) <= 2.0


def test_facing_takes_the_shorter_way(robot: VirtualRobot) -> None:
    assert robot.carry_out(Face(math.radians(-170.0))) is MotionState.ARRIVED
    assert math.degrees(robot.pose.heading_rad) == pytest.approx(-170.0, abs=2.0)
    assert robot.carry_out(Face(math.radians(170.0))) is MotionState.ARRIVED
    assert math.degrees(robot.pose.heading_rad) == pytest.approx(-190.0, abs=2.0)


@pytest.mark.parametrize("journey", [Forward(1.0), GoTo(1.0, 0.2), Turn(6.0), Forward(-1.0)])
def test_an_obstacle_that_stays_is_backed_off_from_once_and_then_fails(robot: VirtualRobot, journey: Goal) -> None:
    start = [0.0, 0.0]

    def hold() -> None:
        """A wall after three seconds: the wheels cannot turn beyond where they are then, but back."""
        if robot.time.now_s <= 3.0:
            start[:] = [motor.true_angle_rad for motor in robot.motors]
            return
        for side, motor in enumerate(robot.motors):
            ahead = motor.true_angle_rad - start[side]
            goal = motor.mounting * (-1 if motor.memory.get("drive_mode") else 1) * motor.memory.get("goal_velocity")
            motor.blocked = ahead * start[side] >= 0.0 and goal * start[side] > 0.0

    assert robot.carry_out(journey, hold) is MotionState.FAILED
    assert "a wheel is blocked" in robot.navigator.reason
    assert robot.fastest_rad_s == 0.0


def test_an_obstacle_that_goes_away_costs_some_time_only(robot: VirtualRobot) -> None:
    poses: list[float] = []

    def hold() -> None:
        poses.append(robot.pose.x_m)
        robot.motors[0].blocked = 2.0 < robot.time.now_s < 2.4

    assert robot.carry_out(Forward(1.0), hold) is MotionState.ARRIVED
    assert robot.pose.x_m == pytest.approx(1.0, abs=0.05)
    deepest = max(poses[: poses.index(max(poses))] or [0.0])
    back = max(a - b for k, a in enumerate(poses) for b in poses[k : k + 40])
    assert back == pytest.approx(BACK_OFF_M, abs=0.02)
    assert deepest > 0.0


def test_after_it_has_backed_off_speed_rises_from_zero(robot: VirtualRobot) -> None:
    """It drove at the obstacle again with the speed at which it had met it, from one command to the next."""
    commands = [0.0]

    def hold() -> None:
        robot.motors[0].blocked = 2.0 < robot.time.now_s < 2.4
        commands.append(robot.motors[1].memory.get("goal_velocity") * VELOCITY_UNIT_RAD_S * BURGER.wheel_radius_m)

    assert robot.carry_out(Forward(1.0), hold) is MotionState.ARRIVED
    backed_off = next(k for k, speed_m_s in enumerate(commands) if speed_m_s < 0.0)
    rises = [after - before for before, after in pairwise(commands[backed_off:]) if after > 0.0]
    assert max(rises) <= 2.0 * ACCELERATION_M_S2 * PERIOD_S


def test_without_readings_it_stands_still_and_then_fails() -> None:
    navigator = Navigator()
    navigator.start(Forward(1.0), Pose(0.0, 0.0))
    reading = WheelReading(0.0, 0.0)
    commands = [navigator.step(Pose(0.0, 0.0), k * PERIOD_S, reading if k < 20 else None) for k in range(200)]
    moving = [k for k, command in enumerate(commands) if command != STANDSTILL]
    assert moving
    assert moving[-1] * PERIOD_S == pytest.approx(19 * PERIOD_S + 0.25, abs=1.5 * PERIOD_S)
    assert navigator.state is MotionState.FAILED
    assert "not answered" in navigator.reason


def test_a_journey_to_nowhere_is_our_own_mistake() -> None:
    with pytest.raises(ValueError, match="place to go to"):
        Navigator().start(Waypoints(()), Pose(0.0, 0.0))


@pytest.mark.parametrize("journey", [Waypoints(((math.nan, 0.0),)), Forward(math.inf)])
def test_a_journey_that_is_no_number_is_our_own_mistake(journey: Journey) -> None:
    with pytest.raises(ValueError, match="finite"):
        Navigator().start(journey, Pose(0.0, 0.0))


@pytest.mark.parametrize(
    ("command", "reading", "expected"),
    [
        (WheelCommand(3.0, 3.0), WheelReading(0, 0, 0.0, 3.0, 1.0, 0.1), True),
        (WheelCommand(-3.0, -3.0), WheelReading(0, 0, 0.0, -3.0, -1.0, -0.1), True),
        (WheelCommand(3.0, 3.0), WheelReading(0, 0, 2.0, 3.0, 1.0, 0.1), False),  # slow, but it turns
        (WheelCommand(3.0, 3.0), WheelReading(0, 0, 0.0, 3.0, 0.2, 0.1), False),  # it does not strain: it starts
        (WheelCommand(0.1, 0.1), WheelReading(0, 0, 0.0, 0.0, 1.0, 1.0), False),  # a crawl
        (WheelCommand(3.0, 3.0), WheelReading(0, 0, 0.0, 0.0, -1.0, -1.0), False),  # still braking from the other way
    ],
)
def test_what_counts_as_a_stall(command: WheelCommand, reading: WheelReading, expected: bool) -> None:
    watch = StallWatch()
    assert not watch.stalled(command, reading, 1.0)
    assert watch.stalled(command, reading, 1.0 + STALL_S) is expected


def test_a_motion_that_slips_for_ever_ends(robot: VirtualRobot) -> None:
    """The odometry creeps on, so there is progress; but no motion lasts longer than its way allows."""
    navigator = Navigator()
    navigator.start(Forward(1.0), Pose(0.0, 0.0))
    k = 0
    while navigator.state is MotionState.MOVING and k < 10_000:
        navigator.step(Pose(0.003 * k * PERIOD_S, 0.0), k * PERIOD_S, WheelReading(0.0, 0.0, 3.0, 3.0))
        k += 1
    assert navigator.state is MotionState.FAILED
    assert k * PERIOD_S < 30.0
