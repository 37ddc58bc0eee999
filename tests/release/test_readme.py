"""What the README shows of runs is what the commands print now."""

from __future__ import annotations

from pathlib import Path

import pytest

from hvcpd.reporting.events import Summary
from release.readme import LEFT_OUT, README, Command, Stage, abridged, blocks, differences, renewed


def test_a_block_is_its_commands_with_what_they_print() -> None:
    text = "Before\n```\n$ one\na\n\nb\n$ two\n```\nbetween\n```\nmake demo\n```\n```\n$ three\n```\n"
    assert blocks(text) == [[Command("one", ("a", "", "b")), Command("two", ())], [Command("three", ())]]


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        ((), ("1", "2", "3", "4")),
        (("x", "y"), ("1", "2", "3", "4")),
        ((LEFT_OUT, "x"), (LEFT_OUT, "4")),
        (("x", LEFT_OUT, "y", "z"), ("1", LEFT_OUT, "3", "4")),
        (("x", LEFT_OUT), ("1", LEFT_OUT)),
    ],
)
def test_as_much_is_shown_as_was_shown(shown: tuple[str, ...], expected: tuple[str, ...]) -> None:
    assert abridged("1\n2\n3\n4\n", shown) == expected


def test_the_clock_on_the_wall_is_not_shown() -> None:
    told = "  3:12 min in 10.0 s: 19 times faster than real time (seed 1)\n"
    slow = "  3:12 min in 400.0 s: slower than real time (seed 1)\n"
    expected = ("  3:12 min in … s: … times faster than real time (seed 1)",)
    assert abridged(told, ()) == abridged(slow, ()) == expected


def test_what_a_command_prints_takes_the_place_of_what_was_shown(tmp_path: Path) -> None:
    text = "# A\n\n```\n$ echo new\nold\n$ false\n$ echo $?\n0\n```\n\nB\n"
    now = renewed(text, Stage(tmp_path))
    assert now == "# A\n\n```\n$ echo new\nnew\n$ false\n$ echo $?\n1\n```\n\nB\n"
    assert [line for line in differences(text, now) if line[:1] in "+-" and line[1:2] not in "+-"] == [
        "-old",
        "+new",
        "-0",
        "+1",
    ]
    assert renewed(now, Stage(tmp_path)) == now


@pytest.mark.slow
def test_the_readme_shows_what_the_commands_print_now(tmp_path: Path) -> None:
    """The one whole mission of the paper's five plants through the command; each plant is watered exactly once."""
    text = README.read_text(encoding="utf-8")
    assert len(blocks(text)) >= 7, "the README's blocks are no longer found"
    stage = Stage(tmp_path)
    changed = differences(text, renewed(text, stage))
    assert not changed, "\n".join(["run `python -m release.readme`:", *changed])
    [score] = [event for event in stage.mission.events if isinstance(event, Summary)]
    assert (len(score.done), score.duplicates, score.lost) == (5, 0, 0)
