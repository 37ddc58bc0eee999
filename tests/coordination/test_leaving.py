"""A robot that is told to end says so first."""

import pytest

from hvcpd.coordination.actions import Halt, SaveStopped, Say
from hvcpd.coordination.states import AT_WORK, State, Trigger
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants
from tests.coordination.test_stopping import call, row, stops

LEAVING = "Hi all, I am Rob, I am leaving"


def _until_rob_is_at_work(mission: Mission) -> int:
    rob = mission.robots["Rob"]
    mission.run_until(lambda: rob.state in AT_WORK, 0.5)
    return rob.knowledge.my_task()


def test_leaving_is_announced_and_frees_the_task_at_once() -> None:
    mission = Mission(("Rob", "Bot"), plants(3), seed=4)
    task = _until_rob_is_at_work(mission)
    told_s = mission.air.now
    assert mission.robots["Bot"].board[task].owner == "Rob"
    mission.leave("Rob")
    mission.run_until(lambda: "Rob" not in mission.robots)
    assert mission.written(told_s)[-1] == LEAVING
    mission.air.run_until(mission.air.now + 0.5)
    bot = mission.robots["Bot"]
    assert (bot.board[task].state, bot.board[task].owner) == ("open", None)
    assert not bot.peers.is_present("Rob", mission.air.now)
    ended_s = mission.run().ended_s
    assert mission.exactly_once
    assert mission.by[task] == "Bot"
    assert ended_s - told_s < 150.0, "no lease of 240 s was waited for"


def test_who_leaves_takes_no_change_of_which_it_could_tell_nobody() -> None:
    """The command said that the task is done again, and nobody did it."""
    mission = Mission(("Rob", "Bot"), plants(1), seed=4)
    mission.run()
    mission.leave("Rob")
    rob, now = mission.robots["Rob"], mission.air.now
    assert rob.change(1, False, now) == "Rob is leaving"
    assert rob.board.all_done
    assert mission.robots["Bot"].change(1, False, now) is None


def test_what_is_finished_is_reported_before_leaving() -> None:
    mission = Mission(("Rob", "Bot"), plants(2), seed=4)
    task = _until_rob_is_at_work(mission)
    mission.until("Rob", State.REPORTING)
    told_s = mission.air.now
    mission.leave("Rob")
    result = mission.run()
    number = {1: "one", 2: "two"}[task]
    said = [text for text in mission.written(told_s) if "I am Rob" in text]
    assert said == [f"Hi all, I am Rob, task {number} complete", LEAVING]
    assert (result.lost, result.duplicates) == (0, 0)


def test_who_leaves_answers_nobody_any_more() -> None:
    mission = Mission(("Rob", "Bot"), plants(2), ("Anna",), seed=4)
    mission.air.run_until(30.0)
    rob = mission.robots["Rob"]
    mission.run_until(lambda: rob.knowledge.floor.speaking is None and rob.knowledge.report.task is None)
    rob.channel(True, mission.air.now)  # somebody speaks, so that the farewell has to wait
    rob.leave(mission.air.now)
    for statement in (m.WhatLeft(), m.WhatDoing(), m.Order(m.TaskByNumber(1)), m.ComeBack()):
        rob.heard(m.Utterance("Anna", m.ToRobot("Rob"), None, statement), 40.0)
    rob.channel(False, 40.0)
    rob.actions(mission.air.now)
    said = []
    for tenth in range(400, 500):
        rob.tick(tenth / 10.0)
        texts = [mission.book.write(a.utterance) for a in rob.actions(mission.air.now) if hasattr(a, "utterance")]
        said += texts
        if texts:
            rob.spoken(tenth / 10.0 + 0.05)
    assert said == [LEAVING]
    assert rob.has_left


def test_a_sentence_that_is_being_said_is_ended_before_the_farewell() -> None:
    mission = Mission(("Rob", "Bot"), plants(2), seed=4)
    rob = mission.robots["Rob"]
    while (
        rob.knowledge.floor.speaking is None
        or rob.knowledge.floor.speaking.trigger is not Trigger.SPOKEN
        or rob.state is State.GREETING
    ):
        mission.air.run_until(mission.air.now + 0.05)
    mission.leave("Rob")
    mission.run()
    said = [text for text in mission.written() if "I am Rob" in text]
    assert "I will complete task" in said[-2]
    assert said[-1] == LEAVING


