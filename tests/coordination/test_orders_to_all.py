"""A person asks all robots for a task, as "complete task six": one answers, whatever they know of it."""

from __future__ import annotations

import pytest

from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

NAMES = ("Rob", "Bot", "Max")


def asked(text: str, at_s: float, names: tuple[str, ...] = NAMES, **plan: object) -> tuple[Mission, list[str]]:
    """A mission in which Anna says this, and what the robots answer her."""
    mission = Mission(names, plants(6), ("Anna",), seed=1, **plan)
    mission.hear(at_s, text)
    mission.air.run_until(1000.0)
    return mission, [line for line in mission.written(at_s) if line.startswith("Hi Anna")]


@pytest.mark.parametrize("to", ["Hi all, I am Anna", "Hi team plant, I am Anna", "Hi, I am Anna"])
@pytest.mark.parametrize(("at_s", "words"), [(30.0, "complete task six"), (30.0, "water the green rose")])
def test_what_is_still_to_be_done_is_promised_by_one_and_done_once(at_s: float, words: str, to: str) -> None:
    """They were silent."""
    mission, (answer,) = asked(f"{to}, please {words}", at_s)
    assert answer.endswith(f"task {'six' if 'six' in words else 'one'} again, change one")
    assert mission.exactly_once


def test_a_robot_that_is_alone_answers_too() -> None:
    mission, (answer,) = asked("Hi all, I am Anna, complete task two", 1.0, NAMES[:1])
    assert answer == "Hi Anna, I am Rob, task two again, change one"
    assert mission.exactly_once


def test_what_was_given_up_is_tried_again() -> None:
    failed: list[str] = []

    def fails(name: str, task: int, now: float) -> bool:
        return task == 6 and now < 400.0 and not failed.append(name)  # type: ignore[func-returns-value]

    mission, (answer,) = asked("Hi all, I am Anna, complete task six", 500.0, fails=fails)
    assert sorted(failed) == sorted(NAMES)
    assert answer.endswith("task six again, change one")
    assert mission.exactly_once


def test_that_nobody_knows_it_is_said_by_one() -> None:
    mission, (answer,) = asked("Hi all, I am Anna, complete task nine", 300.0)
    assert answer.endswith("I do not know task nine")
    assert mission.exactly_once


def test_a_task_of_others_is_refused_by_its_name() -> None:
    other = m.TaskByName("water the red rose")
    mission = Mission(NAMES, plants(2), ("Anna",), seed=1)
    mission.tell(300.0, "Anna", m.Utterance("Anna", m.ToAll(), None, m.Order(other)))
    mission.air.run_until(320.0)
    answers = [u.statement for at_s, who, u in mission.said if at_s > 300.0 and who != "Anna"]
    assert answers == [m.Unable(other)]
