"""Statements by number: each has one, nobody else's, and only those with the same tasks count alike."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.language import messages as m
from hvcpd.language.codebook import Codebook
from hvcpd.language.forms import Kind
from hvcpd.language.marks import NEVER_HIDDEN
from hvcpd.language.phrasebook import Phrasebook, Vocabulary

TASKS = ("water the green rose", "water the violet rose")


def book(names: tuple[str, ...] = ("Rob", "Bot"), tasks: tuple[str, ...] = TASKS, highest: int = 2) -> Phrasebook:
    numbers = tuple(range(1, highest + 1))
    return Phrasebook(Vocabulary(names, ("plant",), tasks, numbers, ("hello there",), kinds=frozenset(Kind)))


BOOK = book()


def test_every_number_is_of_one_statement_that_can_be_said() -> None:
    codebook = BOOK.codebook
    statements = [codebook.statement_of(number) for number in range(codebook.size)]
    known = {number: s for number, s in enumerate(statements) if s is not None}
    assert len(set(known.values())) == len(known) > 2000
    for number, statement in known.items():
        assert codebook.number_of(statement) == number
        assert BOOK.write(m.Utterance("Rob", m.ToAll(), None, statement))
    assert codebook.statement_of(codebook.size) is None
    assert codebook.statement_of(-1) is None


@given(st.integers(0, 2**32))
def test_all_that_can_be_said_has_a_number_but_what_is_never_hidden(seed: int) -> None:
    statement = m.own_words(BOOK.sample(random.Random(seed)).statement)
    of_two_tasks = isinstance(statement, m.Claim | m.Completed | m.Confirmed) and statement.also is not None
    of_two_tasks |= isinstance(statement, m.Completed) and statement.then is not None
    tells_way = isinstance(statement, m.Claim) and statement.distance_m is not None
    hidden = statement is not None and not isinstance(statement, NEVER_HIDDEN) and not (of_two_tasks or tells_way)
    number = BOOK.codebook.number_of(statement)
    assert (number is not None) == hidden
    assert number is None or BOOK.codebook.statement_of(number) == statement


def test_a_task_may_be_about_a_sealed_message() -> None:
    postal = book(tasks=("deliver the sealed message",))
    order = m.Order(m.TaskByName("deliver the sealed message"))
    found = postal.parse(postal.render(m.Utterance("Rob", m.ToRobot("Bot"), None, order, m.Seal(7))))
    assert (found.statement, found.mark) == (order, m.Seal(7))


@pytest.mark.parametrize("statement", [m.Order(m.TaskByNumber(77)), m.Order(m.TaskByName("dance")), m.MoveBy(0.7)])
def test_what_the_phrasebook_lacks_has_no_number(statement: m.Statement) -> None:
    assert BOOK.codebook.number_of(statement) is None


def test_robots_that_know_other_names_count_alike_and_those_with_other_tasks_do_not() -> None:
    assert book(("Bot", "Zoe", "Max")).codebook.digest == BOOK.codebook.digest
    other = [
        book(tasks=TASKS[:1]),
        book(tasks=TASKS[::-1]),
        book(tasks=("water the red rose", TASKS[1])),
        book(highest=11),
    ]
    assert len({codebook.codebook.digest for codebook in (BOOK, *other)}) == 5


@pytest.mark.parametrize(("tasks", "n_bytes", "n_words"), [(5, 2, 8), (30, 2, 8), (99, 3, 10)])
def test_messages_of_a_team_are_equally_long(tasks: int, n_bytes: int, n_words: int) -> None:
    large = book(tasks=(), highest=tasks)
    assert isinstance(large.codebook, Codebook)
    assert large.codebook.size <= 256**n_bytes
    assert (large.codebook.n_bytes, large.cipher_words) == (n_bytes, n_words)
