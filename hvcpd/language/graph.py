"""The word network: every sentence that the phrasebook can make, as a finite-state acceptor over words.

It is the interface between `language` and `recognition`; neither needs to know more of the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property


@dataclass(frozen=True, slots=True)
class Arc:
    """One word spoken on the way from node `source` to node `target`."""

    source: int
    target: int
    word: str


@dataclass(frozen=True)
class WordGraph:
    """A finite-state network of words; deterministic: no node has two arcs of the same word.

    Sentences are the words along the paths from `start` to any node in `finals`. A speaker may pause at the
    nodes in `pauses` (the commas of the written sentence); elsewhere words follow each other closely.
    """

    n_nodes: int
    arcs: tuple[Arc, ...]
    start: int
    finals: frozenset[int]
    pauses: frozenset[int]

    @property
    def words(self) -> tuple[str, ...]:
        """Every word of the network once, sorted."""
        return tuple(sorted({arc.word for arc in self.arcs}))

    @cached_property
    def following(self) -> tuple[tuple[tuple[str, int], ...], ...]:
        """For each node, the words that may come next, and the node after each."""
        following: list[list[tuple[str, int]]] = [[] for _ in range(self.n_nodes)]
        for arc in self.arcs:
            following[arc.source].append((arc.word, arc.target))
        return tuple(map(tuple, following))

    @cached_property
    def rests(self) -> frozenset[int]:
        """The nodes at which a speaker may be silent: at a pause, or at the end."""
        return self.pauses | self.finals


MOST_WORDS = 64
"""Words of a sentence; with the default tasks the longest has 27, sealed 34."""


def lengths_of(graph: WordGraph) -> tuple[int, ...]:
    """For each node, the numbers of words after which a sentence may end, as bits: bit n for n words, MOST_WORDS at
    most."""
    lengths = [1 if node in graph.finals else 0 for node in range(graph.n_nodes)]
    for _ in range(MOST_WORDS):
        before = list(lengths)
        for arc in graph.arcs:
            lengths[arc.source] |= before[arc.target] << 1
        if lengths == before:
            break
    return tuple(lengths)


def graph_of(words: Sequence[str], pauses: frozenset[int] = frozenset()) -> WordGraph:
    """The network of one sentence; node n comes before its word n."""
    return replace(one_of([words]), pauses=pauses)


def one_of(sentences: Iterable[Sequence[str]]) -> WordGraph:
    """The network of these sentences, each with nodes of its own after the first; not deterministic."""
    arcs: list[Arc] = []
    finals = set()
    for words in sentences:
        nodes = [0, *range(len(arcs) + 1, len(arcs) + 1 + len(words))]
        arcs += [Arc(a, b, word) for a, b, word in zip(nodes[:-1], nodes[1:], words, strict=True)]
        finals.add(nodes[-1])
    return WordGraph(len(arcs) + 1, tuple(arcs), 0, frozenset(finals), frozenset())


def with_phrases(graph: WordGraph, phrases: Iterable[tuple[str, Sequence[str]]]) -> WordGraph:
    """The network in which each phrase may also be said in place of its word; no longer deterministic."""
    arcs, n_nodes = list(graph.arcs), graph.n_nodes
    for word, phrase in phrases:
        for arc in graph.arcs:
            if arc.word != word:
                continue
            nodes = [arc.source, *range(n_nodes, n_nodes + len(phrase) - 1), arc.target]
            n_nodes += len(phrase) - 1
            arcs += [Arc(a, b, said) for a, b, said in zip(nodes[:-1], nodes[1:], phrase, strict=True)]
    return replace(graph, n_nodes=n_nodes, arcs=tuple(arcs))


def beginning_with(graph: WordGraph, phrases: Iterable[Sequence[str]]) -> WordGraph:
    """The network of those sentences that begin with one of these phrases; not deterministic, and with arcs that no
    sentence uses any more."""
    arcs, start, n_nodes = list(graph.arcs), graph.n_nodes, graph.n_nodes + 1
    for phrase in phrases:
        inner = range(n_nodes, n_nodes + len(phrase) - 1)
        n_nodes += len(inner)
        arcs += [Arc(a, b, word) for a, b, word in zip((start, *inner), inner, phrase, strict=False)]
        last = inner[-1] if inner else start
        arcs += [Arc(last, end, phrase[-1]) for end in sorted(ends_of(graph, graph.start, phrase))]
    return replace(graph, n_nodes=n_nodes, arcs=tuple(arcs), start=start)


def ends_of(graph: WordGraph, source: int, phrase: Sequence[str]) -> frozenset[int]:
    """The nodes that the words of `phrase` lead to from the node `source`; empty where they cannot be said."""
    nodes = frozenset((source,))
    for word in phrase:
        nodes = frozenset(target for node in nodes for said, target in graph.following[node] if said == word)
    return nodes


def shortest_with(graph: WordGraph, phrase: Sequence[str]) -> tuple[str, ...] | None:
    """The shortest of the sentences in which these words stand in a row, or None."""
    found = (
        (*(word for _, word in before), *phrase, *(word for _, word in after))
        for before, node in ways_from(graph, graph.start)
        for end in ends_of(graph, node, phrase)
        if (after := way_to_end(graph, end)) is not None
    )
    return min(found, key=len, default=None)


Way = tuple[tuple[int, str], ...]
"""Words with the node before each."""


def ways_from(graph: WordGraph, start: int) -> Iterator[tuple[Way, int]]:
    """The shortest way to each node that can be reached, and the node, nearest first."""
    ways: list[tuple[Way, int]] = [((), start)]
    seen = {start}
    for way, node in ways:
        yield way, node
        for word, target in graph.following[node]:
            if target not in seen:
                seen.add(target)
                ways.append(((*way, (node, word)), target))


def way_to_end(graph: WordGraph, node: int) -> Way | None:
    """The shortest way from a node to the end of a sentence; None where no sentence can end."""
    return next((way for way, end in ways_from(graph, node) if end in graph.finals), None)
