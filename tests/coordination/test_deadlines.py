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


@pytest.mark.parametrize("is_shared", [False, True])
@pytest.mark.parametrize("is_alone", [False, True])
def test_a_task_that_it_cannot_do_keeps_it_from_no_other_that_it_is_unsure_of(is_shared: bool, is_alone: bool) -> None:
    """It had heard once that the other one was done, and rested for ever."""
    one, two = plants(2)
    roster, cannot = ("Rob", "Bot"), frozenset() if is_shared else frozenset({1})
    role = Role("Rob", "plant", unable=cannot, roster=roster)
    robot = Coordination(role, (replace(one, robots=3 if is_shared else 1), two), random.Random(1))
    robot.heard(m.Utterance("Bot", m.ToTeam("plant")), 0.0)
    robot.knowledge.state, now = State.READY, robot.knowledge.timing.absent_s + 1.0 if is_alone else 1.0
    robot.board.complete(2, "Bot", hearsay=True)
    robot.knowledge.arm(now, 0.0)
    robot.tick(now)
    robot.tick(now + 1.0)
    assert robot.state is (State.CLAIMING if is_alone else State.ASKING)


def test_who_may_do_nothing_while_its_name_is_taken_does_what_it_is_unsure_of_afterwards() -> None:
    """It rested for ever."""
    robot, name_s = waiting(), NOW_S + 700.0
    robot.board.complete(1, "Bot", hearsay=True)
    robot.knowledge.acquaintance.own_name_heard_s = (name_s, name_s)
    robot.knowledge.arm(name_s, 0.0)
    while robot.state is State.READY:
        now = robot.next_deadline()
        assert now <= name_s + robot.knowledge.timing.name_conflict_s + 1.0
        robot.tick(now)
    assert robot.state is State.CLAIMING


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
