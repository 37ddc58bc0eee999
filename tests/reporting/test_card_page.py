"""The phrase card for the wall and the pocket."""

from __future__ import annotations

from hvcpd.language.card import Topic, make_card
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.reporting.card_page import MAX_TASKS, POCKET_CARDS, card_page


def page(*names: str, tasks: tuple[str, ...] = ("water the red rose",)) -> str:
    numbers = tuple(range(1, len(tasks) + 1))
    card = make_card(Phrasebook(Vocabulary(names, ("plant",), tasks, numbers)))
    return card_page(card, list(zip(numbers, tasks, strict=True)))


def test_the_page_has_a_card_for_the_wall_and_eight_for_the_pocket() -> None:
    written = page("Rob", "Bot")
    assert written.count('class="pocket"') == POCKET_CARDS
    assert written.count('class="sheet') == 2
    assert written.count('<svg class="dot"') == 1, "the task's colour"
    for words in ("“Stop”", "come back", "please", "half a metre", "report"):
        assert words in written


def test_a_screen_reader_reads_one_of_the_pocket_cards() -> None:
    assert page("Rob", "Bot").count('class="pocket" aria-hidden="true"') == POCKET_CARDS - 1


def test_what_the_team_named_is_never_markup() -> None:
    written = page("A", "B", tasks=("go <script> now",))
    assert "<script" not in written
    assert "go &lt;script&gt; now" in written


def test_more_tasks_than_the_wall_has_room_for_are_counted() -> None:
    colours = [f"{a} {b}" for a in ("red", "blue", "white", "green") for b in ("rose", "tulip", "lily", "daisy")]
    written = page("A", "B", tasks=tuple(f"water the {each}" for each in colours))
    assert f"and {len(colours) - MAX_TASKS} more" in written


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
