"""Which words and phrases compete: paths of the word graph that part at one node and meet again at another.

The context before and after is the same for both, so their sounds alone decide which of the two is heard.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations_with_replacement, product

from hvcpd.language.graph import WordGraph

Phrase = tuple[str, ...]
Pair = tuple[Phrase, Phrase]

MAX_WORDS = 3
"""Of a competing phrase: as a long word has syllables ("in the go" against "indigo"). Pairs grow with its cube."""
_END = -1
"""Where all sentences meet: the end."""

_Nodes = tuple[int, ...]
"""After each word of a path. Most phrases go through the same nodes as others, so nodes are compared once for all."""
_Path = tuple[Phrase, _Nodes]


def competing_phrases(graph: WordGraph) -> tuple[Pair, ...]:
    """Every pair of phrases of up to MAX_WORDS words that can stand in each other's place, each once, sorted.

    A pair has no common node between its ends, and it begins and ends with different words.
    """
    pairs: set[Pair] = set()
    for arcs in graph.following:
        phrases: dict[_Nodes, list[Phrase]] = {}
        for word, target in arcs:
            for words, nodes in _paths(graph, ((word,), (target,))):
                phrases.setdefault(nodes, []).append(words)
        for some, others in combinations_with_replacement(phrases, 2):
            if some[-1] == others[-1] and not set(some[:-1]) & set(others[:-1]):
                pairs.update(_differing(phrases[some], phrases[others]))
    return tuple(sorted(pairs))


def _paths(graph: WordGraph, path: _Path) -> Iterator[_Path]:
    words, nodes = path
    yield path
    if nodes[-1] in graph.finals:
        yield words, (*nodes, _END)
    if len(words) < MAX_WORDS:
        for word, target in graph.following[nodes[-1]]:
            yield from _paths(graph, ((*words, word), (*nodes, target)))


def _differing(some: list[Phrase], others: list[Phrase]) -> Iterator[Pair]:
    """The pairs that begin and end with different words."""
    for first, second in product(some, others):
        if first[0] != second[0] and first[-1] != second[-1]:
            yield (first, second) if first < second else (second, first)
