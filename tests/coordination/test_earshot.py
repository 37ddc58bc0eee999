"""Robots whose voices carry some metres: who is not heard goes back, who orders in vain does it itself, and who was not
greeted is met all the same."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import Outage, WordMission, WordResult
from hil_fakes.word_plans import fading_plan
from hvcpd.config.tasks import GoTo, Place, TaskDefinition, Tend, Wait
from hvcpd.coordination.actions import Perform
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission
from tests.coordination.test_relaying import HERE

START = Place(-5.0, -5.0)
EARSHOT_M = 6.0
FAR = Place(6.0, 6.0)


def at(number: int, place: Place) -> TaskDefinition:
    colour = "green violet indigo".split()[number - 1]
    return TaskDefinition(number, f"water the {colour} rose", place, (GoTo(place), Tend(5.0)))


def far_mission(names: tuple[str, ...] = ("Rob", "Bot"), n: int = 2, **plan: object) -> Mission:
    """All plants are out of earshot of where the robots start."""
    tasks = tuple(at(k + 1, Place(FAR.x_m, FAR.y_m - k)) for k in range(n))
    return Mission(names, tasks, earshot_m=EARSHOT_M, **plan)


def near(a: Place, b: Place) -> bool:
    return math.hypot(a.x_m - b.x_m, a.y_m - b.y_m) < 0.5


def fly(seed: int, coordinate: bool) -> WordResult:
    return WordMission(fading_plan(seed, coordinate)).run()


@pytest.mark.parametrize("seed", range(12))
def test_in_coordinating_mode_no_task_is_lost_out_of_earshot(seed: int) -> None:
    result = fly(seed, coordinate=True)
    assert result.lost == 0


@pytest.mark.slow
def test_out_of_earshot_nothing_is_lost_and_most_missions_end() -> None:
    results = [fly(seed, coordinate) for seed in range(100, 140) for coordinate in (True, False)]
    assert sum(r.lost for r in results) == 0
    assert sum(math.isinf(r.ended_s) for r in results) <= 2, "of 80; 40 before robots went back"


def test_who_is_not_heard_goes_back_to_where_it_was_and_reports_there() -> None:
    mission = far_mission(coordinator="Bot", seed=3)
    mission.until("Rob", State.RETURNING, 0.5)
    mission.until("Rob", State.REPORTED, 0.5)
    assert near(mission.bodies["Rob"].at(mission.air.now), START)
    mission.run()
    assert mission.exactly_once
    assert set(mission.by.values()) == {"Rob"}


def test_it_goes_back_once_and_waits_there_if_nobody_is_left() -> None:
    mission = far_mission(coordinator="Bot", seed=3, outages=(Outage("Bot", 60.0, None),))
    mission.air.run_until(1800.0)
    robot = mission.robots["Rob"]
    ways = [at_s for at_s, who, u in mission.said if who == "Rob" and isinstance(u.statement, m.Completed)]
    assert ways, mission.written()
    assert robot.state is not State.RETURNING
    assert near(mission.bodies["Rob"].at(mission.air.now), START)


def test_stop_holds_on_the_way_back_and_resume_starts_no_old_motion() -> None:
    mission = far_mission(coordinator="Bot", seed=3)
    mission.until("Rob", State.RETURNING, 0.5)
    mission.air.run_until(mission.air.now + 5.0)
    mission.robots["Rob"].heard(m.Utterance("Eva", m.ToRobot("Rob"), None, m.Stop()), mission.air.now)
    mission.air.refresh(("Rob",))
    here = mission.bodies["Rob"].at(mission.air.now)
    assert mission.robots["Rob"].state is State.STOPPED
    assert not near(here, START)
    assert not near(here, FAR)
    mission.air.run_until(mission.air.now + 100.0)
    assert near(mission.bodies["Rob"].at(mission.air.now), here)
    mission.robots["Rob"].heard(m.Utterance("Eva", m.ToRobot("Rob"), None, m.Resume()), mission.air.now)
    assert not any(isinstance(action, Perform) for action in mission.robots["Rob"].actions(mission.air.now))
    assert mission.robots["Rob"].state is State.READY


def test_an_order_on_the_way_back_is_taken_where_it_is_heard() -> None:
    mission = far_mission(coordinator="Bot", seed=3)
    mission.until("Rob", State.RETURNING, 0.5)
    left = next(task for task in mission.plan.tasks if not mission.watered[task.number])
    order = m.Order(m.TaskByName(left.name))
    mission.robots["Rob"].heard(m.Utterance("Bot", m.ToRobot("Rob"), None, order), mission.air.now)
    mission.air.refresh(("Rob",))
    assert mission.robots["Rob"].state is State.READING_BACK
    assert mission.bodies["Rob"].moving is None


def test_what_does_not_let_it_back_makes_it_speak_where_it_is() -> None:
    mission = far_mission(coordinator="Bot", seed=3)
    mission.until("Rob", State.RETURNING, 0.5)
    since_s = mission.air.now
    mission.bodies["Rob"].halt(since_s)
    mission.robots["Rob"].perform_failed(since_s)
    mission.air.refresh(("Rob",))
    mission.air.run_until(since_s + 20.0)
    done = {1: "one", 2: "two"}[next(number for number, times in mission.watered.items() if times)]
    assert mission.written(since_s)[0] == f"Hi all, I am Rob, task {done} complete"


def test_a_volunteer_says_its_report_where_it_is_heard_before_it_claims_more() -> None:
    mission = far_mission(n=1, seed=5)
    mission.run()
    assert mission.exactly_once
    assert all(robot.board.all_done for robot in mission.robots.values())
    assert near(
        mission.bodies[mission.by[1]].at(mission.air.now), mission.robots[mission.by[1]].knowledge.body.home or FAR
    )


def test_who_orders_in_vain_gives_the_task_to_another_one() -> None:
    mission = far_mission(("Bot", "Max", "Rob"), coordinator="Rob", seed=1, outages=(Outage("Bot", 14.0, None),))
    result = mission.run()
    assert result.lost == 0
    assert set(mission.by.values()) == {"Max"}


def test_who_orders_in_vain_does_it_itself_when_nobody_is_left() -> None:
    mission = far_mission(coordinator="Bot", seed=3, outages=(Outage("Rob", 20.0, None),))
    result = mission.run()
    assert result.lost == 0
    assert set(mission.by.values()) == {"Bot"}


def test_who_gives_orders_and_never_heard_anybody_waits_and_calls_ever_more_rarely() -> None:
    mission = far_mission(("Bot",), coordinator="Bot", seed=3)
    mission.air.run_until(3600.0)
    calls_s = [at_s for at_s, _, u in mission.said if isinstance(u.statement, m.WhoHere)]
    gaps_s = [b - a for a, b in pairwise(calls_s)]
    assert mission.watered == {}
    assert len(gaps_s) >= 4
    assert gaps_s == sorted(gaps_s)


@pytest.mark.parametrize("seed", range(5))
def test_who_was_not_greeted_is_given_orders_all_the_same(seed: int) -> None:
    tasks = tuple(at(k + 1, Place(-4.0, -4.0 + k)) for k in range(3))
    tasks = tuple(replace(t, actions=(Wait(60.0), *t.actions)) for t in tasks)
    mission = Mission(("Rob", "Bot", "Zoe"), tasks, coordinator="Zoe", seed=seed)
    mission.air.earshot = lambda speaker, listener: (speaker, listener) != ("Rob", "Zoe") or mission.air.now > 30.0
    mission.run()
    assert mission.exactly_once
    assert set(mission.by.values()) == {"Rob", "Bot"}, mission.written()


@pytest.mark.parametrize("seed", range(5))
def test_who_gives_orders_learns_from_others_of_one_that_it_never_heard(seed: int) -> None:
    mission = Mission(
        ("Rob", "Max", "Zoe"), HERE, coordinator="Rob", earshot_m=100.0, unable={"Max": frozenset({1})}, seed=seed
    )
    for name, x_m in (("Rob", -80.0), ("Max", 0.0), ("Zoe", 80.0)):
        mission.bodies[name].place = Place(x_m, 0.0)
    mission.run()
    assert mission.by == {1: "Zoe"}, mission.written()


def test_a_follower_asks_more_and_more_rarely() -> None:
    mission = Mission(("Rob",), HERE, ("Bot", "Zoe"), coordinator="Nobody", seed=2)
    mission.tell(90.0, "Zoe", m.Utterance("Zoe", m.ToRobot("Bot"), None, m.Order(m.TaskByNumber(9))))
    mission.air.run_until(7200.0)
    asked_s = [at_s for at_s, _, u in mission.said if isinstance(u.statement, m.WhatLeft)]
    assert 4 <= len(asked_s) <= 40, "each question is said three times at most"
    assert max(asked_s) > 3600.0


def test_where_nobody_gives_orders_nobody_asks_for_them() -> None:
    mission = Mission(("Rob", "Bot"), HERE, coordinator="Nobody", seed=2, conditions=Conditions())
    mission.air.run_until(1800.0)
    assert not any(isinstance(u.statement, m.WhatLeft) for _, _, u in mission.said)


@pytest.mark.parametrize("report", [m.Completed(m.TaskByNumber(9)), m.Failed(m.TaskByNumber(9))])
def test_a_follower_learns_from_a_report_who_gives_orders(report: m.Statement) -> None:
    """One that was off while all orders were given waited for its own for ever: it never asked what is left."""
    mission = Mission(("Rob",), HERE, ("Bot", "Zoe"), coordinator="Nobody", seed=2)
    mission.tell(90.0, "Bot", m.Utterance("Bot", m.ToRobot("Zoe"), None, report))
    mission.air.run_until(600.0)
    assert any(isinstance(u.statement, m.WhatLeft) for _, _, u in mission.said)
