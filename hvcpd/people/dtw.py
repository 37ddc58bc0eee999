"""One-pass connected-word dynamic time warping that explains a whole segment of sound.

As the robots' decoder does it (H. Ney, "The use of a one-stage dynamic programming algorithm for connected word
recognition", IEEE Trans. ASSP 32(2), 1984), but without a filler to which a badly spoken word could be lost: each frame
is a word's or the room's. So costs of paths compare as they are, and few need to be dropped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.arrays import distinct, first_of_each
from hvcpd.recognition.network import Index, Network

Costs = NDArray[np.float32]
Frames = NDArray[np.int32]
Cells = NDArray[np.int64]
"""Costs of paths in units of 1 / STEPS, in the high bits, and in the low FRAME_BITS the frame in which a path's word
began: the cheapest of some paths is then one minimum, with its beginning."""

FAR = np.float32(1e8)
"""A cost that no path reaches, and to which distances can be added in float32."""
STAY, SKIP, LEAP = np.float32(0.3), np.float32(0.6), np.float32(1.2)
"""Extra costs of the steps that leave the diagonal, in units of distance: to stay, to skip a template's frame, to leap
over two. People's digits, cross-validated over takes: 237 of 240 right with this skip, 234 with 0.3; fluent sentences
of nine synthetic voices: 87 of 90, with 0.3 88, with 0.8 86."""
GUARD = 3
"""Cells before each instance, as many as the longest step."""
BLOCK_FRAMES = 10
"""Number of frames between prunings: too few for anybody to begin more than one further word."""
AT_ONCE_FRAMES = 5 * BLOCK_FRAMES
"""Number of frames whose distances are computed at once: fewer take longer, and a whole segment takes 30 MB a
person."""
REACH = GUARD * BLOCK_FRAMES
"""Most cells that a path advances in that time."""
STEPS, FRAME_BITS = 1 << 14, 16
FRAME_MASK = (1 << FRAME_BITS) - 1
WIDTH = np.float32(120.0)
"""A path is dropped if it costs this much more than the best: as much as half a second of wrong sounds."""


@dataclass(frozen=True, eq=False)
class Ends:
    """Result of the forward pass.

    For each frame (first axis) the `cost` of each word instance's end and the frame in which it `began`, and for each
    node the frame in which the last word before it ended (`since`; -1: none). `rest`, one row more: the cost of being
    at each node before each frame, and after the last. `nearest`: each frame's distance to the nearest template frame.
    """

    cost: Costs
    began: Frames
    since: Frames
    rest: Costs
    nearest: Costs


@dataclass(frozen=True)
class Word:
    """A word of a path: its instance, its frames `start` up to `end`, its cost, and the extra cost of the cheapest
    other word that leads to the same place at the same time."""

    instance: int
    start: int
    end: int
    cost: float
    margin: float


@dataclass(frozen=True, eq=False)
class _Part:
    """The cells of some instances: of the first frame, of the last, and where each target node's instances begin.

    `rows`: the template frames that they have, and `row` the number among these of each cell's.
    """

    instances: Index
    cells: Index
    rows: Index
    row: Index
    is_guard: NDArray[np.bool_]
    first: Index
    last: Index
    nodes: Index
    node_begins: Index


class OnePassDtw:
    """A network's instances as cells, one for each template frame, side by side."""

    def __init__(self, net: Network) -> None:
        self.net = net
        size = net.length + GUARD
        instances = zip(net.first_row, net.length, strict=True)
        self.rows: Index = distinct(np.concatenate([first + np.arange(n) for first, n in instances]))
        """The template frames that belong to an instance."""
        self._first_row: Index = np.searchsorted(self.rows, net.first_row)
        self._begin: Index = np.cumsum(size) - size
        self._n_cells = int(size.sum())
        end = self._begin + size
        self._endings: Index = np.stack([np.maximum(end - REACH, self._begin), end], axis=1).ravel()[:-1]
        """Where the last REACH cells of each instance begin and end, in turn, as `reduceat` takes them."""

    def forward(self, distances: Callable[[int, int], Costs], to_noise: Costs) -> Ends:
        """The forward pass: `to_noise`, each frame's distance to the room's noise; `distances(begin, end)`, those of
        some frames (first axis) to the template frames of `rows`."""
        net, n = self.net, len(to_noise)
        cells = np.full(self._n_cells, _FAR, np.int64)
        ends = Ends(
            np.full((n, net.n_instances), FAR, np.float32),
            np.zeros((n, net.n_instances), np.int32),
            np.empty((n, net.n_nodes), np.int32),
            np.full((n + 1, net.n_nodes), FAR, np.float32),
            np.empty(n, np.float32),
        )
        ends.rest[0, net.start_nodes] = 0.0
        for begin in range(0, n, BLOCK_FRAMES):
            part = self._promising(cells, ends.rest[begin])
            inside = cells[part.cells]
            end = min(begin + BLOCK_FRAMES, n)
            if begin % AT_ONCE_FRAMES == 0:
                some = distances(begin, min(begin + AT_ONCE_FRAMES, n))
                ends.nearest[begin : begin + AT_ONCE_FRAMES] = some.min(axis=1)
            steps = _cells(some[begin % AT_ONCE_FRAMES :][: end - begin, part.rows])
            for frame in range(begin, end):
                inside = self._column(part, inside, ends, frame, steps[frame - begin], to_noise[frame])
            cells.fill(_FAR)
            cells[part.cells] = inside
        return ends

    def _promising(self, cells: Cells, rest: Costs) -> _Part:
        """The instances that a path is in or may enter soon, if it does not cost WIDTH more than the best."""
        net, entering = self.net, rest[self.net.source_node]
        lowest = np.minimum(_costs(np.minimum.reduceat(cells, self._begin)), entering)
        bound = min(float(lowest.min()), float(rest.min())) + WIDTH
        leaving = _costs(np.minimum.reduceat(cells, self._endings)[::2])
        leaving = np.minimum(leaving, np.where(net.length <= REACH, entering, FAR))
        reached = np.zeros(net.n_nodes, np.bool_)
        reached[net.target_node[leaving < bound]] = True
        instances = np.flatnonzero((lowest < bound) | reached[net.source_node])
        size = net.length[instances] + GUARD
        begins = np.cumsum(size) - size
        offset = np.arange(int(size.sum())) - np.repeat(begins, size)
        nodes = net.target_node[instances]
        node_begins = first_of_each(nodes)
        row = np.repeat(self._first_row[instances], size) + np.maximum(offset - GUARD, 0)
        used = np.zeros(len(self.rows), np.bool_)
        used[row] = True
        return _Part(
            instances,
            np.repeat(self._begin[instances], size) + offset,
            np.flatnonzero(used),
            (np.cumsum(used) - 1)[row],
            offset < GUARD,
            begins + GUARD,
            begins + size - 1,
            nodes[node_begins],
            node_begins,
        )

    def _column(
        self, part: _Part, cells: Cells, ends: Ends, frame: int, distances: Cells, to_noise: np.float32
    ) -> Cells:
        cells[part.first - 1] = _cells(ends.rest[frame, self.net.source_node[part.instances]]) + frame
        cells = _stepped(cells)
        cells += distances.take(part.row)
        cells[part.is_guard] = _FAR
        last = cells[part.last]
        cost = ends.cost[frame, part.instances] = _costs(last)
        ends.began[frame, part.instances] = last & FRAME_MASK
        arriving = np.full(self.net.n_nodes, FAR, np.float32)
        if len(part.nodes):
            arriving[part.nodes] = np.minimum.reduceat(cost, part.node_begins)
        resting = ends.rest[frame] + to_noise
        before = ends.since[frame - 1] if frame else np.full(self.net.n_nodes, -1, np.int32)
        ends.since[frame] = np.where(arriving < resting, frame, before)
        np.minimum(resting, arriving, out=ends.rest[frame + 1])
        return cells

    def trace(self, ends: Ends, node: int) -> tuple[Word, ...]:
        """The words of the cheapest path that is at `node` after the last frame."""
        return tuple(reversed(list(self._back(ends, node))))

    def _back(self, ends: Ends, node: int) -> Iterator[Word]:
        net, frame = self.net, int(ends.since[-1, node])
        while frame >= 0:
            begin, end = np.searchsorted(net.target_node, (node, node + 1))
            costs = ends.cost[frame, begin:end]
            instance = int(begin + costs.argmin())
            others = costs[net.word_number[begin:end] != net.word_number[instance]]
            start, source = int(ends.began[frame, instance]), int(net.source_node[instance])
            cost = float(ends.cost[frame, instance])
            margin = float(others.min(initial=FAR)) - cost
            yield Word(instance, start, frame + 1, cost - float(ends.rest[start, source]), margin)
            node, frame = source, int(ends.since[start - 1, source]) if start > 0 else -1


def _cells(costs: Costs) -> Cells:
    return np.rint(costs * np.float64(STEPS)).astype(np.int64) << FRAME_BITS


def _costs(cells: Cells) -> Costs:
    return np.asarray((cells >> FRAME_BITS) / STEPS, np.float32)


_FAR, _STAY, _SKIP, _LEAP = (int(_cells(np.asarray(cost))) for cost in (FAR, STAY, SKIP, LEAP))


def _stepped(cells: Cells) -> Cells:
    """One column without its distances: for each cell, its cheapest predecessor."""
    new = cells + _STAY
    for reach, extra in ((1, 0), (2, _SKIP), (3, _LEAP)):
        np.minimum(new[reach:], cells[:-reach] + extra, out=new[reach:])
    return new
