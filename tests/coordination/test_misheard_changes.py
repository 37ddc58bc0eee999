"""A robot that mishears which task is to be done again, or left out, does not open or close another one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hvcpd.coordination.coordination import Coordination
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

NAMES = ("Rob", "Bot", "Max")
DONE_S, END_S = 400.0, 1300.0
TWO, THREE = m.TaskByNumber(2), m.TaskByNumber(3)
TOLD = m.Utterance("Rob", m.ToAll(), None, m.Change(TWO, count=1))


def all_done() -> Mission:
    mission = Mission(NAMES, plants(3), ("Anna",), seed=1)
    mission.air.run_until(DONE_S)
    return mission


def first_to_answer() -> str:
    mission = all_done()
    mission.hear(DONE_S, "Hi all, I am Anna, task three again")
    mission.air.run_until(DONE_S + 5.0)
    return mission.said[-1][1]


def one_hears_task_two(mishears: str) -> Mission:
    """Anna asks for task three; one robot hears "task two"."""
    mission = all_done()

    def misses(listener: str, u: m.Utterance) -> bool:
        wrong = listener == mishears and u.speaker == "Anna"
        if wrong:
            mission.robots[listener].heard(replace(u, statement=m.Change(TWO)), mission.air.now)
        return wrong

    mission.air.misses = misses
    mission.hear(DONE_S, "Hi all, I am Anna, task three again")
    mission.air.run_until(END_S)
    assert all(robot.board.all_done for robot in mission.robots.values()), mission.written(DONE_S)
    return mission


@pytest.mark.parametrize("skip", [False, True])
def test_a_change_that_somebody_passes_on_must_be_heard_twice(skip: bool) -> None:
    mission = all_done() if not skip else Mission(NAMES, plants(3), ("Anna",), seed=1)
    bot, now = mission.robots["Bot"], mission.air.now
    told = replace(TOLD, statement=m.Change(TWO, skip, 1))
    bot.heard(told, now)
    assert bot.board[2].known_done is not skip
    bot.heard(replace(told, speaker="Max"), now + 60.0)
    assert bot.board[2].known_done is skip


def heard_before(after_s: float) -> Coordination:
    """Bot has heard that task two is to be done again, and then a claim of it."""
    mission = all_done()
    bot, now = mission.robots["Bot"], mission.air.now
    bot.heard(TOLD, now)
    bot.heard(m.Utterance("Max", m.ToTeam("plant"), None, m.Claim(TWO)), now + after_s)
    return bot


@pytest.mark.parametrize(("after_s", "counts"), [(10.0, True), (1000.0, False)])
def test_a_claim_of_that_task_is_the_second_time(after_s: float, counts: bool) -> None:
    assert heard_before(after_s).board.owner_of_claim(2) == ("Max" if counts else None)


def test_who_has_objected_believes_the_answer_at_once() -> None:
    mission = all_done()
    owner = mission.robots["Rob"].board[2].owner
    other = next(name for name in NAMES if name != owner)
    assert owner is not None
    mission.hear(mission.air.now, f"Hi all, I am {other}, I will complete task two")
    mission.air.run_until(mission.air.now + 8.0)
    robot = mission.robots[owner]
    robot.heard(replace(TOLD, speaker=other, addressee=m.ToRobot(owner)), mission.air.now)
    assert not robot.board[2].known_done


def test_who_hears_another_one_answer_for_another_task_has_misheard() -> None:
    mishears = next(name for name in NAMES if name != first_to_answer())
    assert one_hears_task_two(mishears).watered == {1: 1, 2: 1, 3: 2}


def test_what_is_answered_is_what_is_done() -> None:
    """So Anna, who hears the answer, knows what she has to correct."""
    assert one_hears_task_two(first_to_answer()).watered == {1: 1, 2: 2, 3: 1}


def test_who_knows_of_more_changes_than_the_one_that_answers_corrects_the_number() -> None:
    first, mission = first_to_answer(), all_done()
    for name, robot in mission.robots.items():
        if name != first:
            robot.board.change(3, 1, False)
    mission.hear(DONE_S, "Hi all, I am Anna, task three again")
    mission.air.run_until(END_S)
    assert mission.watered == {1: 1, 2: 1, 3: 2}
    assert {robot.board[3].change for robot in mission.robots.values()} == {2}


@pytest.mark.parametrize("skip", [False, True])
def test_who_answers_a_wish_and_has_missed_an_earlier_change_is_told_the_number(skip: bool) -> None:
    """The others had heard Anna, too, and said to it that the task is complete, or to be done again."""
    nobody = {name: frozenset({3}) for name in NAMES}
    wish = "skip task three" if skip else "task three again"

    def asked(change: int, newcomer: str | None = None) -> Mission:
        mission = Mission(NAMES, plants(3), ("Anna",), seed=1, unable=nobody)
        mission.air.run_until(DONE_S)
        for name, robot in mission.robots.items():
            if not skip:
                robot.board.complete(3, "Rob")
            robot.board.change(3, 0 if name == newcomer else change, False)
        mission.hear(DONE_S, f"Hi all, I am Anna, {wish}")
        mission.air.run_until(DONE_S + 60.0)
        return mission

    first = next(name for at_s, name, _ in asked(0).said if at_s > DONE_S and name != "Anna")
    mission = asked(1, newcomer=first)
    assert mission.written(DONE_S)[0] == f"Hi Anna, I am {first}, {wish}, change one"
    assert {(robot.board[3].known_done, robot.board[3].change) for robot in mission.robots.values()} == {(skip, 2)}
