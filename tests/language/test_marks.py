"""Seals and codes after sentences: said, heard, and understood by the same forms as everything else."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.errors import PhraseError
from hvcpd.language import messages as m
from hvcpd.language.forms import SEALED_KINDS, Kind
from hvcpd.language.graph import ends_of
from hvcpd.language.marks import SEAL_WORDS, hidden, is_sealed, mark_words
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.language.spelling import CODE_WORDS, number_of, words_of

TASKS = ("water the green rose", "water the violet rose")
WORDS = Vocabulary(("Rob", "Bot", "Oscar"), ("plant",), TASKS, (1, 2))
KEYED = Phrasebook(Vocabulary(WORDS.names, WORDS.teams, WORDS.tasks, WORDS.numbers, kinds=SEALED_KINDS))
SECRET = Phrasebook(Vocabulary(WORDS.names, WORDS.teams, WORDS.tasks, WORDS.numbers, kinds=frozenset(Kind)))
OPEN = Phrasebook(WORDS)
marks = st.builds(m.Seal, st.integers(0, 2**24 - 1)) | st.builds(m.Code, st.text("0123456789", min_size=6, max_size=6))


def test_there_are_64_code_words_and_none_twice() -> None:
    assert len(set(CODE_WORDS)) == len(CODE_WORDS) == 64


@given(st.integers(0, 2**24 - 1))
def test_numbers_are_read_from_their_words(value: int) -> None:
    assert number_of(words_of(value, 4)) == value


@pytest.mark.parametrize("value", [-1, 2**24])
def test_a_number_too_large_has_no_words(value: int) -> None:
    with pytest.raises(ValueError, match="no place"):
        words_of(value, 4)


@given(st.integers(0, 2**32), marks)
def test_a_marked_sentence_is_understood_with_its_mark(seed: int, mark: m.Mark) -> None:
    plain = KEYED.sample(random.Random(seed))
    said = m.Utterance(plain.speaker, plain.addressee, plain.team, plain.statement, mark)
    found = KEYED.parse(KEYED.render(said))
    assert (found, found.mark) == (said, mark)
    assert KEYED.phrases(said)[:-1] == KEYED.phrases(plain)


@given(st.integers(0, 2**32), marks)
def test_the_network_holds_the_marks_of_what_is_sealed_and_no_others(seed: int, mark: m.Mark) -> None:
    plain = KEYED.sample(random.Random(seed))
    allowed = is_sealed(plain.statement) and (plain.speaker is not None or isinstance(mark, m.Code))
    words = KEYED.render(plain)
    for graph in (KEYED.marked_graph, KEYED.robots_graph):
        assert ends_of(graph, graph.start, words) & graph.finals
        assert bool(ends_of(graph, graph.start, (*words, *mark_words(mark))) & graph.finals) == allowed
        assert not ends_of(graph, graph.start, (*words, *mark_words(mark)[:-1])) & graph.finals


@given(st.integers(0, 2**32), st.integers(0, 2**48 - 1))
def test_an_encrypted_sentence_is_heard_as_such_and_tells_nothing_else(seed: int, packet: int) -> None:
    plain = SECRET.sample(random.Random(seed))
    if plain.speaker is None or SECRET.codebook.number_of(m.own_words(plain.statement)) is None:
        return
    said = replace(plain, mark=m.Cipher(packet, SECRET.cipher_words))
    words = SECRET.render(said)
    for graph in (SECRET.marked_graph, SECRET.robots_graph):
        assert ends_of(graph, graph.start, words) & graph.finals
        assert not ends_of(graph, graph.start, words[:-1]) & graph.finals
    found = SECRET.parse(words)
    assert isinstance(m.own_words(found.statement), m.SealedMessage)
    assert (found.mark, found.speaker, found.addressee, found.team) == (
        said.mark,
        plain.speaker,
        plain.addressee,
        plain.team,
    )
    plainly = SECRET.render(replace(hidden(said), mark=None))
    assert words == (*plainly, *mark_words(said.mark))


def test_who_has_no_key_hears_that_a_message_was_sealed() -> None:
    words = "hi bot i am rob sealed message".split()
    for book in (OPEN, KEYED):
        assert ends_of(book.marked_graph, book.marked_graph.start, words) & book.marked_graph.finals
        assert book.parse(words).statement == m.SealedMessage()
    graph = SECRET.marked_graph
    assert not ends_of(graph, graph.start, words) & graph.finals


def test_stop_greetings_and_questions_have_no_mark_in_the_network() -> None:
    for statement in (m.Stop(), m.WhatLeft(), m.WhoHere(), m.WhatDoing(), m.Distrusted(), None):
        assert not is_sealed(statement)
    assert is_sealed(m.Relayed("Rob", m.Order(m.TaskByNumber(1))))
    assert not is_sealed(m.Relayed("Rob", m.Free()))


def test_without_a_key_nothing_is_different() -> None:
    assert OPEN.marked_graph is OPEN.graph
    assert not set(OPEN.graph.words) & {"trust", "code", "tango"}
    with pytest.raises(PhraseError):
        OPEN.parse_text("Hi Rob, I am Bot, confirmed, tango lima kilo papa")


def test_a_name_that_is_a_code_word_is_no_seal() -> None:
    heard = KEYED.parse_text("Hi Oscar, I am Oscar")
    assert (heard.speaker, heard.mark) == ("Oscar", None)


def test_a_code_does_not_show_itself_when_it_is_printed() -> None:
    said = m.Utterance("Rob", statement=m.Resume(), mark=m.Code("123456"))
    assert "123456" not in repr(said)


def test_a_mark_is_no_part_of_the_meaning() -> None:
    assert m.Utterance("Rob", statement=m.Resume(), mark=m.Seal(1)) == m.Utterance("Rob", statement=m.Resume())


def test_the_seal_is_the_last_phrase_of_what_is_said() -> None:
    said = KEYED.parse_text("Hi Rob, I am Bot, confirmed one, tango lima kilo papa")
    assert said.mark == m.Seal(number_of("tango lima kilo papa".split()) or -1)
    assert KEYED.write(said) == "Hi Rob, I am Bot, confirmed one, tango lima kilo papa"
    assert len(KEYED.phrases(said)[-1]) == SEAL_WORDS
