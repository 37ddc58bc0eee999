"""Names letter by letter."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.language.spelling import WORD_OF, letter_words, letters_of, written_name

BOOK = Phrasebook(Vocabulary(("Rob", "R2D2"), ("plant",), ("water the red rose",), (1,)))
NAMES = st.from_regex(r"[a-z][a-z0-9]{0,15}", fullmatch=True)


def test_a_name_is_spelled_in_the_radio_alphabet() -> None:
    zorg = m.Utterance("Zorg", m.ToAll(), None, m.Spelled("zorg"))
    assert BOOK.write(zorg) == "Hi all, i spell, zulu oscar romeo golf".replace(" i ", " I ")
    assert BOOK.phrases(zorg) == (("hi", "all"), ("i", "spell"), ("zulu", "oscar", "romeo", "golf"))
    assert BOOK.parse_text("Hi all, I spell: zulu, oscar, romeo, golf") == zorg


@given(NAMES, st.booleans())
def test_any_robots_name_can_be_spelled_and_read_by_who_does_not_know_it(letters: str, to_team: bool) -> None:
    to = m.ToTeam("plant") if to_team else m.ToAll()
    spelled = m.Utterance(BOOK.known_name(letters) or written_name(letters), to, None, m.Spelled(letters))
    assert BOOK.parse(BOOK.render(spelled)) == spelled


@given(NAMES)
def test_letters_and_words_lead_to_one_another(letters: str) -> None:
    assert letters_of(letter_words(letters)) == letters


@pytest.mark.parametrize("words", [(), ("two", "alpha"), ("alpha", "rose")])
def test_what_spells_no_name_is_none(words: tuple[str, ...]) -> None:
    assert letters_of(words) is None


def test_a_known_name_is_written_as_it_is_known() -> None:
    assert BOOK.parse_text("hi all i spell romeo two delta two").speaker == "R2D2"


def test_a_name_that_is_not_the_speakers_is_not_said() -> None:
    with pytest.raises(Exception, match="no words"):
        BOOK.render(m.Utterance("Rob", m.ToAll(), None, m.Spelled("bob")))


@given(st.integers(0, 2**32), NAMES)
def test_the_network_of_spelled_names_has_all_of_them_and_nothing_else(seed: int, letters: str) -> None:
    graph = BOOK.spelling_graph
    step = {(arc.source, arc.word): arc.target for arc in graph.arcs}
    assert len(step) == len(graph.arcs), "no node has two arcs of one word"
    node: int | None = graph.start
    for word in ("hello", "team", "plant", "i", "spell", *letter_words(letters)):
        node = step.get((node, word)) if node is not None else None
    assert node in graph.finals
    rng, node, words = random.Random(seed), graph.start, []
    while node not in graph.finals:
        arc = rng.choice([arc for arc in graph.arcs if arc.source == node])
        node, words = arc.target, [*words, arc.word]
    first_digit = words[-1] in {WORD_OF[digit] for digit in "0123456789"}
    assert first_digit or isinstance(BOOK.parse(words).statement, m.Spelled)
    assert not {"rob", "r2d2"} & set(graph.words), "it is the same for all"


def test_the_ordinary_network_has_no_letters() -> None:
    assert "zulu" not in BOOK.graph.words
