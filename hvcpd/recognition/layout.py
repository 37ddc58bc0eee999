"""Which part of the network is being decoded: stretches of chains, their states one after the other in one vector.

A path may be at any rung of the ladder of levels, so chains are followed as pairs of rung and chain. Two more states
stand before each stretch, so that the decoder's steps need no special case at its beginning: of a chain that is
followed from its first frame, the second of them is where sentences enter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.network import Index, Network

AHEAD = 2
"""States before each stretch: the longest step of a path."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Stretches ascending by `pair` = rung * n_chains + chain, and their states.

    For each pair (n_pairs): `low` and `high`, its template's frames low up to high; `begin`, its first state.
    For each state (n_states): `key`, ascending and the same in all layouts; `row`, its frame in the template bank.
    States of rung r are `rung_begins[r]` up to `rung_begins[r + 1]`.
    Open pairs, followed from their first frame: `entry`, the state where sentences enter, `source`, rung * n_nodes +
    node. Ending pairs, followed to their last frame: `ends`, which pairs, `last`, that state, `end_chain` and `target`,
    rung * n_nodes + node.
    """

    pair: Index
    low: Index
    high: Index
    begin: Index
    key: Index
    row: Index
    rung_begins: tuple[int, ...]
    entry: Index
    source: Index
    ends: Index
    last: Index
    end_chain: Index
    target: Index

    @property
    def n_states(self) -> int:
        """All states, those ahead of the stretches among them."""
        return len(self.row)


def lay_out(network: Network, n_rungs: int, pair: Index, low: Index, high: Index) -> Layout:
    """The layout of these stretches."""
    rung, chain = np.divmod(pair, network.n_chains)
    length = network.length[chain]
    size = high - low + AHEAD
    ends = np.cumsum(size)
    begin = ends - size
    frame = np.arange(int(size.sum())) - np.repeat(begin - low + AHEAD, size)
    first_row = np.repeat(network.first_row[chain], size)
    is_open, is_ending = low == 0, high == length
    bounds = np.concatenate([[0], ends])[np.searchsorted(rung, np.arange(n_rungs + 1))]
    node = rung * network.n_nodes
    return Layout(
        pair,
        low,
        high,
        begin,
        np.repeat(pair * (network.longest + AHEAD), size) + frame + AHEAD,
        first_row + np.maximum(frame, 0),
        tuple(int(bound) for bound in bounds),
        begin[is_open] + AHEAD - 1,
        (node + network.source_node[chain])[is_open],
        np.flatnonzero(is_ending),
        ends[is_ending] - 1,
        chain[is_ending],
        (node + network.target_node[chain])[is_ending],
    )


def common_states(old: Layout, new: Layout) -> tuple[Index, NDArray[np.bool_]]:
    """Which states of `old` go to the masked ones of `new`."""
    at = np.searchsorted(old.key, new.key)
    at[at == len(old.key)] = 0
    found = old.key[at] == new.key if len(old.key) else np.zeros(len(new.key), np.bool_)
    return at[found], found
