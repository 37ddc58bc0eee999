"""Which phrases compete, how far apart they sound, and what rate follows from it."""

from __future__ import annotations

import sys
from types import FrameType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.assembly.separation import CONDITIONS, ConfusionCurve, References, VoiceSounds, band_noise
from hvcpd.assembly.sound import Sound
from hvcpd.language.competition import competing_phrases
from hvcpd.language.graph import Arc, WordGraph
from hvcpd.recognition.decoder import UNREACHABLE, StepCosts
from hvcpd.recognition.frontend import N_FEATURES, power_weights
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.voices import voice_named

WORDS = ("red", "bread", "green", "indigo", "in", "the", "go", "rose")


@pytest.fixture(scope="module")
def sounds() -> VoiceSounds:
    speaker = Sound(Lexicon.load()).speaker_in(voice_named("oak"))
    return VoiceSounds({word: speaker.templates(word) for word in WORDS})


def graph(finals: set[int], *arcs: tuple[int, int, str]) -> WordGraph:
    nodes = 1 + max(max(source, target) for source, target, _ in arcs)
    return WordGraph(nodes, tuple(Arc(*arc) for arc in arcs), 0, frozenset(finals), frozenset())


def test_words_between_the_same_nodes_compete() -> None:
    found = competing_phrases(graph({2}, (0, 1, "red"), (0, 1, "blue"), (1, 2, "rose")))
    assert found == ((("blue",), ("red",)),)


def test_phrases_of_different_length_compete_where_they_meet_and_not_beyond() -> None:
    arcs = ((0, 1, "indigo"), (0, 2, "in"), (2, 3, "the"), (3, 1, "go"), (1, 4, "rose"))
    assert competing_phrases(graph({4}, *arcs)) == ((("in", "the", "go"), ("indigo",)),)


def test_sentences_that_end_in_different_places_compete() -> None:
    assert competing_phrases(graph({1, 3}, (0, 1, "stop"), (0, 2, "i"), (2, 3, "go"))) == ((("i", "go"), ("stop",)),)


def test_phrases_that_never_meet_do_not_compete() -> None:
    instance = [(n, n + 1, f"w{n}") for n in range(1, 6)]
    assert competing_phrases(graph({6, 7}, (0, 1, "a"), (0, 7, "b"), *instance)) == ()


def test_phrases_that_go_through_the_same_places_are_not_compared_with_one_another() -> None:
    """A start does this; with each pair compared it took a Raspberry Pi seconds."""
    arcs = [(stage, stage + 1, f"{stage}-{n}") for stage in range(3) for n in range(12)]
    lines = 0

    def count(_frame: FrameType, event: str, _argument: object) -> Any:
        nonlocal lines
        lines += event == "line"
        return count

    before = sys.gettrace()
    sys.settrace(count)
    try:
        found = competing_phrases(graph({3}, *arcs))
    finally:
        sys.settrace(before)
    assert len(found) == 3 * 12 * 11 / 2
    assert lines < 50_000  # half a million pairs of phrases would meet


def brute_force(heard: np.ndarray, reference: np.ndarray, steps: StepCosts) -> float:
    """Asymmetric DTW cell by cell, by its definition."""
    cost = np.full((len(heard), len(reference)), np.inf)
    for t in range(len(heard)):
        for s in range(len(reference)):
            if t == 0:
                before = {0: 0.0, 1: steps.skip}.get(s, np.inf)
            else:
                before = cost[t - 1, s] + steps.stay
                before = min(before, cost[t - 1, s - 1] if s > 0 else np.inf)
                before = min(before, cost[t - 1, s - 2] + steps.skip if s > 1 else np.inf)
            cost[t, s] = before + np.linalg.norm(heard[t] - reference[s])
    return float(cost[-1, -1])


@given(st.integers(0, 2**32 - 1), st.integers(1, 7), st.integers(1, 7), st.integers(1, 7))
def test_costs_are_those_of_dtw_cell_by_cell(seed: int, n: int, m: int, k: int) -> None:
    random = np.random.default_rng(seed)
    heard, one, other = (random.normal(size=(2, frames, N_FEATURES)).astype(np.float32) for frames in (n, m, k))
    found = References([[one, other], [other]]).costs(heard)
    for c in range(2):
        costs = [brute_force(heard[c], reference[c], StepCosts()) for reference in (one, other)]
        expected = np.minimum([min(costs), costs[1]], UNREACHABLE)
        np.testing.assert_allclose(found[c], expected, rtol=1e-3)


def test_a_phrase_costs_nothing_as_itself_and_more_as_any_other(sounds: VoiceSounds) -> None:
    distances = sounds.distances(("red",), [("red",), ("bread",), ("green",), ("indigo",)])
    np.testing.assert_allclose(distances[:, 0], 0.0, atol=0.5)
    assert (distances[:, 1] > 5.0).all()
    assert (distances[:, 1] < distances[:, 2]).all()
    assert (distances[:, 2] < distances[:, 3]).all()


def test_noise_brings_phrases_nearer(sounds: VoiceSounds) -> None:
    by_condition = {str(c): float(sounds.distances(("red",), [("green",)])[i, 0]) for i, c in enumerate(CONDITIONS)}
    assert by_condition["quiet"] > by_condition["white noise at 0 dB"] > by_condition["white noise at -5 dB"]
    assert by_condition["quiet"] > by_condition["pink noise at 0 dB"] > by_condition["pink noise at -5 dB"]


def test_a_phrase_of_several_words_is_nearer_to_the_word_it_sounds_like(sounds: VoiceSounds) -> None:
    distances = sounds.distances(("in", "the", "go"), [("indigo",), ("green",), ("rose",)])
    assert (distances[:, 0] < 0.8 * distances[:, 1:].min(axis=1)).all()


@pytest.mark.parametrize("colour", ["white", "pink"])
def test_band_noise_has_power_1(colour: str) -> None:
    assert float(band_noise(colour) @ power_weights()) == pytest.approx(1.0, rel=1e-4)


def test_pink_noise_falls_against_white() -> None:
    ratio = band_noise("pink") / band_noise("white")
    assert (np.diff(ratio[1:]) < 0).all()
    with pytest.raises(ValueError, match="brown"):
        band_noise("brown")


def test_the_same_sound_is_heard_either_way_half_of_the_time() -> None:
    assert ConfusionCurve().rate(0.0) == 0.5


@given(st.floats(0.0, 200.0), st.floats(0.01, 50.0))
def test_the_farther_the_rarer(distance: float, more: float) -> None:
    curve = ConfusionCurve()
    assert 0.0 <= curve.rate(distance + more) <= curve.rate(distance) <= 0.5
