"""A task for three robots: whoever is late is waited for, and nobody for ever."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from hil_fakes.word_mission import Outage, WordMission, WordPlan
from hvcpd.config.tasks import GoTo, Place, TaskDefinition, Wait
from hvcpd.coordination.actions import Role
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Watched
from tests.coordination.test_teaming import NAMES, shared

HERE, FAR = Place(0.0, 1.0), Place(0.0, 60.0)


@pytest.mark.parametrize("seed", range(3))
def test_two_wait_for_a_third_that_has_far_to_go(seed: int) -> None:
    task = TaskDefinition(1, "water the green rose", HERE, (GoTo(HERE), Wait(5.0)), robots=3)
    mission = WordMission(WordPlan(NAMES, (task,), seed, starts={"Max": FAR}), keep=True)
    mission.run()
    assert mission.watered[1] == 3
    assert not any(isinstance(m.own_words(u.statement), m.Failed) for _, _, u in mission.said)


@pytest.mark.parametrize("seed", range(3))
def test_two_do_not_wait_for_ever_for_a_third_that_was_switched_off(seed: int) -> None:
    """Each took the other's repeated answer for a reason to wait."""
    plan = WordPlan((*NAMES, "Zoe"), shared(1, 3), seed, outages=(Outage("Max", 25.0, None),))
    result = WordMission(plan).run()
    assert result.lost == 0
    assert result.ended_s < 600.0


@pytest.mark.parametrize("seed", range(3))
def test_three_begin_again_after_one_was_switched_off_before_its_part(seed: int) -> None:
    """The other two said for ever that they had done theirs, and two of the three never joined each other."""
    plan = WordPlan(NAMES, shared(1, 3), seed)
    whole = Watched(plan)
    whole.run()
    (first_s, *_), *_, (_, last, _) = whole.begun
    result = WordMission(replace(plan, outages=(Outage(last, first_s + 1.0, 60.0),))).run()
    assert result.lost == 0
    assert result.ended_s < 700.0


@pytest.mark.parametrize("state", [State.PROPOSED, State.GOING])
@pytest.mark.parametrize("others", [("Ada", "Max"), ("Max", "Rob")])
def test_who_is_one_of_the_three_does_not_leave_the_task_to_the_other_two(
    state: State, others: tuple[str, str]
) -> None:
    """It left when it heard these two agree, claimed the task again, and left again, while they waited for it."""
    kim = Coordination(Role("Kim", "plant", roster=("Ada", "Kim", "Max", "Rob")), shared(1, robots=3), random.Random(1))
    for name in (*others, "Kim"):
        kim.board.claim(1, name, 250.0)
    kim.knowledge.state, kim.knowledge.current.task = state, 1
    for at_s, (one, other) in enumerate((others, others[::-1])):
        kim.heard(m.Utterance(one, m.ToRobot(other), None, m.Confirmed(m.TaskByNumber(1))), 10.0 + 5.0 * at_s)
    assert kim.state is state
    assert kim.board[1].team == {"Kim", *others}
