"""A task for two that people ask for again and again: whoever has missed what, two do it each time, and all know."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hvcpd.coordination.states import PROPOSING
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

NAMES = ("Rob", "Bot", "Max")
FIRST_S, SECOND_S, END_S = 200.0, 700.0, 1500.0


class Pairs(Mission):
    """Anna asks all for a task for two, twice. Notes who denies it to others before it has it itself."""

    def __init__(self, seed: int) -> None:
        self.rash: list[str] = []
        on_demand = (
            replace(task, on_demand=task.number == 2, robots=2 if task.number == 2 else 1) for task in plants(3)
        )
        super().__init__(NAMES, tuple(on_demand), ("Anna",), seed=seed)
        for at_s in (FIRST_S, SECOND_S):
            self.hear(at_s, "Hi all, I am Anna, water the violet rose")

    def speak(self, speaker: str, utterance: m.Utterance, slowly: bool = False, times: int = 1) -> None:
        robot = self.robots.get(speaker)
        if (
            robot is not None
            and utterance.statement == m.Negative()
            and robot.state in PROPOSING
            and robot.board[2].owner != speaker
        ):
            self.rash.append(speaker)
        super().speak(speaker, utterance, slowly, times)

    def check(self) -> None:
        self.air.run_until(END_S)
        said = "\n".join(self.written(FIRST_S))
        assert self.watered[2] == 4, said
        assert all(robot.board.all_done for robot in self.robots.values()), said
        assert not [u for _, who, u in self.said if u.addressee == m.ToRobot(who)], said


@pytest.mark.parametrize("seed", [1, 3, 12, 14])
def test_two_do_it_each_time_and_all_know(seed: int) -> None:
    Pairs(seed).check()


@pytest.mark.parametrize("deaf", NAMES)
def test_who_has_heard_no_report_is_told_that_it_is_done_and_believes_it(deaf: str) -> None:
    mission = Pairs(seed=2)
    mission.air.misses = lambda listener, u: listener == deaf and isinstance(m.own_words(u.statement), m.Completed)
    mission.check()


def test_who_did_the_last_part_may_not_have_heard_of_the_first() -> None:
    mission = Pairs(seed=2)
    mission.air.run_until(SECOND_S - 100.0)
    last = mission.robots["Rob"].board[2].owner
    assert last is not None
    mission.hear(mission.air.now, f"Hi all, I am {last}, task two again, change two")
    mission.air.run_until(SECOND_S - 90.0)
    answers = [u.statement for at_s, who, u in mission.said if at_s > SECOND_S - 100.0 and who != last]
    assert answers[:1] == [m.Confirmed(m.TaskByNumber(2), complete=True)], mission.written(SECOND_S - 100.0)


@pytest.mark.parametrize("deaf", NAMES)
def test_who_does_not_know_that_it_is_asked_for_again_and_objects_is_corrected(deaf: str) -> None:
    """Its "confirmed two complete" has no number; all took it for an answer to a report of the claimant."""
    mission = Pairs(seed=2)
    mission.air.misses = lambda listener, u: (
        listener == deaf
        and mission.air.now > SECOND_S
        and isinstance(u.statement, m.Order | m.Change)
        and u.addressee != m.ToRobot(deaf)
    )
    mission.check()


def test_who_has_not_been_accepted_yet_denies_the_task_to_nobody_else_who_wants_to_join() -> None:
    """The first one had just accepted the other, which did not hear that over the denial, and so waited in vain."""
    missions = [Pairs(seed) for seed in range(20)]
    for mission in missions:
        mission.air.run_until(FIRST_S + 100.0)
    assert [mission.rash for mission in missions] == [[]] * len(missions)
