"""The decoder against a plain search of the whole network that prunes nothing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.language.graph import Arc, WordGraph
from hvcpd.recognition.decoder import CAPACITY, Decoder, StepCosts
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.network import HORIZON_FRAMES, MAX_ADVANCE, PADDING, Beam, Network
from hvcpd.recognition.templates import TemplateBank

N_RUNGS = 2
STEPS = StepCosts()
WIDE = Beam(width=1e6, above_filler=1e6, max_pairs=10**6)
WORDS = "abcde"


def random_network(seed: int) -> Network:
    """Four to six nodes, each with one or two words to nodes further on; words of MAX_ADVANCE frames or more.

    No path gets through a shorter word between two prunings unless it skips at every frame.
    """
    rng = np.random.default_rng(seed)
    n_nodes = int(rng.integers(4, 7))
    arcs = []
    for source in range(n_nodes - 1):
        targets = {source + 1, int(rng.integers(source + 1, n_nodes))}
        names = rng.permutation(list(WORDS))
        arcs += [Arc(source, target, str(name)) for target, name in zip(sorted(targets), names, strict=False)]
    pauses = frozenset(int(n) for n in rng.integers(1, n_nodes, 2))
    graph = WordGraph(n_nodes, tuple(arcs), 0, frozenset({n_nodes - 1, int(rng.integers(1, n_nodes))}), pauses)
    sounds = {w: [rng.standard_normal((MAX_ADVANCE + k) * HOP_SAMPLES).astype(np.float32)] for k, w in enumerate(WORDS)}
    return Network(graph, TemplateBank({"oak": sounds}).templates)


@dataclass(frozen=True)
class Input:
    """Distances (frames, hypotheses, rows of the bank) relative to the filler, and the cost of pausing (frames,)."""

    distances: np.ndarray
    noise_cost: np.ndarray


def random_input(net: Network, n_frames: int, seed: int) -> Input:
    rng = np.random.default_rng(seed)
    rows = int((net.first_row + net.length).max())
    return Input(
        rng.uniform(-1.5, 1.0, (n_frames, N_RUNGS, rows)).astype(np.float32),
        rng.uniform(0.0, 0.5, n_frames).astype(np.float32),
    )


def clean_input(net: Network, seed: int) -> tuple[Input, list[str]]:
    """A random sentence, every template frame once, at hypothesis 1 after 9 frames of noise; and its words."""
    rng = np.random.default_rng(seed)
    node, instances = int(net.is_start.argmax()), []
    while not (instances and net.is_final[node]):
        instances.append(int(rng.choice(np.flatnonzero(net.source_node == node))))
        node = int(net.target_node[instances[-1]])
    n_frames = 9 + sum(int(net.length[c]) for c in instances) + 26
    got = random_input(net, n_frames, seed)
    distances = np.abs(got.distances) + 1.0
    noise_cost = np.full(n_frames, 1.0, np.float32)
    noise_cost[:9] = noise_cost[-26:] = 0.0
    frame = 9
    for c in instances:
        for row in range(net.length[c]):
            distances[frame, 1, net.first_row[c] + row] = -0.8
            frame += 1
    return Input(distances, noise_cost), [net.word[c] for c in instances]


def decode(net: Network, given_input: Input, beam: Beam) -> tuple[float, list[str]] | None:
    """Cost and words of the cheapest path that rests in a final node at the end."""
    decoder = Decoder(net, N_RUNGS, beam)
    layout = decoder.active
    for frame in range(len(given_input.distances)):
        if frame % HORIZON_FRAMES == 0:
            layout = decoder.prune()
        hypothesis = np.repeat(np.arange(N_RUNGS), np.diff(layout.hypothesis_begins))
        decoder.advance(given_input.distances[frame, hypothesis, layout.row], float(given_input.noise_cost[frame]))
    best = decoder.best(margin=1e12)
    return None if best.node < 0 else (best.cost, [net.word[step.instance] for step in decoder.trace(best.token)])


Path = tuple[float, tuple[str, ...]]
NONE: Path = (float("inf"), ())


def search(net: Network, given_input: Input) -> Path:
    """The same by recursion over all that a path can have done last: from the definition, without pruning."""

    def more(path: Path, cost: float, *words: str) -> Path:
        return path[0] + cost, path[1] + words

    @cache
    def within(frame: int, hypothesis: int, instance: int, state: int) -> Path:
        if frame < 0 or state < 0:
            return NONE
        ways = [
            more(within(frame - 1, hypothesis, instance, state), STEPS.stay),
            within(frame - 1, hypothesis, instance, state - 1) if state >= 1 else entering(frame, hypothesis, instance),
        ]
        if state >= 1:
            entered = entering(frame, hypothesis, instance)
            before = within(frame - 1, hypothesis, instance, state - 2) if state >= 2 else entered
            ways.append(more(before, STEPS.skip))
        return more(min(ways), float(given_input.distances[frame, hypothesis, net.first_row[instance] + state]))

    @cache
    def word_end(frame: int, hypothesis: int, node: int) -> Path:
        instances = np.flatnonzero(net.target_node == node)
        return min(
            (more(within(frame, hypothesis, c, net.length[c] - 1), 0.0, net.word[c]) for c in instances), default=NONE
        )

    @cache
    def resting(frame: int, hypothesis: int, node: int) -> Path:
        if frame < 0 or not (net.may_pause[node] or net.is_final[node]):
            return NONE
        longer = more(resting(frame - 1, hypothesis, node), float(given_input.noise_cost[frame]))
        return min(longer, word_end(frame, hypothesis, node))

    @cache
    def leaving(frame: int, hypothesis: int, node: int) -> Path:
        paused = resting(frame, hypothesis, node) if net.may_pause[node] else NONE
        return min(paused, word_end(frame, hypothesis, node))

    def entering(frame: int, hypothesis: int, instance: int) -> Path:
        """What precedes a word whose first or second state meets `frame`."""
        node = int(net.source_node[instance])
        if net.is_start[node]:
            return 0.0, ()
        if frame == 0:
            return NONE
        others = [r for r in (hypothesis - 1, hypothesis + 1) if 0 <= r < N_RUNGS]
        return min(
            leaving(frame - 1, hypothesis, node), *(more(leaving(frame - 1, r, node), STEPS.hypothesis) for r in others)
        )

    n_frames = len(given_input.distances)
    for frame in range(n_frames):  # fills the caches from the front, or the recursion would be too deep
        for hypothesis in range(N_RUNGS):
            for instance in range(net.n_instances):
                for state in range(net.length[instance]):
                    within(frame, hypothesis, instance, state)
    return min(resting(n_frames - 1, r, int(n)) for r in range(N_RUNGS) for n in np.flatnonzero(net.is_final))


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 2**31), st.integers(20, 70))
def test_with_the_beam_wide_open_it_finds_what_a_search_of_everything_finds(seed: int, n_frames: int) -> None:
    net = random_network(seed)
    given_input = random_input(net, n_frames, seed + 1)
    expected = search(net, given_input)
    found = decode(net, given_input, WIDE)
    if expected == NONE:
        assert found is None
        return
    assert found is not None
    assert found[0] == pytest.approx(expected[0], abs=1e-3)
    assert tuple(found[1]) == expected[1]


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**31))
def test_with_the_default_beam_it_finds_a_clean_sentence_and_what_it_costs(seed: int) -> None:
    net = random_network(seed)
    given_input, words = clean_input(net, seed)
    expected = search(net, given_input)
    found = decode(net, given_input, Beam())
    assert found is not None
    assert found[1] == list(expected[1]) == words
    assert found[0] == pytest.approx(expected[0], abs=1e-3)
    frames = len(given_input.distances) - 35
    assert found[0] == pytest.approx(-0.8 * frames, abs=1e-3)


YEARS = 40_000_000_000
"""Frames."""


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**31), st.integers(0, 70))
def test_a_decoder_that_was_reset_is_as_good_as_new(seed: int, n_before: int) -> None:
    net = random_network(seed)
    (given_input, _), before = clean_input(net, seed), random_input(net, n_before, seed)
    decoder = Decoder(net, N_RUNGS, Beam())
    fresh = Decoder(net, N_RUNGS, Beam())
    for frame in range(n_before):
        layout = decoder.prune() if frame % HORIZON_FRAMES == 0 else decoder.active
        hypothesis = np.repeat(np.arange(N_RUNGS), np.diff(layout.hypothesis_begins))
        decoder.advance(before.distances[frame, hypothesis, layout.row], float(before.noise_cost[frame]))
    for d in (decoder, fresh):
        d.reset(YEARS)
        for frame in range(len(given_input.distances)):
            layout = d.prune() if frame % HORIZON_FRAMES == 0 else d.active
            hypothesis = np.repeat(np.arange(N_RUNGS), np.diff(layout.hypothesis_begins))
            d.advance(given_input.distances[frame, hypothesis, layout.row], float(given_input.noise_cost[frame]))
    ends = [(d.best().cost, d.best().rested_frames, d.trace(d.best().token)) for d in (decoder, fresh)]
    assert ends[0] == ends[1]
    assert ends[0][2][0].start_frame == YEARS + 9
    assert ends[0][1] == 26


def test_a_decoder_without_records_left_forgets_all_paths_and_goes_on() -> None:
    net = random_network(4)
    given_input, words = clean_input(net, 4)
    decoder = Decoder(net, N_RUNGS, Beam())
    starts, costs = np.full(CAPACITY - 100, -1, np.int64), np.zeros(CAPACITY - 100, np.float32)
    decoder._back_pointers.add(0, 0, starts, costs, costs)
    for frame in range(len(given_input.distances)):
        layout = decoder.prune() if frame % HORIZON_FRAMES == 0 else decoder.active
        hypothesis = np.repeat(np.arange(N_RUNGS), np.diff(layout.hypothesis_begins))
        decoder.advance(given_input.distances[frame, hypothesis, layout.row], float(given_input.noise_cost[frame]))
    assert [net.word[step.instance] for step in decoder.trace(decoder.best().token)] == words


def test_it_follows_only_what_is_promising() -> None:
    net = random_network(4)
    given_input, _ = clean_input(net, 4)
    everything = N_RUNGS * int((net.length + PADDING).sum())
    decoder = Decoder(net, N_RUNGS, Beam())
    sizes = []
    for frame in range(len(given_input.distances)):
        layout = decoder.prune() if frame % HORIZON_FRAMES == 0 else decoder.active
        sizes.append(layout.n_states)
        hypothesis = np.repeat(np.arange(N_RUNGS), np.diff(layout.hypothesis_begins))
        decoder.advance(given_input.distances[frame, hypothesis, layout.row], float(given_input.noise_cost[frame]))
    assert max(sizes) <= everything
    assert np.mean(sizes) < 0.6 * everything
