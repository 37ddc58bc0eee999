"""Robots in a row, each of which hears its neighbours only: two speak at once for the one between them, and neither
notices (the hidden terminals of Tobagi & Kleinrock 1975)."""

from __future__ import annotations

import math

import pytest

from hvcpd.config.tasks import Place, TaskDefinition, Tend, Wait
from hvcpd.coordination.entry import DONE
from tests.coordination.mission import Mission

NAMES = ("Rob", "Max", "Zoe")
NEIGHBOURS = {"Rob": ["Max"], "Max": ["Rob", "Zoe"], "Zoe": ["Max"]}
UNABLE = {name: frozenset({1}) for name in NAMES}


def row(tasks: int, **plan: object) -> Mission:
    """Tasks that are done on the spot, so that nobody comes nearer."""
    on_the_spot = tuple(TaskDefinition(n, f"job {n}", None, (Wait(20.0), Tend(5.0))) for n in range(1, tasks + 1))
    mission = Mission(NAMES, on_the_spot, earshot_m=100.0, limit_s=4000.0, **plan)
    for k, name in enumerate(NAMES):
        mission.bodies[name].place = Place(80.0 * k, 0.0)
    return mission


def met(mission: Mission) -> bool:
    return all(sorted(p.name for p in r.peers.all()) == NEIGHBOURS[name] for name, r in mission.robots.items())


def greet_at_once(seed: int) -> Mission:
    mission = row(1, seed=seed, unable=UNABLE)
    for robot in mission.robots.values():
        robot.knowledge.arm(0.0, 2.0)
    mission.go_on(60.0)
    return mission


def test_most_that_greet_at_once_have_met_after_a_minute_without_any_other_talk() -> None:
    """None had: the ends answered the one between within a quarter of a second of each other, again and again."""
    assert sum(met(greet_at_once(seed)) for seed in range(10)) >= 4


@pytest.mark.parametrize("seed", range(3))
def test_volunteers_in_a_row_meet_and_do_every_task_once(seed: int) -> None:
    """Of sixty such missions all did a task twice, and half of them did not end."""
    mission = row(6, seed=seed)
    assert not math.isinf(mission.run().ended_s)
    assert met(mission)
    assert mission.exactly_once


def test_a_report_of_what_somebody_else_has_done_too_is_confirmed() -> None:
    """It was answered "say again", without end."""
    mission = Mission(("Rob", "Max", "Zoe"), row(1).plan.tasks, seed=1, coordinator="Nobody")
    mission.air.run_until(30.0)
    for name in ("Rob", "Max"):
        mission.robots[name].board.complete(1, "Rob")
    mission.hear(31.0, "Hi all, I am Zoe, task one complete")
    mission.air.run_until(60.0)
    answers = [text for text in mission.written(31.5) if text.startswith("Hi Zoe")]
    assert len(answers) == 1
    assert answers[0].endswith("confirmed one complete")
    assert mission.robots["Max"].board[1].state == DONE


@pytest.mark.parametrize("seed", range(5))
def test_a_coordinator_with_nobody_to_order_finds_who_was_not_heard_to_greet(seed: int) -> None:
    """Rob cannot do it, and answers at once with Zoe, whom it does not hear; Zoe takes orders, and says no more."""
    mission = row(1, seed=seed, coordinator="Max", unable={"Rob": frozenset({1})})
    for robot in mission.robots.values():
        robot.knowledge.arm(0.0, 2.0)
    mission.go_on(300.0)
    assert mission.by == {1: "Zoe"}
