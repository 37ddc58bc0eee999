"""Typed sentences in ordinary variants, and letters that are not plain."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.config.names import plain_letters
from hvcpd.config.written import unsayable
from hvcpd.errors import PhraseError
from hvcpd.language.messages import Utterance
from hvcpd.language.phrasebook import Phrasebook, Vocabulary

BOOK = Phrasebook(
    Vocabulary(
        ("Rob", "Bot", "Zoe"), ("plant",), ("water the grey rose", "fetch the colour card", "open the centre door")
    )
)


@pytest.mark.parametrize(
    ("typed", "plain"),
    [
        ("Hi Rob, I'm Zoe, move forward 2 meters", "Hi Rob, I am Zoe, move forward two metres"),
        ("Rob, move back 1 meter", "Rob, move back one metre"),
        ("Rob, move back 0.5 m", "Rob, move back half a metre"),
        ("Rob, move back 1.0 m", "Rob, move back one metre"),
        ("Hi all, I am Rob, report, I am free, battery 11.0 V", None),
        ("Rob, move back 3m", "Rob, move back three metres"),
        ("Rob, move back one m", "Rob, move back one metre"),
        ("Rob, move back 3metres", "Rob, move back three metres"),
        ("Hi all, I\N{RIGHT SINGLE QUOTATION MARK}m Rob, report, I've stopped, battery 11.5V", None),
        ("Hi all, I am Rob, report, I have stopped, battery eleven and a half volts", None),
        ("Who's here?", "Who is here"),
        ("whos here", "Who is here"),
        ("Who´s here", "Who is here"),
        ("\N{ZERO WIDTH NO-BREAK SPACE}Rob, stop", "Rob stop"),
        ("whats left", "What is left"),
        ("Hi Rob, im Zoe, stop", "Hi Rob, I am Zoe, stop"),
        ("What're you doing", None),
        ("Hi Rob, I'm Zoe, I can't complete task 2", "Hi Rob, I am Zoe, I cannot complete task two"),
        ("Hi Rob, I'm Zoe, I don't know task 3", "Hi Rob, I am Zoe, I do not know task three"),
        ("Hi Rob, I'm Zoe, water the gray rose", "Hi Rob, I am Zoe, water the grey rose"),
        ("Hi Rob, I'm Zoe, fetch the color card", "Hi Rob, I am Zoe, fetch the colour card"),
        ("Hi Rob, I'm Zoe, I'll open the center door", "Hi Rob, I am Zoe, I will open the centre door"),
        ("Hi Zoë, I am Bot, stop", "Hi Zoe, I am Bot, stop"),
        ("Hey Rob, turn left", "Rob, turn left"),
        ("Halt!", "Stop"),
        ("Robots, stop", "All stop"),
        ("Rob, fetch the color card", "Hi Rob, I am friend, fetch the colour card"),
    ],
)
def test_a_variant_is_understood(typed: str, plain: str | None) -> None:
    understood = BOOK.parse_text(typed)
    assert plain is None or BOOK.write(understood) == plain


def test_a_team_may_spell_its_tasks_as_americans_do() -> None:
    book = Phrasebook(Vocabulary(("Rob",), (), ("fetch the color card", "open the center door")))
    assert book.write(book.parse_text("Hi, I'm Rob, fetch the colour card")) == "Hi, I am Rob, fetch the color card"
    assert book.write(book.parse_text("Hi, I'm Rob, open the centre door")) == "Hi, I am Rob, open the center door"


@pytest.mark.parametrize(
    "typed",
    ["Rob, move back 1.5 metres", "Rob, move back -1 m", "Rob, move back \N{EN DASH}1 m", "Rob, move forward 2 feet"],
)
def test_what_means_something_else_is_refused(typed: str) -> None:
    with pytest.raises(PhraseError):
        BOOK.parse_text(typed)


@given(st.randoms(use_true_random=False))
def test_every_sentence_is_read_as_it_is_written_with_and_without_contractions(rng: random.Random) -> None:
    utterance: Utterance = BOOK.sample(rng)
    written = BOOK.write(utterance)
    assert BOOK.parse_text(written) == utterance
    variant = written
    for plain, other in (
        ("I am", "I'm"),
        ("I will", "I'll"),
        ("I have", "I've"),
        ("do not", "don't"),
        ("metre", "meter"),
    ):
        variant = variant.replace(plain, other)
    assert BOOK.parse_text(variant) == utterance


@pytest.mark.parametrize("text", ["Hi Rob, I am Anna, what are you doing", "Hi Anna", "Anna, stop"])
def test_an_unknown_name_is_told_with_the_option_that_makes_it_known(text: str) -> None:
    with pytest.raises(PhraseError, match=r"known names are Rob, Bot, Zoe; .* --names Rob,Bot,Zoe,Anna"):
        BOOK.parse_text(text)


@pytest.mark.parametrize("text", ["I am Rob, task one complete", "I am Rob"])
def test_who_forgets_the_greeting_is_told_of_it_and_not_of_the_speaker(text: str) -> None:
    with pytest.raises(PhraseError, match=r"'i' is not .* whom it is for comes first: 'hi all i am …'"):
        BOOK.parse_text(text)


@pytest.mark.parametrize("text", ["Rob, I am Zoe, turn left", "Rob, I'm Zoe, turn left", "Rob, I'm Anna, turn left"])
def test_who_names_whom_it_is_for_without_a_greeting_is_told_of_the_greeting(text: str) -> None:
    with pytest.raises(PhraseError, match=r"after 'rob'; the greeting comes first: 'hi rob i am …'"):
        BOOK.parse_text(text)


@pytest.mark.parametrize("text", ["Hi Rob, I am Bot, sweep the kitchen", "bonjour"])
def test_a_word_where_a_name_would_lead_nowhere_is_not_taken_for_one(text: str) -> None:
    """Whoever had forgotten --tasks was advised to give "sweep" as a robot's name."""
    with pytest.raises(PhraseError, match="possible there:"):
        BOOK.parse_text(text)


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("café", "cafe"),
        ("Müller", "Muller"),
        ("Łódź", "Lodz"),
        ("Straße", "Strasse"),
        ("Ærø", "Aero"),
        ("Đorđe", "Dorde"),
    ],
)
def test_latin_letters_become_plain(text: str, plain: str) -> None:
    assert plain_letters(text) == plain


def test_signs_without_sound_are_found() -> None:
    assert unsayable("Hi all, it's Zoë: \N{EM DASH} done!") is None
    assert unsayable("2 + 3") == "+"
    assert unsayable("at 12:30") is None
    assert unsayable("at 8:30:05") == "30:05"
    assert unsayable("20 m²") == "²"
    assert unsayable("½ a litre") == "½"
    for number in ("-5", "\N{EN DASH}5", "-.5", ".5", ",5", "3.500", "1,000"):
        assert unsayable(f"it is (now) {number} degrees") == unsayable(f"it is ({number}) degrees") == number
    assert unsayable("version 1.2.3") == "1.2"
    for said in ("3-5 roses", "3\N{EN DASH}5 roses", "Rob - 5 roses", "Rob--5 roses", "well ...5 roses", "5.", "Rob,5"):
        assert unsayable(said) is None
    assert unsayable("Hi 日本") == "日"


def test_an_american_spelling_may_also_lack_the_plural() -> None:
    book = Phrasebook(Vocabulary(("Rob",), tasks=("fetch the colours",), numbers=(1,)))
    assert book.parse_text("Rob, fetch the color") == book.parse_text("Rob, fetch the colours")