@pytest.mark.parametrize("when", ["before", "during", "after"])
def test_stop_is_obeyed_by_who_leaves_and_does_not_cut_its_farewell(when: str) -> None:
    """It ended in STOPPED, and its owner waited for a farewell that never came."""
    mission = Mission(("Rob", "Bot"), plants(2), seed=4)
    _until_rob_is_at_work(mission)
    rob, now = mission.robots["Rob"], mission.air.now
    stop = m.Utterance(None, m.ToRobot("Rob"), None, m.Stop())
    rob.leave(now)
    rob.actions(mission.air.now)
    if when == "before":
        rob.heard(stop, now)
    rob.tick(now + 5.0)
    if when == "during":
        rob.heard(stop, now + 6.0)
    actions = rob.actions(mission.air.now)
    rob.spoken(now + 7.0)
    if when == "after":
        rob.heard(stop, now + 8.0)
    rob.tick(now + 20.0)
    actions += rob.actions(mission.air.now)
    assert [mission.book.write(a.utterance) for a in actions if isinstance(a, Say)] == [LEAVING]
    assert SaveStopped(True) in actions, "it will stand when it is switched on again"
    assert Halt() in actions
    assert rob.has_left


@pytest.mark.parametrize("speaks", [False, True])
def test_who_leaves_passes_a_stop_for_all_on_and_then_says_farewell(speaks: bool) -> None:
    """It stopped, and said nothing of it: a robot out of the caller's earshot drove on."""
    mission = row(2)
    rob = mission.robots["Rob"]
    mission.leave("Rob")
    mission.run_until(lambda: not speaks or rob.knowledge.floor.speaking is not None)
    began_s = call(mission)
    assert stops(mission, began_s) == ["Rob", "Max", "Rob", "Max"]
    assert mission.written(began_s)[-2:] == [LEAVING, "Hi all, I am Max, I have stopped"]
    assert rob.has_left
    assert mission.stopped == {"Rob", "Max"}


def test_a_button_that_is_held_keeps_nobody_from_leaving_and_is_latched_once() -> None:
    """Its farewell was put off with each look at the button, and each wrote the latch."""
    mission = Mission(("Rob", "Bot"), plants(2), seed=4)
    _until_rob_is_at_work(mission)
    rob, began_s = mission.robots["Rob"], mission.air.now
    rob.leave(began_s)
    for n in range(400):
        assert rob.stop(began_s + 0.025 * n) is (n == 0)
        rob.tick(began_s + 0.025 * n)
    actions = rob.actions(began_s + 10.0)
    assert actions.count(SaveStopped(True)) == 1
    assert [mission.book.write(a.utterance) for a in actions if isinstance(a, Say)] == [LEAVING]
    assert rob.resume(began_s + 10.0)
    assert SaveStopped(False) in rob.actions(began_s + 10.0), "its next start is free"
    assert rob.stop(began_s + 10.1)


@pytest.mark.parametrize("seed", range(6))
def test_missions_in_which_a_robot_leaves_do_every_task_once(seed: int) -> None:
    mission = Mission(("Rob", "Bot", "Max"), plants(7), seed=seed, leaving={"Bot": 20.0 + 15.0 * seed})
    result = mission.run()
    assert "Bot" not in mission.robots
    assert (result.lost, result.duplicates) == (0, 0)


@pytest.mark.parametrize("begin_s", [20.0, 60.0, 67.0, 74.0, 81.0])
def test_robots_that_leave_together_say_so_one_after_the_other(begin_s: float) -> None:
    names = ("Rob", "Bot", "Max")
    mission = Mission(names, plants(6), seed=3)
    mission.air.run_until(begin_s)
    told_s = mission.air.now
    collisions = mission.air.collisions
    for name in names:
        mission.leave(name)
    mission.air.run_until(told_s + 20.0)
    farewells = [line for line in mission.written(told_s) if line.endswith("I am leaving")]
    assert sorted(farewells) == sorted(f"Hi all, I am {name}, I am leaving" for name in names)
    assert mission.air.collisions == collisions
