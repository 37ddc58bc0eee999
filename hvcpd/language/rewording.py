"""Advice for two phrases that sound alike: sentences that contain them, and other words for one of them.

The other words are near in meaning, or the same word with one more before it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

from hvcpd.language.graph import Way, WordGraph, way_to_end, ways_from
from hvcpd.language.pattern import Words
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.language.spelling import WORD_OF


def example_sentences(book: Phrasebook, first: Words, second: Words) -> tuple[str, str]:
    """The shortest two written sentences that are the same but for the two phrases; these alone if there are none."""
    arcs = sorted(book.heard_graph.arcs, key=lambda arc: (len(arc.word), arc.word))  # "hi" before "hello"
    graph = replace(book.heard_graph, arcs=tuple(arcs))
    for before, node in ways_from(graph, graph.start):
        ends = [_along(graph, node, phrase) for phrase in (first, second)]
        common = [end for end in ends[0] if end in ends[1]]
        tails = [(tail, end) for end in common if (tail := way_to_end(graph, end)) is not None]
        if tails:
            tail, end = min(tails, key=lambda each: len(each[0]))
            sides = [each[end] for each in ends]
        else:  # they meet at the end of the sentence alone
            last = [next((each[end] for end in each if end in graph.finals), None) for each in ends]
            sides, tail = [each for each in last if each is not None], ()
        if len(sides) < 2:
            continue
        one, other = (_written(book, graph, (*before, *side, *tail)) for side in sides)
        return one, other
    return " ".join(first), " ".join(second)


def _along(graph: WordGraph, start: int, words: Words) -> dict[int, Way]:
    """The nodes that the words lead to from the node `start`, each with the way to it."""
    ways: dict[int, Way] = {start: ()}
    for word in words:
        ways = {
            target: (*way, (node, word))
            for node, way in ways.items()
            for said, target in graph.following[node]
            if said == word
        }
    return ways


def _written(book: Phrasebook, graph: WordGraph, way: Way) -> str:
    """As a person writes it, with commas where a speaker pauses."""
    names = {name.lower(): name for name in book.vocabulary.names} | {"i": "I"}
    text = "".join((", " if node in graph.pauses else " ") + names.get(word, word) for node, word in way)
    text = text.lstrip(", ")
    return text[:1].upper() + text[1:]


SYNONYMS_PATH = Path(__file__).with_name("synonyms.txt")

BEFORE_DEEDS = (("go", "and"), ("now",), ("always",))
"""Before the first word of a task, which is its verb. They do not change its meaning."""
BEFORE_THINGS = ("big", "little", "old", "new", "good", "usual")
"""Before any other word of a task. The thing's owner knows which of them is true."""
BEFORE_TEAMS = ("big", "super", "new")
AFTER_NAMES = ("2", "7", "9")


@cache
def _lists() -> tuple[dict[str, tuple[str, ...]], tuple[str, ...]]:
    """For each word, words near in meaning, in the file's order; and the names."""
    near: dict[str, list[str]] = {}
    names: tuple[str, ...] = ()
    for line in SYNONYMS_PATH.read_text(encoding="utf-8").splitlines():
        if line.startswith("names:"):
            names = tuple(line.removeprefix("names:").split())
        elif not line.startswith("#"):
            head, *others = line.split()
            near.setdefault(head, []).extend(others)
            for other in others:
                near.setdefault(other, []).append(head)
    return {word: tuple(dict.fromkeys(others)) for word, others in near.items()}, names


def known_names() -> tuple[str, ...]:
    """Names of people, for robots."""
    return _lists()[1]


def instead_of_verb(word: str) -> Iterator[Words]:
    """For the first word of a task's name."""
    yield from ((other,) for other in _lists()[0].get(word, ()))
    yield from ((*before, word) for before in BEFORE_DEEDS)


def instead_of_noun(word: str) -> Iterator[Words]:
    """For any other word of a task's name."""
    yield from ((other,) for other in _lists()[0].get(word, ()))
    yield from ((before, word) for before in BEFORE_THINGS)


def instead_of_team(word: str) -> Iterator[Words]:
    """For a team's name, which is one word: a letter's word in the radio alphabet, or two words in one."""
    if word in WORD_OF:
        yield (WORD_OF[word],)
    yield from ((other,) for other in _lists()[0].get(word, ()))
    yield from ((before + word,) for before in BEFORE_TEAMS)


def instead_of_name(name: str) -> Iterator[Words]:
    """For a robot's name: the same with a number after it."""
    yield from ((name + digit,) for digit in AFTER_NAMES)
