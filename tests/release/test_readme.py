"""README.md and docs/commands.md show what the commands print now."""

from __future__ import annotations

from pathlib import Path

import pytest

from hvcpd.reporting.events import Summary
from release.animation import WIDTH, draw, make_film
from release.figures import FIGURES, read_results, with_table
from release.readme import ANIMATION, LEFT_OUT, PAGES, Command, Stage, abridged, blocks, differences, renewed
from tests.console.browser import MISSING, WHY, chromium


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
    told = "  3:12 of mission time in 10.0 s: 19 times faster than real time (seed 1)\n"
    slow = "  3:12 of mission time in 400.0 s: slower than real time (seed 1)\n"
    expected = ("  3:12 of mission time in … s: … times faster than real time (seed 1)",)
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


README = PAGES[0]


def test_the_readme_is_short() -> None:
    assert len(README.read_text(encoding="utf-8").split()) <= 500


def test_the_readme_has_the_figures_that_were_measured() -> None:
    text = README.read_text(encoding="utf-8")
    assert with_table(text, read_results()) == text, "run `python -m release.figures --table`"
    assert len(FIGURES) == 5


def test_each_figure_reads_what_its_benchmark_printed() -> None:
    results = read_results()
    for figure in FIGURES:
        assert results[figure.name]["command"] == figure.command, "measure it again: python -m release.figures"
        assert figure.read(results[figure.name]["printed"]), figure.name


def test_a_film_shows_talk_slower_than_silence_and_ends_with_the_mission() -> None:
    film = make_film([(10.0, 14.0)], 100.0)
    talk = film.at(14.0) - film.at(10.0)
    silence = film.at(54.0) - film.at(50.0)
    assert talk > 5 * silence
    assert film.at(0.0) == 0.0
    assert film.at(100.0) < 1.0


@pytest.mark.slow
@pytest.mark.skipif(MISSING, reason=WHY)
def test_each_line_of_the_animation_fits_into_the_picture() -> None:
    right = "return [...document.querySelectorAll('.caption')].map((line) => line.getBBox().x + line.getBBox().width)"
    with chromium() as browser:
        browser.get(ANIMATION.as_uri())
        assert max(browser.execute_script(right)) <= WIDTH


@pytest.mark.slow
def test_the_pages_show_what_the_commands_print_now(tmp_path: Path) -> None:
    """The one whole mission of the paper's five plants through the command; each plant is watered exactly once."""
    stage = Stage(tmp_path)
    texts = {page: page.read_text(encoding="utf-8") for page in PAGES}
    assert sum(len(blocks(text)) for text in texts.values()) >= 7, "the blocks are no longer found"
    changed = [line for page, text in texts.items() for line in differences(text, renewed(text, stage), page.name)]
    assert not changed, "\n".join(["run `python -m release.readme`:", *changed])
    assert ANIMATION.read_text(encoding="utf-8") == draw(stage.mission) + "\n", "run `python -m release.readme`"
    [score] = [event for event in stage.mission.events if isinstance(event, Summary)]
    assert (len(score.done), score.duplicates, score.lost) == (5, 0, 0)
