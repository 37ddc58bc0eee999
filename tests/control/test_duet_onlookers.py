"""What is shown of a duet to who visits it, and what becomes of a visitor whom nobody answers."""

from __future__ import annotations

import io
from collections.abc import Callable

import pytest

from hvcpd.control.duet.onlookers import ANSWER_S, LATER, TIMES, TYPED_BYTES, UNHEARD, Onlooker, TypedLines, Visit


def visit(times: list[float], addressee: str = "", may_wait: bool = False, is_stop: bool = False) -> Visit:
    """A visit whose sentence is said at once; `times` grows by each time that it is said."""

    def say() -> Callable[[], bool]:
        times.append(0.0)
        return lambda: True

    return Visit("Anna: what is left", say, addressee, may_wait, is_stop)


def test_a_visitor_whom_nobody_understands_says_it_again_and_is_then_told_so_once() -> None:
    out, times = io.StringIO(), list[float]()
    onlooker = Onlooker(["Rob", "Bot"], out)
    onlooker.visited(visit(times), 5.0)
    onlooker.look(5.0)
    onlooker.look(5.0 + ANSWER_S)
    assert len(times) == 1
    onlooker.look(5.5 + ANSWER_S)
    assert len(times) == TIMES == 2
    onlooker.tell({"event": "said", "text": "Hi all, I am Rob, task one complete", "at_s": 6.0}, "Rob")
    onlooker.look(6.0 + ANSWER_S)
    assert UNHEARD not in out.getvalue()
    onlooker.look(6.5 + 2 * ANSWER_S)
    onlooker.look(7.0 + 3 * ANSWER_S)
    assert out.getvalue().startswith(" 0:05  Anna: what is left\n")
    assert out.getvalue().count(UNHEARD) == 1
    assert len(times) == TIMES


@pytest.mark.parametrize("event", ["heard", "held", "statechanged"])
def test_a_visitor_who_is_understood_is_told_nothing_and_says_nothing_more(event: str) -> None:
    out, times = io.StringIO(), list[float]()
    onlooker = Onlooker(["Rob", "Bot"], out)
    onlooker.visited(visit(times), 5.0)
    onlooker.look(5.0)
    told = {"event": event, "speaker": "somebody", "text": "Bot stop", "state": "stopped", "at_s": 5.1}
    onlooker.tell(told, "Bot")
    onlooker.look(6.0 + ANSWER_S)
    shown = out.getvalue()
    assert event == "statechanged" or "Bot heard you" in shown or "Bot stood still" in shown
    assert UNHEARD not in out.getvalue()
    assert len(times) == 1


def test_a_call_to_one_robot_is_repeated_until_that_robot_reacts() -> None:
    out, times = io.StringIO(), list[float]()
    onlooker = Onlooker(["Rob", "Bot"], out)
    onlooker.visited(visit(times, "Bot"), 5.0)
    onlooker.look(5.0)
    heard = {"event": "heard", "speaker": "somebody", "text": "Bot stop", "at_s": 5.1}
    onlooker.tell(heard, "Rob")
    onlooker.look(5.5 + ANSWER_S)
    assert len(times) == 2, "Bot has not reacted"
    onlooker.tell({**heard, "at_s": 9.8}, "Bot")
    onlooker.look(6.0 + 2 * ANSWER_S)
    onlooker.look(6.5 + 3 * ANSWER_S)
    assert len(times) == 2
    assert UNHEARD not in out.getvalue()


def test_a_call_that_robots_pass_on_or_hear_again_as_a_whole_is_shown_once() -> None:
    out = io.StringIO()
    onlooker = Onlooker(["Rob", "Bot"], out)
    heard = {"event": "heard", "speaker": "somebody", "text": "Stop"}
    onlooker.tell({**heard, "at_s": 5.0}, "Rob")
    onlooker.tell({**heard, "at_s": 4.6}, "Rob")
    onlooker.tell({"event": "said", "text": "Stop", "at_s": 6.0}, "Rob")
    onlooker.tell({**heard, "at_s": 6.2}, "Bot")
    assert out.getvalue() == " 0:05  Rob heard you: Stop\n 0:06  Rob: Stop\n"


def test_lines_that_come_in_pieces_are_put_together() -> None:
    """Of a script in a pipe, the sentence at byte 4096 was cut in two."""
    typed = TypedLines()
    assert typed.take(b"all sto") == []
    assert typed.take(b"p\n\n \r\nRob, re\xc3") == ["all stop"]
    assert typed.take(b"\xa9") == []
    assert typed.take(b"") == ["Rob, re\u00e9"], "the end of the input ends the line"
    assert typed.take(b"") == []
    assert typed.take(b"x" * TYPED_BYTES) == ["x" * TYPED_BYTES], "no line is kept for ever"


def test_what_was_typed_cannot_steer_the_terminal() -> None:
    out = io.StringIO()
    onlooker = Onlooker(["Rob", "Bot"], out)
    onlooker.note("'\x1b[31m' is not in the phrasebook")
    onlooker.tell({"event": "heard", "speaker": "somebody", "text": "Stop\x07", "at_s": 4.0}, "Rob")
    assert all(c.isprintable() for c in out.getvalue().replace("\n", ""))


def test_the_time_of_the_lines_never_goes_back() -> None:
    """A robot tells of a sentence once it is over, and of a "stop" perhaps seconds later; its line had the time of the
    beginning, and stood below later ones."""
    out = io.StringIO()
    onlooker = Onlooker(["Rob", "Bot"], out)
    onlooker.tell({"event": "said", "text": "Stop", "at_s": 46.5}, "Bot")
    onlooker.tell({"event": "heard", "speaker": "somebody", "text": "All stop", "at_s": 44.4}, "Rob")
    onlooker.tell({"event": "held", "at_s": 45.1}, "Rob")
    assert [line[:5] for line in out.getvalue().splitlines()] == [" 0:46"] * 3


def test_a_question_before_any_robot_has_spoken_waits_for_that_but_a_stop_does_not() -> None:
    out, asked, called = io.StringIO(), list[float](), list[float]()
    onlooker = Onlooker(["Rob", "Bot"], out)
    onlooker.visited(visit(asked, may_wait=True), 0.0)
    onlooker.visited(visit(called), 0.0)
    assert (len(asked), len(called)) == (0, 1)
    assert out.getvalue().count(LATER) == 1
    said = {"event": "said", "text": "Hi all, I am Rob, member of team plant", "at_s": 6.0}
    onlooker.tell(said, "Rob")
    onlooker.tell({**said, "at_s": 9.0}, "Rob")
    assert len(asked) == 1
    onlooker.visited(visit(asked, may_wait=True), 10.0)
    assert len(asked) == 2
    assert out.getvalue().count(LATER) == 1


def test_a_stop_takes_the_place_of_what_waits_for_a_robot_to_speak() -> None:
    """It was said after the stop, as soon as a robot had spoken."""
    asked = list[float]()
    onlooker = Onlooker(["Rob", "Bot"], io.StringIO())
    onlooker.visited(visit(asked, may_wait=True), 0.0)
    onlooker.visited(visit([]), 0.1)
    onlooker.visited(visit([], is_stop=True), 0.2)
    onlooker.visited(visit(asked, may_wait=True), 0.3)
    onlooker.tell({"event": "said", "text": "Stop", "at_s": 2.0}, "Rob")
    assert len(asked) == 1, "what was typed after it is said"
