"""One-pass connected-word DTW over the whole network, one column a frame.

H. Ney, "The use of a one-stage dynamic programming algorithm for connected word recognition", IEEE Trans. ASSP
32(2), 1984; J. Bridle, M. Brown, R. Chamberlain, "An algorithm for connected word recognition", ICASSP 1982.
The steps are asymmetric (Sakoe & Chiba 1978, Itakura 1975): every frame of the input is used once, and a path stays,
advances by one template frame or skips one, always from the previous column, so a column is a few vector operations.

All costs are relative to the filler, a path that explains any sound; a filler therefore always costs 0, sentences
begin at any frame at cost 0, and a sentence that fits better than the filler has a negative cost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.network import Network

Costs = NDArray[np.float32]
Tokens = NDArray[np.int32]

UNREACHABLE = np.float32(1e9)
"""A cost that no path reaches: over any sum of distances, within float32's range."""
HISTORY_FRAMES = 2048
"""20 s of back pointers: far longer than the longest sentence."""
FROM_START, FROM_PAUSE = -1, -2
"""What stands in a node's record in place of a chain: the beginning of a sentence, the end of a pause."""


@dataclass(frozen=True)
class StepCosts:
    """Extra cost of the steps that leave the diagonal, in units of distance."""

    stay: float = 0.3
    skip: float = 0.3
    rung: float = 2.0
    """For going on at the next rung of the ladder after a word: the speaker comes nearer, or stresses another word."""


def dtw_column(previous: Costs, distances: Costs, steps: StepCosts, out: Costs) -> tuple[NDArray[np.bool_], ...]:
    """One column of asymmetric DTW along the last axis, for states 2 and up; states 0 and 1 are left alone.

    `out[s] = distances[s] + min(previous[s] + stay, previous[s-1], previous[s-2] + skip)`.
    Returns two masks for the states 2 and up: where the path advanced, and where it skipped (which overrides).
    """
    best = out[..., 2:]
    np.add(previous[..., 2:], np.float32(steps.stay), out=best)
    advance = previous[..., 1:-1]
    advanced = advance < best
    np.minimum(best, advance, out=best)
    skip = previous[..., :-2] + np.float32(steps.skip)
    skipped = skip < best
    np.minimum(best, skip, out=best)
    best += distances[..., 2:]
    return advanced, skipped


@dataclass(frozen=True)
class Step:
    """A word on the traced path: its chain, the frames it begins at and ends before, and what it cost."""

    chain: int
    start_frame: int
    end_frame: int
    cost: float


@dataclass(frozen=True)
class Best:
    """The best path of the whole network: its rung and cost; node and rested frames if it rests in a final node."""

    rung: int
    cost: float
    node: int = -1
    rested_frames: int = 0
    behind: float = 0.0


