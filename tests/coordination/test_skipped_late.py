"""Tasks that people leave out, or want again, while a robot has them, or is away: what is said of them is so."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from hvcpd.coordination.actions import Role
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.states import State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from tests.coordination.mission import Mission, plants
from tests.coordination.test_changing import LATER_S, NAMES, said_by_anna


def _until_begun(mission: Mission, state: State) -> str:
    """Run until some robot is in the state; its name."""
    while not (found := [name for name, robot in mission.robots.items() if robot.state is state]):
        mission.air.run_until(mission.air.now + 0.1)
    return found[0]


@pytest.mark.parametrize("size", [2, 3, 6])
@pytest.mark.parametrize("seed", range(4))
def test_only_who_is_at_a_task_answers_that_it_is_not_left_out(size: int, seed: int) -> None:
    """Another robot spoke in the same slot, and then said that the task is left out."""
    mission = Mission(("Rob", "Bot", "Max", "Ann", "Mia", "Ted")[:size], plants(3), ("Anna",), seed=seed)
    mission.holds_motion = True
    doer = _until_begun(mission, State.GOING)
    mission.air.run_until(mission.air.now + 40.0)  # all tasks are claimed
    began_s = mission.air.now
    rob = mission.robots[doer]
    rob.performed(began_s)
    mission.air.refresh()
    mission.run_until(lambda: rob.state is State.ACTING and not mission.air.speaking, 0.5)
    asked_s, number = mission.air.now, rob.task
    assert number is not None
    said_by_anna(mission, asked_s, number, skip=True)
    mission.air.run_until(asked_s + 12.0)
    answers = [text for text in mission.written(asked_s) if text.startswith("Hi Anna")]
    assert answers == [f"Hi Anna, I am {doer}, completing task {('one', 'two', 'three')[number - 1]}"]
    assert not any(robot.board[number].skipped for robot in mission.robots.values())


def test_who_begins_before_it_could_say_that_its_task_is_left_out_does_not_say_so() -> None:
    """Rob said "skip task one, change one", and carried it out."""
    mission = Mission(("Rob",), plants(1), ("Anna",), seed=1)
    mission.holds_motion = True
    _until_begun(mission, State.GOING)
    asked_s, rob = mission.air.now, mission.robots["Rob"]
    rob.heard(mission.book.parse_text("Hi Rob, I am Anna, skip task one"), asked_s)
    fire(rob.knowledge, Trigger.ARRIVED_SURE, asked_s)
    mission.go_on(asked_s + 5.0)
    assert mission.written(asked_s) == ["Hi Anna, I am Rob, completing task one"]
    assert not rob.board[1].skipped


def test_who_has_begun_when_another_robot_says_that_its_task_is_left_out_tells_it() -> None:
    """Anna heard "skip task one" from Bot, and Rob carried it out without a word."""
    mission = Mission(("Rob", "Bot"), plants(1), ("Anna",), seed=1)
    mission.holds_motion = True
    doer = _until_begun(mission, State.GOING)
    other = "Bot" if doer == "Rob" else "Rob"
    mission.air.run_until(mission.air.now + 20.0)
    robot, asked_s = mission.robots[doer], mission.air.now
    robot.heard(mission.book.parse_text("Hi all, I am Anna, skip task one"), asked_s)
    fire(robot.knowledge, Trigger.ARRIVED_SURE, asked_s)
    robot.heard(mission.book.parse_text(f"Hi Anna, I am {other}, skip task one, change one"), asked_s + 0.3)
    mission.go_on(asked_s + 8.0)
    assert mission.written(asked_s)[0] == f"Hi {other}, I am {doer}, task one again, change one"
    assert robot.state is State.ACTING


@pytest.mark.parametrize("has_heard", [False, True])
def test_who_has_a_task_and_has_not_heard_that_it_is_wanted_again_has_not_done_it(has_heard: bool) -> None:
    """Max, which was off when task one was skipped, took it for done since Bot left it out; then nobody did it."""
    max_ = Coordination(Role("Max", "plant", roster=NAMES), plants(2), random.Random(1), None, {1: ("claimed", "Bot")})
    book = Phrasebook(Vocabulary((*NAMES, "Anna"), ("plant",), (), (1, 2)))
    for at_s, speaker in ((1.0, "Anna"), (6.0, "Rob")):
        max_.heard(book.parse_text(f"Hi all, I am {speaker}, task one again, change two"), at_s)
    assert max_.board[1].change == 2
    if has_heard:
        max_.heard(book.parse_text("Hi all, I am Bot, I will complete task one"), 9.0)
    max_.heard(book.parse_text("Hi Max, I am Bot, task two left"), 12.0)
    assert max_.board[1].known_done is has_heard


def test_who_is_believed_to_have_done_what_was_left_out_says_so_and_is_believed() -> None:
    """Bot, which was off, said "Max says, task one complete"; Max denied that, and then it was done."""
    mission = Mission(NAMES, plants(2), ("Anna",), seed=1)
    skipped = mission.book.parse_text("Hi all, I am Anna, skip task one, change one")
    for name in ("Max", "Rob"):
        mission.robots[name].board.change(1, 1, True)
    bot = mission.robots["Bot"]
    bot.board.complete(1, "Max")
    bot.heard(replace(skipped, speaker="Rob"), 0.5)
    mission.go_on(LATER_S)
    said = mission.written(without=("Anna",))
    assert "Hi Rob, I am Bot, Max says, task one complete, change one" in said
    assert "Hi Bot, I am Max, skip task one, change one" in said
    assert mission.watered == {2: 1}
    assert all(robot.board[1].skipped for robot in mission.robots.values())
