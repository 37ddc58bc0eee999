"""What a base that ROS has is told: leases, goals, and how it comes to a stand."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.ports import PlaceGoal
from hvcpd.ros.driving import LEASE_S, PERIOD_S, STAND, ZEROS_S, Cancel, Driving, Go, Order, Speeds


def drive(
    linear: float = 0.0, angular: float = 0.0, stopped: bool = False, goal: int | None = None
) -> dict[str, object]:
    to = None if goal is None else {"number": goal, "x_m": 1.0, "y_m": 2.0}
    return {"linear_m_s": linear, "angular_rad_s": angular, "stopped": stopped, "goal": to}


def after(driving: Driving, start_s: float, duration_s: float) -> list[tuple[float, Order]]:
    """The orders while nothing but time comes."""
    steps = round(duration_s / 0.01)
    return [(start_s + k * 0.01, each) for k in range(1, steps + 1) for each in driving.tick(start_s + k * 0.01)]


def test_speeds_go_on_at_the_usual_rate_and_no_faster() -> None:
    driving = Driving()
    orders = [each for k in range(100) for each in driving.on_event(drive(0.1, 0.2), k * 0.01)]
    assert set(orders) == {Speeds(0.1, 0.2)}
    assert len(orders) == pytest.approx(1.0 / PERIOD_S, abs=1)


def test_a_halt_goes_out_at_once_and_is_repeated_for_a_while() -> None:
    driving = Driving()
    driving.on_event(drive(0.1), 0.0)
    assert driving.on_event(drive(), 0.01) == [STAND]
    rest = [each for k in range(200) for each in driving.on_event(drive(), 0.02 + k * 0.01)]
    assert set(rest) == {STAND}
    assert len(rest) == pytest.approx(ZEROS_S / PERIOD_S, abs=2), "then others may drive by hand"


def test_stopped_means_zero_until_released() -> None:
    driving = Driving()
    orders = [each for k in range(500) for each in driving.on_event(drive(stopped=True), k * 0.01)]
    assert set(orders) == {STAND}
    assert len(orders) == pytest.approx(5.0 / PERIOD_S, abs=2)
    assert driving.on_event(drive(), 6.0) == []


def test_a_base_that_an_earlier_bridge_left_under_way_is_stopped_at_the_beginning() -> None:
    driving = Driving()
    driving.begin(0.0)
    orders = after(driving, 0.0, 2.0)
    assert {order for _, order in orders} == {STAND}
    assert max(at_s for at_s, _ in orders) == pytest.approx(ZEROS_S, abs=PERIOD_S + 0.011)


def test_a_silent_daemon_stops_the_base_within_half_a_second() -> None:
    driving = Driving()
    driving.on_event(drive(0.2, 0.1), 0.0)
    orders = after(driving, 0.0, 5.0)
    last_s = max(at_s for at_s, order in orders if order == Speeds(0.2, 0.1))
    first_zero_s = min(at_s for at_s, order in orders if order == STAND)
    assert last_s <= LEASE_S + 0.011 < first_zero_s + 0.011 < 0.5
    assert max(at_s for at_s, _ in orders) < first_zero_s + ZEROS_S + 0.02


def test_a_goal_is_given_once_and_keeps_cmd_vel_silent() -> None:
    driving = Driving()
    orders = [each for k in range(100) for each in driving.on_event(drive(goal=1), k * 0.01)]
    assert orders == [Go(PlaceGoal(1, 1.0, 2.0))]


def test_a_withdrawn_goal_is_cancelled_and_the_base_told_to_stand() -> None:
    driving = Driving()
    driving.on_event(drive(goal=1), 0.0)
    assert driving.on_event(drive(stopped=True), 0.05) == [Cancel(1), STAND]
    assert driving.on_event(drive(goal=2), 0.1) == [Go(PlaceGoal(2, 1.0, 2.0))]
    assert driving.on_event(drive(goal=3), 0.2) == [Cancel(2), Go(PlaceGoal(3, 1.0, 2.0)), *([])]


def test_a_finished_goal_is_not_given_again_though_the_daemon_knows_not_yet() -> None:
    driving = Driving()
    driving.on_event(drive(goal=1), 0.0)
    assert driving.finished(1)
    assert not driving.finished(1)
    assert not any(isinstance(each, Go | Cancel) for each in driving.on_event(drive(goal=1), 0.05))
    assert driving.on_event(drive(goal=2), 0.1)[0] == Go(PlaceGoal(2, 1.0, 2.0))


def test_when_the_daemon_is_lost_the_goal_is_withdrawn() -> None:
    driving = Driving()
    driving.on_event(drive(goal=1), 0.0)
    assert after(driving, 0.0, LEASE_S + 0.02)[0][1] == Cancel(1)
    assert driving.goal is None
    assert Go(PlaceGoal(1, 1.0, 2.0)) in driving.on_event(drive(goal=1), 2.0), "a daemon that was only late"


commands = st.builds(drive, st.floats(-1, 1), st.floats(-1, 1), st.booleans(), st.none() | st.integers(1, 3))


@given(st.lists(st.tuples(commands, st.floats(0.0, 1.0)), max_size=20))
def test_whatever_was_told_silence_ends_in_zero_and_without_a_goal(
    events: list[tuple[dict[str, object], float]],
) -> None:
    driving, now_s = Driving(), 0.0
    orders: list[Order] = []
    for event, pause_s in events:
        orders += driving.on_event(event, now_s)
        orders += [order for _, order in after(driving, now_s, pause_s)]
        now_s += pause_s
    orders += [order for _, order in after(driving, now_s, LEASE_S + 0.05)]
    speeds = [order for order in orders if isinstance(order, Speeds)]
    assert not speeds or speeds[-1] == STAND
    goals = [order for order in orders if not isinstance(order, Speeds)]
    assert not goals or isinstance(goals[-1], Cancel)
