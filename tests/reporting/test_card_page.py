"""The phrase card for the wall and the pocket."""

from __future__ import annotations

import math

import pytest

from hvcpd.config.tasks import TaskDefinition, Wait
from hvcpd.language.card import Topic, make_card
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.reporting.card_page import POCKET_CARDS, card_page
from tests.reporting.shift_example import flower_tasks
from tests.reporting.shown import Page


def page(
    *names: str, tasks: tuple[str, ...] = ("water the red rose",), icon: str = "", teams: tuple[str, ...] = ("plant",)
) -> str:
    numbers = tuple(range(1, len(tasks) + 1))
    card = make_card(Phrasebook(Vocabulary(names, teams, tasks, numbers)))
    defined = [TaskDefinition(n, name, None, (Wait(1.0),), icon) for n, name in zip(numbers, tasks, strict=True)]
    return card_page(card, defined)


def test_the_page_has_a_card_for_the_wall_and_eight_for_the_pocket() -> None:
    written = page("Rob", "Bot")
    assert written.count('class="pocket"') == POCKET_CARDS
    assert written.count('class="sheet') == 2
    assert written.count('<svg class="icon"') == 1, "the task's mark"
    for words in ("“Stop”", "come back", "please", "half a metre", "report"):
        assert words in written


@pytest.mark.parametrize(
    ("teams", "words"), [(("plant",), " · team plant<"), (("plant", "a", "b"), " · teams plant, a and b<")]
)
def test_the_wall_names_the_team_or_the_teams(teams: tuple[str, ...], words: str) -> None:
    assert words in page("Rob", "Bot", teams=teams)


def test_a_screen_reader_reads_one_of_the_pocket_cards() -> None:
    assert page("Rob", "Bot").count('class="pocket" aria-hidden="true"') == POCKET_CARDS - 1


def test_what_the_team_named_is_never_markup() -> None:
    written = page("A", "B", tasks=("go <script> now",))
    assert "<script" not in written
    assert "go &lt;script&gt; now" in written


LONG = "carry the enormously heavy wooden storage container"


@pytest.mark.parametrize("count", [5, 12, 30, 40])
@pytest.mark.parametrize("start", ["water the", LONG])
def test_the_wall_and_the_pocket_have_every_task(count: int, start: str) -> None:
    tasks = flower_tasks(count, start)
    written = page("Rob", "Bot", tasks=tuple(task.name for task in tasks))
    shown = Page(written)
    sheets = [each for each in shown.elements if each.is_of("sheet") and not each.is_of("pockets")]
    wall = " ".join(part for sheet in sheets for part in sheet.parts)
    pockets = shown.shown("pocket")
    assert len(pockets) % POCKET_CARDS == 0 or len(pockets) < 2 * POCKET_CARDS
    for task in tasks:
        assert task.name in wall
    kinds = list(dict.fromkeys(pockets))
    sets = len(pockets) // len(kinds)
    assert sets == max(POCKET_CARDS // len(kinds), 1)
    assert len(pockets) == sets * len(kinds)
    person = " ".join(kinds)
    for task in tasks:
        assert f"{task.number} {task.name}" in person
    assert written.count('class="sheet pockets"') == math.ceil(len(pockets) / POCKET_CARDS)


def test_every_line_is_for_something() -> None:
    card = make_card(Phrasebook(Vocabulary(("Rob", "Bot"), ("plant",), ("water the red rose",), (1,))))
    assert {line.topic for line in (*card.calls, *card.statements)} == set(Topic)
    stops = {line.say for line in card.calls if line.topic is Topic.STOP}
    assert stops == {"[WHO] stop", "[WHO] resume"}


def test_a_pattern_is_never_shown_as_the_forms_write_it() -> None:
    card = make_card(Phrasebook(Vocabulary(("Rob", "Bot"), ("plant",), ("water the red rose",), (1,))))
    shown = [card.opening, *(line.say for line in (*card.calls, *card.statements))]
    assert not [text for text in shown if "|" in text or "<" in text or "please" in text]


def test_the_example_is_a_task_of_the_team() -> None:
    tasks = ("water the red rose", "water the white rose", "water the blue rose")
    card = make_card(Phrasebook(Vocabulary(("Rob", "Bot"), ("plant",), tasks, (1, 2))))
    assert card.example == "Hi Rob, I am Bot, water the white rose"