class Decoder:
    """Token passing over `Network` for several rungs (template gains) side by side.

    Call `column` for each frame; `best` and `trace` read the result. Frames are numbered by the caller and must
    follow each other by one until `reset`. A token is the flat index of a record (history slot, rung, node).
    """

    def __init__(self, network: Network, n_rungs: int, steps: StepCosts) -> None:
        self._net = network
        self._steps = steps
        shape = (n_rungs, network.n_states)
        self._cost: Costs = np.full(shape, UNREACHABLE, np.float32)
        self._cost_next: Costs = np.full(shape, UNREACHABLE, np.float32)
        self._token: Tokens = np.zeros(shape, np.int32)
        self._token_next: Tokens = np.zeros(shape, np.int32)
        nodes = (n_rungs, network.n_nodes)
        self._rest: Costs = np.full(nodes, UNREACHABLE, np.float32)
        self._rest_token: Tokens = np.zeros(nodes, np.int32)
        self._rest_allowed = np.where(network.may_pause | network.is_final, np.float32(0), UNREACHABLE)
        self._leave_allowed = np.where(network.may_pause, np.float32(0), UNREACHABLE)
        self._final_nodes = np.flatnonzero(network.is_final)
        history = (HISTORY_FRAMES, n_rungs, network.n_nodes)
        self._record_chain = np.full(history, FROM_START, np.int32)
        self._record_token = np.zeros(history, np.int32)
        self._record_cost: Costs = np.zeros(history, np.float32)
        self._record_start = np.zeros(history, np.int64)
        self._chain_numbers = np.arange(network.n_chains, dtype=np.int32)
        self._node_numbers = np.arange(network.n_nodes, dtype=np.int32)
        self._rung_numbers = np.arange(n_rungs, dtype=np.int32)[:, None]
        self._place_of_node = self._rung_numbers * np.int32(network.n_nodes) + self._node_numbers
        self._slot_size = n_rungs * network.n_nodes
        self._frame = 0
        self.reset(0)

    def reset(self, frame: int) -> None:
        """Forget all paths; the next column is that of `frame`."""
        self._cost.fill(UNREACHABLE)
        self._rest.fill(UNREACHABLE)
        self._frame = frame
        self._record_chain[(frame - 1) % HISTORY_FRAMES] = FROM_START
        self._record_start[(frame - 1) % HISTORY_FRAMES] = frame
        leaving = np.full(self._rest.shape, UNREACHABLE, np.float32)
        leaving[:, self._net.start_nodes] = 0.0
        self._enter_words(frame - 1, leaving, self._place_of_node)

    def column(self, distances: Costs, noise_cost: float) -> None:
        """Advance all paths by one frame.

        `distances`, shape (n_rungs, n_states), are relative to the filler's cost; `noise_cost` is what a frame
        of pause costs, relative to the filler too (0 when the filler takes it for noise).
        """
        advanced, skipped = dtw_column(self._cost, distances, self._steps, self._cost_next)
        token = self._token_next
        token[:, 2:] = self._token[:, 2:]
        np.copyto(token[:, 2:], self._token[:, 1:-1], where=advanced)
        np.copyto(token[:, 2:], self._token[:, :-2], where=skipped)
        self._cost, self._cost_next = self._cost_next, self._cost
        self._token, self._token_next = token, self._token
        self._pass_nodes(np.float32(noise_cost))
        self._frame += 1

    def _pass_nodes(self, noise_cost: np.float32) -> None:
        """Words that end hand their paths to the nodes; pauses and new words take them from there."""
        net, frame = self._net, self._frame
        slot = frame % HISTORY_FRAMES
        ends = self._cost[:, net.last_state]
        best = np.minimum.reduceat(ends, net.group_starts, axis=1)
        which = np.where(ends <= best[:, net.group_of_chain], self._chain_numbers, np.int32(net.n_chains))
        chain = np.minimum.reduceat(which, net.group_starts, axis=1)
        arrival = np.full(self._rest.shape, UNREACHABLE, np.float32)
        arrival[:, net.reached_nodes] = best
        self._rest += noise_cost
        leave = self._rest + self._leave_allowed
        from_pause = leave < arrival
        record_chain = self._record_chain[slot]
        record_token = self._record_token[slot]
        record_chain[:, net.reached_nodes] = chain
        record_token[:, net.reached_nodes] = self._token[self._rung_numbers, net.last_state[chain]]
        np.copyto(record_chain, FROM_PAUSE, where=from_pause)
        np.copyto(record_token, self._rest_token, where=from_pause)
        record_chain[:, net.start_nodes] = FROM_START
        leaving = np.minimum(arrival, leave)
        leaving[:, net.start_nodes] = 0.0
        self._record_cost[slot] = leaving
        self._note_starts(slot, record_chain, record_token)
        arrival += self._rest_allowed
        newer = arrival < self._rest
        np.minimum(self._rest, arrival, out=self._rest)
        np.copyto(self._rest_token, slot * self._slot_size + self._place_of_node, where=newer)
        self._enter_words(frame, *self._change_rungs(leaving))

    def _change_rungs(self, leaving: Costs) -> tuple[Costs, Tokens]:
        """What it costs to go on at each rung, and the place (rung and node) of the record to come from."""
        entering, place = leaving.copy(), self._place_of_node.copy()
        dearer = leaving + np.float32(self._steps.rung)
        for to, other in ((slice(1, None), slice(None, -1)), (slice(None, -1), slice(1, None))):
            cheaper = dearer[other] < entering[to]
            np.copyto(entering[to], dearer[other], where=cheaper)
            np.copyto(place[to], self._place_of_node[other], where=cheaper)
        return entering, place

    def _note_starts(self, slot: int, record_chain: Tokens, record_token: Tokens) -> None:
        """Each record remembers the frame its sentence began at."""
        starts = self._record_start.reshape(-1)[record_token]
        self._record_start[slot] = np.where(record_chain == FROM_START, self._frame + 1, starts)

    def _enter_words(self, frame: int, entering: Costs, place: Tokens) -> None:
        net = self._net
        self._cost[:, net.entry_state - 1] = UNREACHABLE
        self._cost[:, net.entry_state] = entering[:, net.source_node]
        self._token[:, net.entry_state] = (frame % HISTORY_FRAMES) * self._slot_size + place[:, net.source_node]

    def climb(self) -> None:
        """Move the ladder up by one rung: every rung takes over the paths of the next, the highest keeps its own."""
        for rungs in (self._cost, self._token, self._rest, self._rest_token):
            rungs[:-1] = rungs[1:].copy()

    def forget_older_than(self, frame: int) -> None:
        """Drop the paths whose sentence began before `frame` (history is bounded)."""
        for cost, token in ((self._cost, self._token), (self._rest, self._rest_token)):
            cost[self._record_start.reshape(-1)[token] < frame] = UNREACHABLE

    def best(self, margin: float = 0.0) -> Best:
        """The cheapest path of all; a fresh start (the filler, cost 0) counts as one."""
        flat = int(self._cost.argmin())
        rung, state = divmod(flat, self._net.n_states)
        cost = float(self._cost[rung, state])
        rests = self._rest[:, self._final_nodes]
        rest_rung, column = divmod(int(rests.argmin()), len(self._final_nodes))
        rest_cost = float(rests[rest_rung, column])
        if rest_cost > cost + margin:
            return Best(rung, cost)
        node = int(self._final_nodes[column])
        since = self._frame_of(int(self._rest_token[rest_rung, node]) // self._slot_size)
        return Best(rest_rung, rest_cost, node, self._frame - 1 - since, rest_cost - cost)

    def forget_rests(self, longest_frames: int) -> None:
        """Drop the paths that have paused for longer than `longest_frames`."""
        last = self._frame - 1
        age = (last - self._rest_token // self._slot_size) % HISTORY_FRAMES
        self._rest[age > longest_frames] = UNREACHABLE

    def _frame_of(self, slot: int) -> int:
        """The latest frame before the next one that used history `slot`."""
        return self._frame - 1 - (self._frame - 1 - slot) % HISTORY_FRAMES

    def trace(self, rung: int, node: int) -> list[Step]:
        """The words of the path that rests in `node`, first to last."""
        steps: list[Step] = []
        token = int(self._rest_token[rung, node])
        end: tuple[int, int, float] | None = None
        while True:
            chain = int(self._record_chain.reshape(-1)[token])
            frame = self._frame_of(token // self._slot_size)
            cost = float(self._record_cost.reshape(-1)[token])
            if end is not None:
                steps.append(Step(end[0], frame + 1, end[1] + 1, end[2] - cost))
                end = None
            if chain == FROM_START:
                return steps[::-1]
            if chain >= 0:
                end = (chain, frame, cost)
            token = int(self._record_token.reshape(-1)[token])
