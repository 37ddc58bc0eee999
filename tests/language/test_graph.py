"""The word network: which sentences it holds."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.assembly.sound import make_phrasebook
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.language.graph import WordGraph, beginning_with, ends_of, graph_of

BOOK = make_phrasebook(("Rob", "Bot"), DEFAULT_TEAMS, load_tasks(default_tasks_path()))
TO_ROB = (("rob",), ("hi", "rob"), ("hello", "rob"))


def holds(graph: WordGraph, words: tuple[str, ...]) -> bool:
    return bool(ends_of(graph, graph.start, words) & graph.finals)


@given(st.integers(0, 1 << 32))
def test_the_sentences_that_begin_with_a_phrase_are_kept_and_no_others(seed: int) -> None:
    words = BOOK.render(BOOK.sample(random.Random(seed)))
    mine = beginning_with(BOOK.people_graph, TO_ROB)
    assert holds(mine, words) == any(words[: len(phrase)] == phrase for phrase in TO_ROB)


@pytest.mark.parametrize("phrases", [[], [("zoe",)], [("hi", "zoe")]])
def test_a_phrase_that_begins_no_sentence_leaves_none(phrases: list[tuple[str, ...]]) -> None:
    assert not holds(beginning_with(graph_of(("hi", "rob")), phrases), ("hi", "rob"))
