"""The decoder: token passing by one-pass connected-word DTW over the active states of the network, one column a frame.

H. Ney, "The use of a one-stage dynamic programming algorithm for connected word recognition", IEEE Trans. ASSP
32(2), 1984; J. Bridle, M. Brown, R. Chamberlain, "An algorithm for connected word recognition", ICASSP 1982.
The steps are asymmetric (Sakoe & Chiba 1978, Itakura 1975): every frame of the input is used once, and a path stays,
advances by one template frame or skips one or two, always from the previous column, so a column is a few vector
operations.

All costs are relative to the filler, a path that explains any sound; a filler therefore always costs 0, sentences
begin at any frame at cost 0, and a sentence that fits better than the filler has a negative cost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.arrays import first_occurrences, lazy_zeros
from hvcpd.recognition.events import WordSpan
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.network import MAX_ADVANCE, PADDING, ActiveStates, Beam, Costs, Network

CAPACITY = 1 << 17
"""Number of records: about ten a frame while somebody speaks, so two minutes; 4 MB if a path ever lives that long."""
PAUSE = -1
"""The instance in the record of a pause."""
_RECORD = np.dtype([("frame", "i8"), ("instance", "i4"), ("token", "i8"), ("cost", "f4"), ("rival", "f4")])

Tokens = NDArray[np.int64]


@dataclass(frozen=True)
class TracedWord:
    """A word of a traced path: its instance, its first frame, the frame after its last, its cost, and the `margin`, the
    extra cost of the best other word in the same place."""

    instance: int
    start_frame: int
    end_frame: int
    cost: float
    margin: float

    def span(self, word: str, confidence: float, origin: int = 0) -> WordSpan:
        """Its place, in samples, if frame 0 begins at sample `origin`."""
        start, end = (origin + frame * HOP_SAMPLES for frame in (self.start_frame, self.end_frame))
        return WordSpan(word, start, end, confidence)


class BackPointers:
    """The word ends and pauses that paths have passed. The decoder's tokens point to them: a token is the number of a
    record, or, when negative, the start of a sentence: -1 - frame."""

    def __init__(self) -> None:
        self._records = lazy_zeros((CAPACITY,), _RECORD)
        self._count = 0

    def clear(self) -> None:
        """Forget all records: no path is left that points to one."""
        self._count = 0

    def add(self, frame: int, instance: NDArray[np.intp] | int, token: Tokens, cost: Costs, rival: Costs) -> Tokens:
        """Store records of paths that end a word (or a pause) with `frame`; return their tokens."""
        numbers = np.arange(self._count, self._count + len(token), dtype=np.int64) % CAPACITY
        self._count += len(token)
        new = np.empty(len(token), _RECORD)
        new["frame"], new["instance"], new["token"], new["cost"], new["rival"] = frame, instance, token, cost, rival
        self._records[numbers] = new
        return numbers

    def frame_of(self, token: Tokens) -> Tokens:
        """The last frame of the word or pause that each record ends."""
        return np.where(token < 0, -2 - token, self._records["frame"][np.maximum(token, 0)])

    @property
    def is_full(self) -> bool:
        """Whether few records are left."""
        return self._count > CAPACITY * 7 // 8

    def trace(self, token: int) -> list[TracedWord]:
        """The words of the path that ends in `token`, first to last."""
        steps: list[TracedWord] = []
        while token >= 0:
            frame, instance, before, cost, rival = self._records[token].item()
            if instance != PAUSE:
                start_frame = int(self.frame_of(np.array([before], np.int64))[0]) + 1
                before_cost = float(self._records["cost"][before]) if before >= 0 else 0.0
                steps.append(TracedWord(instance, start_frame, frame + 1, cost - before_cost, rival - cost))
            token = before
        return steps[::-1]


UNREACHABLE = np.float32(1e9)
"""A cost that no path reaches: over any sum of distances, within float32's range."""


@dataclass(frozen=True)
class StepCosts:
    """Extra cost of steps off the diagonal, in units of distance."""

    stay: float = 0.3
    skip: float = 0.3
    leap: float | None = None
    """To skip two frames of the template; None: that is not possible."""
    hypothesis: float = 2.0
    """To go on at the next gain hypothesis after a word: the speaker comes nearer, or stresses another word."""


STEPS = StepCosts()


def dtw_column(previous: Costs, distances: Costs, steps: StepCosts, out: Costs) -> tuple[NDArray[np.bool_], ...]:
    """One column of asymmetric DTW along the last axis, for states 2 and up; states 0 and 1 are left unchanged.

    `out[s] = distances[s] + min(previous[s] + stay, previous[s-1], previous[s-2] + skip, previous[s-3] + leap)`.
    Returns masks: where the path advanced and where it skipped, for the states 2 and up, and with a `leap` where it
    leapt, for the states 3 and up; each overrides those before it.
    """
    best = out[..., 2:]
    np.add(previous[..., 2:], np.float32(steps.stay), out=best)
    advance = previous[..., 1:-1]
    advanced = advance < best
    np.minimum(best, advance, out=best)
    skip = previous[..., :-2] + np.float32(steps.skip)
    skipped = skip < best
    np.minimum(best, skip, out=best)
    masks = [advanced, skipped]
    if steps.leap is not None:
        leap = previous[..., :-3] + np.float32(steps.leap)
        masks.append(leap < best[..., 1:])
        np.minimum(best[..., 1:], leap, out=best[..., 1:])
    best += distances[..., 2:]
    return tuple(masks)


