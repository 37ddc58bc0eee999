"""The motion controller on a plant of a few lines: first-order wheels, perfect odometry, virtual time."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.hardware.kinematics import BURGER, advance_pose, twist_of, wrap_angle
from hvcpd.hardware.motion import (
    ACCELERATION_M_S2,
    LEASE_S,
    PATIENCE_S,
    SPEED_M_S,
    TOLERANCE_M,
    TURN_ACCELERATION_RAD_S2,
    TURN_RATE_RAD_S,
    Forward,
    Goal,
    GoTo,
    MotionController,
    MotionState,
    Turn,
)
from hvcpd.ports import STANDSTILL, Pose, WheelCommand

PERIOD_S = 0.02


@dataclass
class Plant:
    """A robot whose wheels follow with a lag of 0.1 s."""

    pose: Pose = field(default_factory=lambda: Pose(0.0, 0.0))
    left_rad_s: float = 0.0
    right_rad_s: float = 0.0
    now_s: float = 0.0
    commands: list[WheelCommand] = field(default_factory=list)

    def step(self, command: WheelCommand) -> None:
        share = 1.0 - math.exp(-PERIOD_S / 0.1)
        self.left_rad_s += (command.left_rad_s - self.left_rad_s) * share
        self.right_rad_s += (command.right_rad_s - self.right_rad_s) * share
        self.pose = advance_pose(self.pose, self.left_rad_s * PERIOD_S, self.right_rad_s * PERIOD_S)
        self.now_s += PERIOD_S
        self.commands.append(command)


def drive(
    goal: Goal, plant: Plant, limit_s: float = 60.0, seen: Callable[[float], None] | None = None
) -> MotionController:
    motion = MotionController()
    motion.start(goal, plant.pose)
    end_s = plant.now_s + limit_s
    while motion.state is MotionState.MOVING and plant.now_s < end_s:
        motion.renew(plant.now_s)
        plant.step(motion.step(plant.pose, plant.now_s))
        if seen:
            seen(motion.progress)
    return motion


@settings(deadline=None, max_examples=25)
@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-3.0, 3.0))
def test_go_to_arrives_within_its_tolerance(x_m: float, y_m: float, heading_rad: float) -> None:
    plant = Plant(Pose(0.0, 0.0, heading_rad))
    motion = drive(GoTo(x_m, y_m), plant)
    assert motion.state is MotionState.ARRIVED
    assert math.hypot(plant.pose.x_m - x_m, plant.pose.y_m - y_m) <= TOLERANCE_M


@pytest.mark.parametrize("distance_m", [2.0, 0.3, 0.01, -0.5])
def test_forward_goes_the_distance_straight(distance_m: float) -> None:
    plant = Plant(Pose(1.0, 1.0, 1.0))
    assert drive(Forward(distance_m), plant).state is MotionState.ARRIVED
    goal = (1.0 + distance_m * math.cos(1.0), 1.0 + distance_m * math.sin(1.0))
    assert (plant.pose.x_m, plant.pose.y_m) == pytest.approx(goal, abs=0.003)
    assert plant.pose.heading_rad == pytest.approx(1.0, abs=0.001)


@pytest.mark.parametrize("angle_deg", [90.0, -90.0, 180.0, 5.0, 720.0, -400.0])
def test_turn_turns_by_the_angle_on_the_spot(angle_deg: float) -> None:
    turned: list[float] = [0.0]
    plant = Plant()
    before = [0.0]

    def follow(_: float) -> None:
        turned[0] += wrap_angle(plant.pose.heading_rad - before[0])
        before[0] = plant.pose.heading_rad

    assert drive(Turn(math.radians(angle_deg)), plant, seen=follow).state is MotionState.ARRIVED
    assert math.degrees(turned[0]) == pytest.approx(angle_deg, abs=0.3)
    assert math.hypot(plant.pose.x_m, plant.pose.y_m) < 1e-6


@pytest.mark.parametrize("goal", [GoTo(-1.0, 0.5), Forward(1.0), Turn(2.0)])
def test_speed_is_a_trapezoid_within_the_limits(goal: Goal) -> None:
    plant = Plant()
    drive(goal, plant)
    twists = [twist_of(command) for command in plant.commands]
    assert max(abs(t.linear_m_s) for t in twists) <= SPEED_M_S + 1e-9
    assert max(abs(t.angular_rad_s) for t in twists) <= TURN_RATE_RAD_S + 1e-9
    for a, b in pairwise(twists[:-1]):
        assert abs(b.linear_m_s - a.linear_m_s) <= ACCELERATION_M_S2 * PERIOD_S + 1e-9
        assert abs(b.angular_rad_s - a.angular_rad_s) <= TURN_ACCELERATION_RAD_S2 * PERIOD_S + 1e-9
    wheel = max(max(abs(c.left_rad_s), abs(c.right_rad_s)) for c in plant.commands)
    assert wheel <= BURGER.max_wheel_rad_s + 1e-9


def test_a_place_behind_is_turned_to_before_driving() -> None:
    plant = Plant()
    drive(GoTo(-1.0, 0.0), plant)
    first = next(k for k, c in enumerate(plant.commands) if abs(twist_of(c).linear_m_s) > 1e-9)
    assert first * PERIOD_S > math.pi / TURN_RATE_RAD_S


def test_progress_rises_from_0_to_1() -> None:
    seen: list[float] = []
    drive(GoTo(1.0, 1.0), Plant(), seen=seen.append)
    assert seen == sorted(seen)
    assert seen[0] == pytest.approx(0.0, abs=0.01)
    assert seen[-1] == 1.0


def test_without_renewal_the_wheels_stand_after_half_a_second() -> None:
    motion, plant = MotionController(), Plant()
    motion.start(Forward(2.0), plant.pose)
    motion.renew(0.0)
    for _ in range(60):
        plant.step(motion.step(plant.pose, plant.now_s))
    moving = [k * PERIOD_S for k, command in enumerate(plant.commands) if command != STANDSTILL]
    assert moving[-1] == pytest.approx(LEASE_S, abs=1.5 * PERIOD_S)
    assert motion.state is MotionState.MOVING
    motion.renew(plant.now_s)
    plant.step(motion.step(plant.pose, plant.now_s))
    assert 0.0 < twist_of(plant.commands[-1]).linear_m_s <= ACCELERATION_M_S2 * PERIOD_S + 1e-9


def test_a_goal_never_renewed_never_moves() -> None:
    motion = MotionController()
    motion.start(Forward(1.0), Pose(0.0, 0.0))
    assert [motion.step(Pose(0.0, 0.0), k * PERIOD_S) for k in range(5)] == [STANDSTILL] * 5


def test_cancel_stands_still_at_once() -> None:
    motion, plant = MotionController(), Plant()
    motion.start(Forward(1.0), plant.pose)
    for _ in range(50):
        motion.renew(plant.now_s)
        plant.step(motion.step(plant.pose, plant.now_s))
    motion.cancel()
    assert motion.step(plant.pose, plant.now_s) == STANDSTILL
    assert motion.state is MotionState.IDLE


def blocked(motion: MotionController) -> float:
    """The wheels do not turn until the motion has ended, or for 20 s; how long that was, s."""
    now_s = 0.0
    while motion.state is MotionState.MOVING and now_s < 20.0:
        motion.renew(now_s)
        motion.step(Pose(0.0, 0.0), now_s)
        now_s += PERIOD_S
    return now_s


@pytest.mark.parametrize("goal", [GoTo(1.0, 1.0), Forward(1.0), Turn(1.0)])
def test_blocked_wheels_end_in_failure_with_a_reason(goal: Goal) -> None:
    motion = MotionController()
    motion.start(goal, Pose(0.0, 0.0))
    now_s = blocked(motion)
    assert motion.state is MotionState.FAILED
    assert "no progress" in motion.reason
    assert now_s == pytest.approx(PATIENCE_S, abs=0.1)
    assert motion.step(Pose(0.0, 0.0), now_s) == STANDSTILL


def test_a_new_goal_clears_a_failure() -> None:
    motion = MotionController()
    motion.start(Forward(1.0), Pose(0.0, 0.0))
    blocked(motion)
    assert motion.state is MotionState.FAILED
    motion.start(Turn(1.0), Pose(0.0, 0.0))
    assert (motion.state, motion.reason, motion.progress) == (MotionState.MOVING, "", 0.0)


def test_a_goal_that_is_no_number_is_our_own_mistake() -> None:
    with pytest.raises(ValueError, match="finite"):
        MotionController().start(Forward(math.inf), Pose(0.0, 0.0))
