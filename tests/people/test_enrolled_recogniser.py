"""The nearest sentence to a whole segment of sound: the least of all costs, and all of the sound explained."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.language.graph import Arc, WordGraph
from hvcpd.people.enrolled import BLOCK_FRAMES, TAKE_STEPS, EnrolledRecogniser, Person
from hvcpd.recognition.decoder import Decoder
from hvcpd.recognition.events import Recognised, Source
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, Energies
from hvcpd.recognition.network import Beam, Network
from hvcpd.recognition.templates import TemplateBank

GRAPH = WordGraph(
    4,
    (Arc(0, 1, "hi"), Arc(1, 2, "rob"), Arc(1, 2, "bot"), Arc(2, 3, "stop"), Arc(0, 3, "stop")),
    0,
    frozenset((3,)),
    frozenset(),
)
SENTENCES = (("hi", "rob", "stop"), ("hi", "bot", "stop"), ("stop",))
NOISE = np.full(N_BANDS, 1e-4, np.float32)


def take(seed: int, frames: int) -> Energies:
    """A sound that changes slowly between three random spectra, as a word's does."""
    rng = np.random.default_rng(seed)
    spectra = rng.normal(0.0, 1.5, (3, N_BANDS))
    at = np.linspace(0.0, 2.0, frames)
    logs = np.stack([np.interp(at, range(3), spectra[:, band]) for band in range(N_BANDS)], axis=1)
    out = np.exp(logs).astype(np.float32)
    return np.asarray(out / out.sum(axis=1).mean(), np.float32)


LENGTHS = {"hi": 18, "rob": 24, "bot": 24, "stop": 30}
WORDS = {word: take(seed, frames) for seed, (word, frames) in enumerate(LENGTHS.items())}


def segment(*words: str, pace: float = 1.0, gain: float = 1.0, seed: int = 1) -> Energies:
    """The words one after the other, at so many times their length, with noise alone around them."""
    parts = [np.zeros((25, N_BANDS))]
    for word in words:
        source = WORDS.get(word, take(hash_of(word), 25))
        parts.append(source[np.linspace(0, len(source) - 1, round(len(source) * pace)).astype(int)])
    parts.append(np.zeros((25, N_BANDS)))
    clean = gain * np.concatenate(parts)
    noise = NOISE * np.random.default_rng(seed).gamma(30.0, 1 / 30.0, clean.shape)
    return np.asarray(clean + noise, np.float32)


def hash_of(word: str) -> int:
    return sum(map(ord, word))


def words_of(match: Recognised | None) -> tuple[str, ...]:
    assert match is not None
    return match.words


ANNA = Person("Anna", {word: [one] for word, one in WORDS.items()})


def nearest(sound: Energies, *people: Person) -> Recognised | None:
    return EnrolledRecogniser(GRAPH, people or (ANNA,)).match(sound, NOISE)


def test_words_that_make_no_sentence_are_none() -> None:
    """The decoder took a path that ended nowhere for one, at an infinite cost."""
    knows_two = Person("Anna", {word: [WORDS[word]] for word in ("hi", "rob")})
    assert nearest(segment("hi", "rob"), knows_two) is None


@pytest.mark.parametrize("words", SENTENCES)
@pytest.mark.parametrize(("pace", "gain"), [(1.0, 1.0), (0.6, 0.05), (1.6, 30.0)])
def test_a_sentence_is_found_at_any_pace_and_loudness(words: tuple[str, ...], pace: float, gain: float) -> None:
    match = nearest(segment(*words, pace=pace, gain=gain))
    assert words_of(match) == words
    assert match is not None
    assert (match.voice, match.source) == ("anna, enrolled", Source.PEOPLE)
    assert abs(match.start_sample - 25 * HOP_SAMPLES) <= 6 * HOP_SAMPLES
    assert all(a.end_sample <= b.start_sample for a, b in pairwise(match.spans))


def test_words_of_another_sentence_cannot_be_passed_over_for_nothing() -> None:
    right = nearest(segment("hi", "rob", "stop"))
    wrong = nearest(segment("water", "the", "rose", "stop"))
    assert right is not None
    assert wrong is not None
    assert wrong.confidence < 0.9 < 0.99 < right.confidence


def test_too_little_sound_for_any_sentence_is_none() -> None:
    assert nearest(segment("stop")[:3]) is None


def test_a_sentence_is_one_persons_who_has_all_of_its_words() -> None:
    anna = Person("Anna", {word: [WORDS[word]] for word in ("hi", "rob", "stop")})
    bert = Person("Bert", {"bot": [WORDS["bot"]]})
    match = nearest(segment("hi", "bot", "stop"), anna, bert)
    assert words_of(match) != ("hi", "bot", "stop")
    assert match is not None
    assert match.voice == "anna, enrolled"


def test_without_takes_nothing_can_be_known() -> None:
    with pytest.raises(ValueError, match="no templates"):
        EnrolledRecogniser(GRAPH, [Person("Anna")])


def brute_force(distances: np.ndarray, to_noise: np.ndarray, templates: Sequence[range]) -> float:
    """The least cost of saying the templates in order, with noise before, between and after, cell by cell."""
    n = len(distances)
    rest = np.concatenate([[0.0], np.cumsum(to_noise)])
    for rows in templates:
        ends = np.full(n + 1, math.inf)
        cost = np.full((n + 1, len(rows)), math.inf)
        for t in range(1, n + 1):
            for k, row in enumerate(rows):
                ways = [cost[t - 1, k] + TAKE_STEPS.stay]
                for reach, extra in ((1, 0.0), (2, TAKE_STEPS.skip), (3, TAKE_STEPS.leap or 0.0)):
                    if k >= reach:
                        ways.append(cost[t - 1, k - reach] + extra)
                    elif k == reach - 1:
                        ways.append(rest[t - 1] + extra)
                cost[t, k] = min(ways) + distances[t - 1, row]
            ends[t] = cost[t, -1]
        rest = np.full(n + 1, math.inf)
        for t in range(1, n + 1):
            rest[t] = min(rest[t - 1] + to_noise[t - 1], ends[t])
    return float(rest[-1])


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), lengths=st.lists(st.integers(5, 9), min_size=2, max_size=2), n=st.integers(12, 30))
def test_costs_are_the_least_of_all_paths(seed: int, lengths: list[int], n: int) -> None:
    graph = WordGraph(3, (Arc(0, 1, "hi"), Arc(1, 2, "rob")), 0, frozenset((2,)), frozenset())
    bank = TemplateBank({"anna": {"hi": [take(1, lengths[0])], "rob": [take(2, lengths[1])]}})
    net = Network(graph, bank.templates, partial=True)
    rng = np.random.default_rng(seed)
    distances = rng.gamma(2.0, 1.0, (n, sum(lengths))).astype(np.float32)
    to_noise = rng.gamma(2.0, 1.0, n).astype(np.float32)
    decoder = Decoder(net, 1, Beam(width=1e6, above_filler=1e6), TAKE_STEPS)
    for begin in range(0, n, BLOCK_FRAMES):
        rows = decoder.prune().row
        for frame in range(begin, min(begin + BLOCK_FRAMES, n)):
            decoder.advance(distances[frame, rows] - to_noise[frame], 0.0)
    best = decoder.best(math.inf)
    templates = [range(t.first, t.first + t.length) for t in bank.templates]
    assert best.cost + to_noise.sum() == pytest.approx(brute_force(distances, to_noise, templates), rel=1e-4)
    assert sum(step.cost for step in decoder.trace(best.token)) == pytest.approx(best.cost, rel=1e-3, abs=1e-3)