@dataclass(frozen=True)
class BestPath:
    """The best path of the network: its cost; if it rests in a final node, that node, its token, the number of frames
    of rest, and the amount `behind` by which a path inside a word is cheaper still."""

    cost: float
    node: int = -1
    token: int = -1
    rested_frames: int = 0
    behind: float = 0.0


class Decoder:
    """Token passing over `Network` for several hypotheses (template gains) side by side.

    Call `prune`, then `advance` for each of at most HORIZON_FRAMES frames, and so on; `best` and `trace` read the
    result. Frames are numbered by the caller and follow each other by one until `reset`.
    """

    def __init__(self, network: Network, n_hypotheses: int, beam: Beam, steps: StepCosts = STEPS) -> None:
        self._net = network
        self._n_hypotheses = n_hypotheses
        self._beam = beam
        self._steps = steps
        nodes = network.is_start, network.may_pause, network.is_final
        # Of each node at each hypothesis, numbered as `ActiveStates.source` and `target`:
        self._is_start, self._may_pause, is_final = (np.tile(each, n_hypotheses) for each in nodes)
        self._may_rest, self._finals = self._may_pause | is_final, np.flatnonzero(is_final)
        self._rest: Costs = np.full(len(is_final), UNREACHABLE, np.float32)
        self._rest_token: Tokens = np.zeros(len(is_final), np.int64)
        self._back_pointers = BackPointers()
        self.reset(0)

    def reset(self, frame: int) -> None:
        """Forget all paths; the next column is that of `frame`."""
        self._frame = frame
        self._back_pointers.clear()
        self._rest.fill(UNREACHABLE)
        self._bound = np.float32(self._beam.above_filler)
        """The cost from which on no path leaves a word."""
        none = np.zeros(0, np.intp)
        self._set_active(ActiveStates.of(self._net, self._n_hypotheses, none, none, none))
        self.prune()
        self._begin_sentences()

    def _set_active(self, states: ActiveStates) -> None:
        self.active = states
        self._cost: Costs = np.full(states.n_states, UNREACHABLE, np.float32)
        self._token: Tokens = np.zeros(states.n_states, np.int64)
        self._padding = (states.begin[:, None] + np.arange(PADDING)).ravel()
        self._start_entry = states.entry[self._is_start[states.source]]

    def prune(self) -> ActiveStates:
        """Drop all but the promising paths, and return the active states of the next HORIZON_FRAMES frames."""
        if self._back_pointers.is_full:
            self.reset(self._frame)
        old, cost, token = self.active, self._cost, self._token
        net = self._net
        n_pairs = self._n_hypotheses * net.n_instances
        low, high = np.full(n_pairs, -1, np.intp), np.zeros(n_pairs, np.intp)
        reached = (self._rest < self._beam.above_filler) & self._may_pause
        if len(old.pair):
            kept, lows, highs, bound, soon = old.survivors(net, cost, self._beam)
            low[kept], high[kept], self._bound = lows, highs, np.float32(bound)
            reached[soon] = True
        opened = reached | self._is_start  # paths may leave these nodes soon, at the neighbouring hypotheses, too
        opened[net.n_nodes :] |= reached[: -net.n_nodes]
        opened[: -net.n_nodes] |= reached[net.n_nodes :]
        entering = np.flatnonzero(opened.reshape(-1, net.n_nodes)[:, net.source_node])
        low[entering] = 0
        high[entering] = np.maximum(high[entering], np.minimum(net.length[entering % net.n_instances], MAX_ADVANCE))
        pairs = np.flatnonzero(low >= 0)
        self._set_active(ActiveStates.of(net, self._n_hypotheses, pairs, low[pairs], high[pairs]))
        were, are = old.shared_with(self.active)
        self._cost[are] = cost[were]
        self._token[are] = token[were]
        return self.active

    def advance(self, distances: Costs, noise_cost: float) -> None:
        """Advance all paths by one frame.

        `distances`, shape (n_states,) of the active states, are relative to the filler's cost; `noise_cost` is the cost
        of a frame of pause, also relative to the filler (0 when the filler takes the frame for noise).
        """
        cost, token = np.empty_like(self._cost), self._token.copy()
        advanced, *farther = dtw_column(self._cost, distances, self._steps, cost)
        np.copyto(token[2:], self._token[1:-1], where=advanced)
        for reach, mask in enumerate(farther, 2):
            np.copyto(token[reach:], self._token[:-reach], where=mask)
        self._cost, self._token = cost, token
        ends = self._cost[self.active.last]
        passing = np.flatnonzero(ends < self._bound)
        self._cost[self._padding] = UNREACHABLE
        if len(passing) or self._rest.min() < UNREACHABLE:
            self._pass_nodes(passing, ends[passing], np.float32(noise_cost))
        self._frame += 1
        self._begin_sentences()

    def _begin_sentences(self) -> None:
        self._cost[self._start_entry] = 0.0
        self._token[self._start_entry] = -1 - self._frame

    def _pass_nodes(self, passing: NDArray[np.intp], ends: Costs, noise_cost: np.float32) -> None:
        """Pass paths from words that end to their nodes, and from there to pauses and the next words."""
        leaving = np.full(self._rest.shape, UNREACHABLE, np.float32)
        token = np.zeros(self._rest.shape, np.int64)
        self._rest += noise_cost
        self._record_pauses(leaving, token)
        if len(passing):
            self._record_words(passing, ends, leaving, token)
        if self._rest.min() >= self._beam.above_filler:
            self._rest.fill(UNREACHABLE)
        entering, token = self._change_hypotheses(leaving, token)
        self._cost[self.active.entry] = entering[self.active.source]
        self._token[self.active.entry] = token[self.active.source]

    def _record_pauses(self, leaving: Costs, token: Tokens) -> None:
        going_on = (self._rest < self._beam.above_filler) & self._may_pause
        if going_on.any():
            cost = self._rest[going_on]
            leaving[going_on] = cost
            token[going_on] = self._back_pointers.add(
                self._frame, PAUSE, self._rest_token[going_on], cost, np.full_like(cost, UNREACHABLE)
            )

    def _record_words(self, passing: NDArray[np.intp], ends: Costs, leaving: Costs, token: Tokens) -> None:
        """Record, of the words that end at the same hypothesis and node, the cheapest."""
        states = self.active
        place = states.target[passing]
        order = np.lexsort((ends, place))
        winner = order[first_occurrences(place[order])]
        at, cost, instance = place[winner], ends[winner], states.end_instance[passing[winner]]
        rival = self._rivals(states.end_instance[passing], ends, instance)
        record = self._back_pointers.add(self._frame, instance, self._token[states.last[passing[winner]]], cost, rival)
        sooner = cost < leaving[at]
        leaving[at[sooner]] = cost[sooner]
        token[at[sooner]] = record[sooner]
        rests = self._may_rest[at] & (cost < self._rest[at])
        self._rest[at[rests]] = cost[rests]
        self._rest_token[at[rests]] = record[rests]

    def _rivals(self, instances: NDArray[np.intp], ends: Costs, winners: NDArray[np.intp]) -> Costs:
        """For each winner, the lowest cost of another word that ends at its node in this frame, at any hypothesis."""
        node, word = self._net.target_node, self._net.word_number
        other = (node[instances] == node[winners][:, None]) & (word[instances] != word[winners][:, None])
        return np.asarray(np.where(other, ends, UNREACHABLE).min(axis=1), np.float32)

    def _change_hypotheses(self, leaving: Costs, token: Tokens) -> tuple[Costs, Tokens]:
        """The cost of entering words at each hypothesis, and the token to enter with."""
        entering, chosen = leaving.copy(), token.copy()
        dearer = leaving + np.float32(self._steps.hypothesis)
        after, before = slice(self._net.n_nodes, None), slice(None, -self._net.n_nodes)
        for to, other in ((after, before), (before, after)):
            cheaper = dearer[other] < entering[to]
            np.copyto(entering[to], dearer[other], where=cheaper)
            np.copyto(chosen[to], token[other], where=cheaper)
        return entering, chosen

    def best(self, margin: float = 0.0) -> BestPath:
        """The cheapest path; a resting path counts as the cheapest if it costs no more than `margin` above it."""
        cost = float(self._cost.min(initial=0.0))
        at = int(self._finals[self._rest[self._finals].argmin()])
        rest_cost, token = float(self._rest[at]), int(self._rest_token[at])
        if rest_cost > cost + margin or rest_cost >= UNREACHABLE:
            return BestPath(min(cost, float(self._rest.min())))
        since = int(self._back_pointers.frame_of(self._rest_token[at : at + 1])[0])
        return BestPath(rest_cost, at % self._net.n_nodes, token, self._frame - 1 - since, rest_cost - cost)

    def drop_long_pauses(self, longest_frames: int) -> None:
        """Drop the paths that have paused for longer than `longest_frames`."""
        age = self._frame - 1 - self._back_pointers.frame_of(self._rest_token)
        self._rest[age > longest_frames] = UNREACHABLE

    def trace(self, token: int) -> list[TracedWord]:
        """The words of the path that ends in `token`, first to last."""
        return self._back_pointers.trace(token)
