"""Who worked on what, and when, as the report draws it."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.reporting import events as ev
from hvcpd.reporting.story import Span, outcome, tell

STARTED = ev.Started(0.0, ("Rob", "Bot"), (), (), "volunteer", 1, 40.0)


def claimed(at_s: float, task: int, state: str = "claimed") -> ev.TaskChanged:
    return ev.TaskChanged(at_s, "Rob", task, state, "Rob" if state != "open" else None)


def spans(*events: ev.Event, end_s: float = 100.0) -> list[Span]:
    last = ev.Said(end_s - 1.0, end_s, 0, "Bot", "Hi all, I am Bot", False)
    return list(tell(ev.MissionRecord((STARTED, *events, last), (), np.zeros(0, np.float32))).spans)


def test_a_task_that_was_claimed_ahead_begins_when_the_one_before_is_done() -> None:
    """In the order in which the robot named them, which need not be that of their numbers."""
    done = [ev.Performed(40.0, "Rob", 3, 0.0, 0.0), claimed(40.0, 3, "done"), ev.Performed(70.0, "Rob", 1, 0.0, 0.0)]
    assert spans(claimed(5.0, 3), claimed(5.0, 1), *done) == [
        Span("Rob", 3, 5.0, 40.0, "done"),
        Span("Rob", 1, 40.0, 70.0, "done"),
    ]


def test_a_task_that_was_claimed_ahead_and_let_go_was_never_begun() -> None:
    found = spans(claimed(5.0, 3), claimed(20.0, 1), claimed(30.0, 1, "open"), ev.Performed(40.0, "Rob", 3, 0.0, 0.0))
    assert found == [Span("Rob", 3, 5.0, 40.0, "done")]


def test_a_robot_that_has_done_its_part_of_a_shared_task_has_not_given_it_up() -> None:
    """In that moment the task becomes the other robot's, who is still at it."""
    others = ev.TaskChanged(40.0, "Rob", 3, "claimed", "Bot")
    found = spans(claimed(5.0, 3), others, ev.Performed(40.0, "Rob", 3, 0.0, 0.0), claimed(50.0, 3, "done"))
    assert found == [Span("Rob", 3, 5.0, 40.0, "done")]


def test_what_is_not_done_in_the_end_is_unfinished() -> None:
    assert spans(claimed(5.0, 3)) == [Span("Rob", 3, 5.0, 100.0, "unfinished")]
    assert spans(claimed(5.0, 3), claimed(5.0, 1), ev.Performed(40.0, "Rob", 3, 0.0, 0.0)) == [
        Span("Rob", 3, 5.0, 40.0, "done"),
        Span("Rob", 1, 40.0, 100.0, "unfinished"),
    ]


def test_the_outcome_of_a_mission_that_was_stopped_says_so() -> None:
    """Three of five tasks were "not done", without a word of why; a robot had misheard another's sentence as "stop"."""
    counts = ({}, 0, 1, 0, 0, 0, 0.0, 0.0, 0.0, 0, "volunteer", (2,), ())
    assert outcome(ev.Summary(3, *counts, stopped=("Rob", "Bot"))) == (
        "Of 3 tasks, 1 not done: Rob and Bot stopped, and nobody said “resume”"
    )


@pytest.mark.parametrize(
    ("tasks", "words"),
    [
        (1, "The task was done exactly once"),
        (2, "Both tasks done, each exactly once"),
        (3, "All 3 tasks done, each exactly once"),
    ],
)
def test_the_outcome_counts_as_people_do(tasks: int, words: str) -> None:
    assert outcome(ev.Summary(tasks, {}, 0, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0, "volunteer")) == words
