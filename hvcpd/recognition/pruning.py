"""Pruning: selects the decoder's active paths.

Beam search (B. Lowerre, "The HARPY speech recognition system", 1976): a path that costs much more than another is
hardly ever the right one. Only paths of sentences that began at the same time or later count as rivals: a long sentence
costs less and less, and would drown the beginning of the next one. Beside the beam the number of instances is limited
(V. Steinbiss et al., "Improvements in beam search", ICSLP 1994): in loud noise nothing costs much more than anything.

The active set consists of stretches of word instances, their states one after the other in one vector. A path may be at
any gain hypothesis, so each entry is a pair of hypothesis and instance. Two extra states stand before each stretch, so
that the decoder's steps need no special case at its beginning. For an instance that is active from its first frame, the
second of them is where sentences enter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.lattice import Costs, Tokens
from hvcpd.recognition.network import Index, Network

AHEAD = 2
"""States before each stretch: the longest step of a path."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Stretches ascending by `pair` = hypothesis * n_instances + instance, and their states.

    For each pair (n_pairs): `low` and `high`, its template's frames low up to high; `begin`, its first state.
    For each state (n_states): `key`, ascending and the same in all layouts; `row`, its frame in the template bank.
    States of hypothesis r are `hypothesis_begins[r]` up to `hypothesis_begins[r + 1]`.
    Open pairs, followed from their first frame: `entry`, the state where sentences enter, `source`, hypothesis *
    n_nodes + node. Ending pairs, followed to their last frame: `ends`, which pairs, `last`, that state, `end_instance`
    and `target`, hypothesis * n_nodes + node.
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
    ends: Index
    last: Index
    end_instance: Index
    target: Index

    @property
    def n_states(self) -> int:
        """All states, those ahead of the stretches among them."""
        return len(self.row)


def lay_out(network: Network, n_hypotheses: int, pair: Index, low: Index, high: Index) -> Layout:
    """The layout of these stretches."""
    hypothesis, instance = np.divmod(pair, network.n_instances)
    length = network.length[instance]
    size = high - low + AHEAD
    ends = np.cumsum(size)
    begin = ends - size
    frame = np.arange(int(size.sum())) - np.repeat(begin - low + AHEAD, size)
    first_row = np.repeat(network.first_row[instance], size)
    is_open, is_ending = low == 0, high == length
    bounds = np.concatenate([[0], ends])[np.searchsorted(hypothesis, np.arange(n_hypotheses + 1))]
    node = hypothesis * network.n_nodes
    return Layout(
        pair,
        low,
        high,
        begin,
        np.repeat(pair * (network.longest + AHEAD), size) + frame + AHEAD,
        first_row + np.maximum(frame, 0),
        tuple(int(bound) for bound in bounds),
        begin[is_open] + AHEAD - 1,
        (node + network.source_node[instance])[is_open],
        np.flatnonzero(is_ending),
        ends[is_ending] - 1,
        instance[is_ending],
        (node + network.target_node[instance])[is_ending],
    )


def common_states(old: Layout, new: Layout) -> tuple[Index, NDArray[np.bool_]]:
    """The states of `old` that map to the masked states of `new`."""
    at = np.searchsorted(old.key, new.key)
    at[at == len(old.key)] = 0
    found = old.key[at] == new.key if len(old.key) else np.zeros(len(new.key), np.bool_)
    return at[found], found


HORIZON_FRAMES = 8
"""80 ms: number of frames decoded between two prunings; fewer cost more, more delay the end of a sentence."""
REACH = 2 * HORIZON_FRAMES
"""Most states that a path advances in that time."""


@dataclass(frozen=True)
class Beam:
    """Thresholds of the pruning; costs in units of distance."""

    width: float = 30.0
    """A path is dropped if it costs this much more than the best path whose sentence began at the same time or
    later."""
    above_filler: float = 10.0
    """A path is dropped if it costs this much more than the filler."""
    same_time_frames: int = 12
    """Sentences that began less than this apart began at the same time."""
    max_pairs: int = 100
    """Maximum number of active pairs of instance and hypothesis."""


@dataclass(frozen=True, eq=False)
class Survivors:
    """The stretches of a layout that hold promising paths, and the nodes that they may reach soon.

    `bound`: the cost from which on the paths of each are dropped.
    """

    pair: Index
    low: Index
    high: Index
    bound: NDArray[np.float32]
    reached: Index


def survivors(
    layout: Layout, length: Index, target: Index, cost: Costs, began: Tokens, oldest: int, beam: Beam
) -> Survivors:
    """Select the next layout. For each pair: `length` in frames and `target`; for each state: `cost` and `began`.

    Paths that began at `oldest` or earlier are dropped.
    """
    size = layout.high - layout.low + AHEAD
    lowest = np.minimum.reduceat(cost, layout.begin)
    bound = _bounds(layout, size, lowest, cost, began, oldest, beam)
    at = np.flatnonzero(cost < np.repeat(bound, size))
    owner = np.searchsorted(layout.begin, at, side="right") - 1
    first = np.flatnonzero(np.diff(owner, prepend=-1))  # of each owner, in whose order they are
    last = np.flatnonzero(np.diff(owner, append=len(layout.begin)))
    alive = owner[first]
    offset = at - layout.begin[owner] - AHEAD + layout.low[owner]
    low = np.maximum(offset[first], 0)
    far = offset[last] + 1 + REACH
    ends_soon = far >= length[alive]
    return Survivors(layout.pair[alive], low, np.minimum(far, length[alive]), bound[alive], target[alive[ends_soon]])


def _bounds(
    layout: Layout, size: Index, lowest: Costs, cost: Costs, began: Tokens, oldest: int, beam: Beam
) -> NDArray[np.float32]:
    """For each pair, the cost from which on its paths are dropped."""
    at = np.flatnonzero(cost <= np.repeat(lowest, size))
    first = np.searchsorted(at, layout.begin)
    start = began[at[first]].astype(np.int64)
    floor = beam.above_filler - beam.width
    order = np.argsort(-start, kind="stable")
    best_since = np.minimum.accumulate(np.minimum(lowest[order], floor))
    newer = np.searchsorted(-start[order], -(start + beam.same_time_frames), side="right") - 1
    rival = np.where(newer >= 0, best_since[np.maximum(newer, 0)], floor)
    excess = np.where(start > oldest, lowest - rival, np.inf)
    width = beam.width
    if len(excess) > beam.max_pairs:
        width = min(width, float(np.partition(excess, beam.max_pairs)[beam.max_pairs]))
    return np.where(start > oldest, rival + width, -np.inf).astype(np.float32)
