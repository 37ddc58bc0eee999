"""Sentences that say the same in other words."""

from __future__ import annotations

import random

from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.assembly.sound import make_phrasebook
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.language.graph import ends_of
from hvcpd.language.wordings import same_meaning, wordings

LEFT = ("turn", "left")


def test_greetings_to_all_and_to_nobody_mean_the_same() -> None:
    rest = ("i", "am", "anna", "i", "am", "busy")
    same = [("hi", *rest), ("hi", "all", *rest), ("hello", *rest), ("hello", "all", *rest)]
    assert all(sorted(wordings(words)) == sorted(same) for words in same)
    assert same_meaning(same[0], same[3])
    assert not same_meaning(same[0], ("hi", "rob", *rest))
    assert list(wordings(("hi", "all"))) == [("hi", "all"), ("hello", "all")], "a question: who is here?"
    assert list(wordings(LEFT)) == [LEFT]
    assert not same_meaning((), ("stop",))


BOOK = make_phrasebook(("Rob", "Bot"), DEFAULT_TEAMS, load_tasks(default_tasks_path()))


@settings(max_examples=200)
@given(st.integers(0, 1_000_000))
def test_the_phrasebook_has_all_wordings_of_a_sentence(seed: int) -> None:
    sentence = BOOK.render(BOOK.sample(random.Random(seed)))
    graph = BOOK.people_graph
    assert all(ends_of(graph, graph.start, words) & graph.finals for words in wordings(sentence))
