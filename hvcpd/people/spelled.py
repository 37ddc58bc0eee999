"""Finds the sentence of a network whose phones fit best what a net heard (`phones`).

Viterbi's search over the topology of connectionist temporal classification (Graves et al. 2006): each phone lasts for a
frame or more, and between two phones there may be frames of none. Pauses between words are such frames, too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.graph import WordGraph, graph_of
from hvcpd.people.phones import PHONES, Chances

Scores = NDArray[np.float32]
Index = NDArray[np.int64]
Pronounce = Callable[[str], Sequence[Sequence[str]]]

NEVER = np.float32(-1e9)


@dataclass(frozen=True)
class Spelled:
    """A sentence, each word with its first frame and the one after its last, and what it loses: the logarithm of the
    chance of the best of all rows of phones over that of its own, 0 or more."""

    words: tuple[str, ...]
    spans: tuple[tuple[int, int], ...]
    loss: float


@dataclass(frozen=True, eq=False)
class _Ends:
    """Where paths are after each frame.

    `way[t, n]`: the word by which the best path that is at node n after frame t came there, and `since[t, n]` the frame
    at which it did, or -1; `began[t, w]`: the frame at which the word w began that ends in frame t.
    """

    way: Index
    since: Index
    began: Index


class Speller:
    """A network's words as phones, side by side."""

    def __init__(self, graph: WordGraph, pronounce: Pronounce) -> None:
        """`pronounce`: the pronunciations of a word, in PHONES."""
        known = {word: [[PHONES.index(p) for p in said] for said in pronounce(word) if said] for word in graph.words}
        ways = sorted(((arc, said) for arc in graph.arcs for said in known[arc.word]), key=lambda way: way[0].target)
        self._graph = graph
        self._pronounce = pronounce
        self._words = [arc.word for arc, _ in ways]
        self._source: Index = np.array([arc.source for arc, _ in ways], np.int64)
        target = np.array([arc.target for arc, _ in ways], np.int64)
        lengths = np.array([len(said) for _, said in ways], np.int64)
        self._last: Index = np.cumsum(lengths) - 1
        self._first: Index = self._last - lengths + 1
        self._phones: Index = np.array([phone for _, said in ways for phone in said], np.int64)
        self._repeated: Index = 1 + np.flatnonzero(self._phones[1:] == self._phones[:-1])
        self._nodes, self._begins = np.unique(target, return_index=True)
        self._ends = np.append(self._begins[1:], len(ways))

    def spell(self, chances: Chances) -> Spelled | None:
        """The sentence that fits all of the frames best; None if they are too few for any."""
        ends, rest = self._forward(chances)
        finals = sorted(self._graph.finals)
        node = finals[int(rest[finals].argmax())]
        if rest[node] <= NEVER / 2 or not len(chances):
            return None
        best = float(chances.max(axis=1).sum())
        words, spans = self._back(ends, node)
        return Spelled(tuple(words), tuple(spans), best - float(rest[node]))

    def fit(self, chances: Chances, words: Sequence[str]) -> Spelled | None:
        """How well one sentence fits; None if the frames are too few for it."""
        return Speller(graph_of(words), self._pronounce).spell(chances)

    def _forward(self, chances: Chances) -> tuple[_Ends, Scores]:
        """Ends of words, and what the best path to each node has gained in the end."""
        n, n_nodes = len(chances), self._graph.n_nodes
        ends = _Ends(np.full((n, n_nodes), -1), np.full((n, n_nodes), -1), np.zeros((n, len(self._words)), np.int64))
        rest = np.full(n_nodes, NEVER, np.float32)
        rest[self._graph.start] = 0.0
        since = np.full(n_nodes, -1)
        phone = gap = np.full(len(self._phones), NEVER, np.float32)
        phone_began = gap_began = np.zeros(len(phone), np.int64)
        for frame, row in enumerate(chances):
            entered, entered_began = self._entered(phone, gap, phone_began, gap_began)
            entered[self._first], entered_began[self._first] = rest[self._source], frame
            gap_began = np.where(phone > gap, phone_began, gap_began)
            gap = np.maximum(phone, gap) + row[-1]
            phone_began = np.where(entered > phone, entered_began, phone_began)
            phone = np.maximum(entered, phone) + row[self._phones]
            rest = rest + row[-1]
            self._arrive(phone[self._last], rest, since, frame, ends)
            ends.since[frame], ends.began[frame] = since, phone_began[self._last]
        return ends, rest

    def _entered(self, phone: Scores, gap: Scores, phone_began: Index, gap_began: Index) -> tuple[Scores, Index]:
        """Scores of going on to each phone from the one before it or from the frames of none after that."""
        straight = np.roll(phone, 1)
        straight[self._repeated] = NEVER  # a phone said twice has a gap within
        around = np.roll(gap, 1)
        began = np.where(around > straight, np.roll(gap_began, 1), np.roll(phone_began, 1))
        return np.maximum(straight, around), began

    def _arrive(self, scores: Scores, rest: Scores, since: Index, frame: int, ends: _Ends) -> None:
        """Words that end in a frame lead to nodes, where that is better than to have rested there."""
        best = np.maximum.reduceat(scores, self._begins)
        arriving = np.flatnonzero(best > rest[self._nodes])
        nodes = self._nodes[arriving]
        rest[nodes], since[nodes] = best[arriving], frame
        for node, begin, end in zip(nodes, self._begins[arriving], self._ends[arriving], strict=True):
            ends.way[frame, node] = begin + scores[begin:end].argmax()

    def _back(self, ends: _Ends, node: int) -> tuple[list[str], list[tuple[int, int]]]:
        words, spans, frame = [], [], int(ends.since[-1, node])
        while frame >= 0:
            way = int(ends.way[frame, node])
            begin, node = int(ends.began[frame, way]), int(self._source[way])
            words.append(self._words[way])
            spans.append((begin, frame + 1))
            frame = int(ends.since[begin - 1, node]) if begin > 0 else -1
        return words[::-1], spans[::-1]
