"""Ways that somebody else finds: when a place is asked for, withdrawn, reached or given up."""

import pytest

from hvcpd.hardware.goals import GoalNavigator
from hvcpd.hardware.motion import Forward, GoTo, MotionState
from hvcpd.hardware.navigator import BLIND_LIMIT_S
from hvcpd.ports import STANDSTILL, PlaceGoal, Pose, WheelReading

HERE = Pose(0.0, 0.0)
READ = WheelReading(0.0, 0.0)


def going() -> GoalNavigator:
    navigator = GoalNavigator()
    navigator.start(GoTo(1.0, 2.0), HERE)
    assert navigator.step(HERE, 0.0, READ) == STANDSTILL
    return navigator


def test_a_place_becomes_a_goal_and_its_arrival_the_end() -> None:
    navigator = going()
    assert navigator.goal == PlaceGoal(1, 1.0, 2.0)
    assert navigator.state is MotionState.MOVING
    navigator.tell(1, arrived=True)
    assert navigator.goal is None
    assert navigator.state is MotionState.ARRIVED
    assert navigator.step(HERE, 0.1, READ) == STANDSTILL
    assert navigator.goal is None, "asked for again after the arrival"


def test_a_goal_that_cannot_be_reached_has_failed_with_the_reason() -> None:
    navigator = going()
    navigator.tell(1, arrived=False, reason="no way there")
    assert (navigator.state, navigator.reason) == (MotionState.FAILED, "no way there")


def test_word_of_another_goal_changes_nothing() -> None:
    navigator = going()
    navigator.rest()
    assert navigator.goal is None
    navigator.step(HERE, 0.1, READ)
    assert navigator.goal == PlaceGoal(2, 1.0, 2.0)
    navigator.tell(1, arrived=True)
    assert navigator.state is MotionState.MOVING
    navigator.tell(2, arrived=True)
    assert navigator.state is MotionState.ARRIVED


def test_cancelled_it_is_withdrawn_and_not_asked_for_again() -> None:
    navigator = going()
    navigator.cancel()
    navigator.step(HERE, 0.1, READ)
    assert navigator.goal is None
    assert navigator.state is MotionState.IDLE


def test_without_word_of_the_base_it_fails_after_a_while() -> None:
    navigator = going()
    navigator.step(HERE, BLIND_LIMIT_S, None)
    assert navigator.state is MotionState.MOVING
    navigator.step(HERE, BLIND_LIMIT_S + 0.1, None)
    assert navigator.state is MotionState.FAILED
    assert navigator.goal is None


@pytest.mark.parametrize("before", [False, True])
def test_relative_motions_stay_its_own(before: bool) -> None:
    navigator = going() if before else GoalNavigator()
    navigator.start(Forward(1.0), HERE)
    for block in range(10):
        command = navigator.step(HERE, block * 0.025, READ)
    assert navigator.goal is None
    assert command.left_rad_s > 0.0
