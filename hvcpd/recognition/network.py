"""The decoder's search space: the word network compiled into word instances, and its active states (the beam).

Each voice has its own copy of the word graph, because one speaker utters the whole sentence. Each arc of a copy
holds, for every template of its word, a word instance, a row of states, one a frame.

Pruning is beam search (B. Lowerre, "The HARPY speech recognition system", 1976): a path that costs much more than the
best one is hardly ever the right one, so a large network costs little more than a small one. Beside the beam the number
of instances is limited (V. Steinbiss et al., "Improvements in beam search", ICSLP 1994): in loud noise nothing costs
much more than anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.graph import WordGraph
from hvcpd.recognition.arrays import first_occurrences
from hvcpd.recognition.templates import Template

Index = NDArray[np.intp]
Costs = NDArray[np.float32]


class Network:
    """The compiled network, as arrays that never change.

    Instances (n_instances, sorted by target node): `first_row` and `length`, their frames in the template bank
    (`longest` is the longest one's); `word_shortest` and `word_longest`, frames of all takes of its word in its voice;
    `source_node`, `target_node`; `word` and `word_number` (equal words have equal numbers). Nodes (n_nodes):
    `may_pause`, `is_final`, `has_successors` (words may follow), `is_start`.
    """

    def __init__(self, graph: WordGraph, templates: Sequence[Template], partial: bool = False) -> None:
        """Raises ValueError if a voice lacks a template of a word of the graph, unless `partial`: then a voice says
        only the sentences for which it has all words, and may pause anywhere."""
        self.voices = tuple(dict.fromkeys(t.voice for t in templates))
        self.nodes_per_voice = graph.n_nodes
        self.n_nodes = graph.n_nodes * len(self.voices)
        takes: dict[tuple[str, str], list[Template]] = {}
        for t in templates:
            takes.setdefault((t.voice, t.word), []).append(t)
        instances: list[tuple[int, int, str, int, int, int, int]] = []
        for number, voice in enumerate(self.voices):
            base = number * graph.n_nodes
            missing = [word for word in graph.words if (voice, word) not in takes]
            if missing and not partial:
                raise ValueError(f"voice {voice!r} has no template of: {', '.join(missing)}")
            for arc in graph.arcs:
                of_word = takes.get((voice, arc.word), ())
                lengths = [t.length for t in of_word]
                ends = base + arc.target, base + arc.source
                instances += [(*ends, arc.word, t.first, t.length, min(lengths), max(lengths)) for t in of_word]
        targets, sources, words, *shapes = zip(*sorted(instances), strict=True)
        self.word: tuple[str, ...] = words
        self.n_instances = len(instances)
        self.target_node: Index = np.array(targets, np.intp)
        self.source_node: Index = np.array(sources, np.intp)
        self.first_row, self.length, self.word_shortest, self.word_longest = (np.array(n, np.intp) for n in shapes)
        self.longest = int(self.length.max())
        word_numbers = {word: number for number, word in enumerate(dict.fromkeys(words))}
        self.word_number: Index = np.array([word_numbers[word] for word in words], np.intp)

        nodes, pauses = range(graph.n_nodes), graph.pauses - {graph.start}
        self.is_start = np.tile([node == graph.start for node in nodes], len(self.voices))
        self.is_final = np.tile([node in graph.finals for node in nodes], len(self.voices))
        self.may_pause = np.tile([partial or node in pauses for node in nodes], len(self.voices))
        self.has_successors = np.zeros(self.n_nodes, np.bool_)
        self.has_successors[list(sources)] = True

    def voice_of_node(self, node: int) -> str:
        """The voice whose copy of the graph holds `node`."""
        return self.voices[node // self.nodes_per_voice]


HORIZON_FRAMES = 8
"""Number of frames (80 ms) between two prunings: fewer cost more time, more delay the end of a sentence."""
MAX_ADVANCE = 2 * HORIZON_FRAMES
"""Largest number of states that a path advances in that time, by steps of two at most."""


@dataclass(frozen=True)
class Beam:
    """Pruning thresholds; costs in units of distance."""

    width: float = 30.0
    """A path is dropped if it costs this much more than the best one."""
    above_filler: float = 10.0
    """A path is dropped if it costs this much more than the filler."""
    max_pairs: int = 100
    """Maximum number of active pairs of instance and hypothesis."""


PADDING = 3
"""Padding states before each stretch, as many as a path can step at once."""


@dataclass(frozen=True, eq=False)
class ActiveStates:
    """Stretches of word instances at gain hypotheses, ascending by `pair` = hypothesis * n_instances + instance, and
    their states, one after the other in one vector. Before each stretch stand PADDING more states, so that the
    decoder's steps need no special case at its beginning.

    For each pair (n_pairs): `low` and `high`, its template's frames low up to high; `begin`, its first state.
    For each state (n_states): `key`, ascending and the same in all layouts; `row`, its frame in the template bank.
    States of hypothesis r are `hypothesis_begins[r]` up to `hypothesis_begins[r + 1]`.
    Open pairs, followed from their first frame: `entry`, the state where sentences enter, `source`, hypothesis *
    n_nodes + node. Ending pairs, followed to their last frame: `last`, that state, `end_instance` and `target`,
    hypothesis * n_nodes + node.
    """

    pair: Index
    low: Index
    high: Index
    begin: Index
    key: Index
    row: Index
    hypothesis_begins: tuple[int, ...]
    entry: Index
    source: Index
    last: Index
    end_instance: Index
    target: Index

    @property
    def n_states(self) -> int:
        """All states, those ahead of the stretches among them."""
        return len(self.row)

    @classmethod
    def of(cls, network: Network, n_hypotheses: int, pair: Index, low: Index, high: Index) -> ActiveStates:
        """The active states of these stretches."""
        hypothesis, instance = np.divmod(pair, network.n_instances)
        length = network.length[instance]
        size = high - low + PADDING
        ends = np.cumsum(size)
        begin = ends - size
        frame = np.arange(int(size.sum())) - np.repeat(begin - low + PADDING, size)
        first_row = np.repeat(network.first_row[instance], size)
        is_open, is_ending = low == 0, high == length
        bounds = np.concatenate([[0], ends])[np.searchsorted(hypothesis, np.arange(n_hypotheses + 1))]
        node = hypothesis * network.n_nodes
        return cls(
            pair,
            low,
            high,
            begin,
            np.repeat(pair * (network.longest + PADDING), size) + frame + PADDING,
            first_row + np.maximum(frame, 0),
            tuple(int(bound) for bound in bounds),
            begin[is_open] + PADDING - 1,
            (node + network.source_node[instance])[is_open],
            ends[is_ending] - 1,
            instance[is_ending],
            (node + network.target_node[instance])[is_ending],
        )

    def shared_with(self, new: ActiveStates) -> tuple[Index, NDArray[np.bool_]]:
        """The states that map to the masked states of `new`."""
        at = np.searchsorted(self.key, new.key)
        at[at == len(self.key)] = 0
        found = self.key[at] == new.key if len(self.key) else np.zeros(len(new.key), np.bool_)
        return at[found], found

    def survivors(self, network: Network, cost: Costs, beam: Beam) -> tuple[Index, Index, Index, float, Index]:
        """The stretches that hold promising paths, by the `cost` of each state: each one's pair, low and high;
        the cost from which on paths are dropped; and the nodes that they may reach soon, as in `target`."""
        lowest = np.minimum.reduceat(cost, self.begin)
        bound = min(float(lowest.min()) + beam.width, beam.above_filler)
        if len(lowest) > beam.max_pairs:
            bound = min(bound, float(np.partition(lowest, beam.max_pairs)[beam.max_pairs]))
        at = np.flatnonzero(cost < bound)
        owner = np.searchsorted(self.begin, at, side="right") - 1
        first = first_occurrences(owner)  # in whose order they are
        last = np.flatnonzero(np.diff(owner, append=len(self.begin)))
        pair = self.pair[owner[first]]
        hypothesis, instance = np.divmod(pair, network.n_instances)
        length, target = network.length[instance], hypothesis * network.n_nodes + network.target_node[instance]
        offset = at - self.begin[owner] - PADDING + self.low[owner]
        far = offset[last] + 1 + MAX_ADVANCE
        return pair, np.maximum(offset[first], 0), np.minimum(far, length), bound, target[far >= length]
