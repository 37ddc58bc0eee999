"""Advice for two phrases that sound alike: sentences that contain them, and other words for one of them.

The other words are near in meaning, or the same word with one more before it.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

from hvcpd.language.graph import WordGraph
from hvcpd.language.pattern import Words
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.language.spelling import WORD_OF

_Path = tuple[tuple[int, str], ...]
"""Words with the node before each."""


def example_sentences(book: Phrasebook, first: Words, second: Words) -> tuple[str, str]:
    """The shortest two written sentences that are the same but for the two phrases; these alone if there are none."""
    graph = book.heard_graph
    following: dict[int, list[tuple[str, int]]] = {}
    for arc in sorted(graph.arcs, key=lambda arc: (len(arc.word), arc.word)):  # "hi" before "hello"
        following.setdefault(arc.source, []).append((arc.word, arc.target))
    for before, node in _shortest(following, graph.start):
        ends = [dict(_along(following, node, phrase)) for phrase in (first, second)]
        common = [end for end in ends[0] if end in ends[1]]
        tails = [(tail, end) for end in common if (tail := _to_end(following, graph, end)) is not None]
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


def _shortest(following: dict[int, list[tuple[str, int]]], start: int) -> Iterator[tuple[_Path, int]]:
    """Every node with the shortest way to it, nearest first."""
    ways: list[tuple[_Path, int]] = [((), start)]
    seen = {start}
    for way, node in ways:
        yield way, node
        for word, target in following.get(node, ()):
            if target not in seen:
                seen.add(target)
                ways.append(((*way, (node, word)), target))


def _along(following: dict[int, list[tuple[str, int]]], node: int, words: Words) -> Iterator[tuple[int, _Path]]:
    """Where the words lead to from a node, and the way."""
    if not words:
        yield node, ()
        return
    for word, target in following.get(node, ()):
        if word == words[0]:
            yield from ((end, ((node, word), *rest)) for end, rest in _along(following, target, words[1:]))


def _to_end(following: dict[int, list[tuple[str, int]]], graph: WordGraph, node: int) -> _Path | None:
    return next((way for way, end in _shortest(following, node) if end in graph.finals), None)


def _written(book: Phrasebook, graph: WordGraph, way: _Path) -> str:
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
