"""When a robot that has nothing to do looks again by itself, though nobody speaks."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace

import pytest

from hvcpd.coordination.actions import Role
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import plants

NOW_S, LATER_S = 100.0, 400.0


def waiting(robots: int = 1) -> Coordination:
    """A robot that is about to look what there is to do, with one task, for so many robots."""
    task = replace(plants(1)[0], robots=robots)
    robot = Coordination(Role("Rob", "plant", roster=("Rob", "Bot", "Zoe")), (task,), random.Random(1))
    robot.heard(m.Utterance("Bot", m.ToTeam("plant")), NOW_S - 50.0)
    robot.knowledge.state = State.READY
    robot.knowledge.arm(NOW_S, 0.0)
    return robot


def claimed_by_two(me: Knowledge) -> None:
    me.board.claim(1, "Bot", LATER_S + 1.0)
    me.board.claim(1, "Zoe", LATER_S)


def called_for_helpers(me: Knowledge) -> None:
    me.board[1].call_s = LATER_S


def asked_whether_it_is_done(me: Knowledge) -> None:
    me.board.complete(1, "Bot", hearsay=True)
    me.missed.ask_again_s = LATER_S


def heard_its_own_name_twice(me: Knowledge) -> None:
    """The first time counts no more then; the second, which counts for longer, may be a misheard word."""
    first_s = LATER_S - me.timing.name_conflict_s
    me.acquaintance.own_name_heard_s = (first_s, first_s + 50.0)


@pytest.mark.parametrize(
    "has", [claimed_by_two, called_for_helpers, asked_whether_it_is_done, heard_its_own_name_twice]
)
def test_a_robot_that_waits_looks_again_when_something_changes_by_itself(has: Callable[[Knowledge], None]) -> None:
    robot = waiting(robots=2)
    has(robot.knowledge)
    robot.tick(NOW_S)
    assert robot.next_deadline() == LATER_S


def test_what_it_is_unsure_of_next_it_asks_as_soon_as_ever() -> None:
    """The pauses between its questions had doubled while it was unsure of another task."""
    robot = waiting()
    missed = robot.knowledge.missed
    missed.asked = missed.left_out_asks = 10
    robot.board.claim(1, "Bot", LATER_S)
    robot.tick(NOW_S)
    assert (missed.asked, missed.left_out_asks) == (0, 0)


@pytest.mark.parametrize("confirmed", [True, False])
def test_who_is_confirmed_for_another_task_has_done_its_first_if_that_was_heard_surely(confirmed: bool) -> None:
    """Its report was missed, and it would count as at work until its lease is over; but the number of a claim that
    nobody confirms may have been misheard."""
    kim, (one, two) = Coordination(Role("Kim", "plant"), plants(2), random.Random(1)), map(m.TaskByNumber, (1, 2))
    for at_s, ref in ((0.0, one), (60.0, two)):
        kim.heard(m.Utterance("Rob", m.ToTeam("plant"), None, m.Claim(ref)), at_s)
        if confirmed or ref is two:
            kim.heard(m.Utterance("Max", m.ToRobot("Rob"), None, m.Confirmed(ref)), at_s + 5.0)
    assert kim.board.hearsay() == ((1,) if confirmed else ())
