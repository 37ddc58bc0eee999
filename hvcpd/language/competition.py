"""Which words and phrases compete: paths of the word graph that part at one node and meet again at another.

The context before and after is the same for both, so their sounds alone decide which of the two is heard.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from hvcpd.language.graph import WordGraph

Phrase = tuple[str, ...]
Pair = tuple[Phrase, Phrase]

MAX_WORDS = 3
"""Of a competing phrase: as a long word has syllables ("in the go" against "indigo"). Pairs grow with its cube."""
_END = -1
"""Where all sentences meet: the end."""

_Path = tuple[Phrase, tuple[int, ...]]
"""The words, and the nodes after each."""


def competing_phrases(graph: WordGraph) -> tuple[Pair, ...]:
    """Every pair of phrases of up to MAX_WORDS words that can stand in each other's place, each once, sorted.

    A pair has no common node between its ends, and it begins and ends with different words.
    """
    pairs: set[Pair] = set()
    for arcs in graph.following:
        by_word = [tuple(_paths(graph, ((word,), (target,)))) for word, target in arcs]
        for some, others in combinations(by_word, 2):
            pairs.update(_meeting(some, others))
    return tuple(sorted(pairs))


def _paths(graph: WordGraph, path: _Path) -> Iterator[_Path]:
    words, nodes = path
    yield path
    if nodes[-1] in graph.finals:
        yield words, (*nodes, _END)
    if len(words) < MAX_WORDS:
        for word, target in graph.following[nodes[-1]]:
            yield from _paths(graph, ((*words, word), (*nodes, target)))


def _meeting(some: tuple[_Path, ...], others: tuple[_Path, ...]) -> Iterator[Pair]:
    ending: dict[int, list[_Path]] = {}
    for path in others:
        ending.setdefault(path[1][-1], []).append(path)
    for words, nodes in some:
        for other, other_nodes in ending.get(nodes[-1], ()):
            if words[-1] != other[-1] and not set(nodes[:-1]) & set(other_nodes[:-1]):
                yield (words, other) if words < other else (other, words)
