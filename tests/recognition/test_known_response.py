"""The response from a voice, learned from sentence to sentence."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.ports import Samples
from hvcpd.recognition.channel.estimation import PRE_TAPS, TAPS, Taps, WhitenedSound
from hvcpd.recognition.channel.known import KnownResponse
from hvcpd.recognition.channel.recogniser import MOST_LOSS, ChannelRecogniser
from hvcpd.recognition.channel.search import ChannelSegment, SearchResult
from tests.recognition.hisses import BOOKS, GRAPH, fresh, scene, spoken, through_a_room
from tests.recognition.way import Way

AT = 24_000
LOUD = 7.0
"""Noise 17 dB louder than the voice."""


def signal(random: np.random.Generator, n: int = 6000) -> Samples:
    return np.asarray(random.standard_normal(n), np.float32)


def room(random: np.random.Generator) -> Taps:
    taps = random.standard_normal(TAPS) * np.exp(-np.arange(TAPS) / 60.0)
    return np.asarray(taps / np.linalg.norm(taps), np.float32)


def equations(said: Samples, heard: Samples) -> tuple[Taps, Taps]:
    """The normal equations of a response whose first tap is at the signal's place."""
    own = np.correlate(said, said, "full")[len(said) - 1 :][:TAPS]
    across = np.correlate(heard, said, "full")[len(said) - 1 :][:TAPS]
    return own.astype(np.float32), across.astype(np.float32)


def shown(random: np.random.Generator, taps: Taps, gain: float = 1.0) -> KnownResponse:
    """What one sentence at that level shows of a response, in noise of variance 1."""
    said = signal(random)
    heard = gain * np.convolve(said, taps)
    return KnownResponse(*equations(said, heard + random.standard_normal(len(heard))))


@settings(max_examples=20)
@given(gain=st.floats(0.2, 20.0), seed=st.integers(0, 2**16))
def test_what_came_through_it_has_its_gain_and_its_energy(gain: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    taps, said = room(random), signal(random)
    known = KnownResponse(*equations(said, np.convolve(said, taps)))
    other = signal(random)
    clean = gain * np.convolve(other, taps)
    own, across = equations(other, clean)
    [found], [explained] = known.gains(own[None], across[None])
    assert np.linalg.norm(known.taps) == pytest.approx(1.0, abs=1e-3)
    assert found == pytest.approx(gain, rel=0.02)
    assert explained == pytest.approx(float(np.sum(clean**2)) - 1.0, rel=0.02)


def test_noise_explains_nothing_on_average_and_never_much() -> None:
    random = np.random.default_rng(5)
    known = shown(random, room(random), 10.0)
    own, across = zip(*(equations(signal(random), signal(random, 7000)) for _ in range(200)), strict=True)
    _, explained = known.gains(np.stack(own), np.stack(across))
    # A gain below 0 counts as none, so that half of them are -1, and the others' mean is 0.
    assert float(np.mean(explained)) == pytest.approx(-0.5, abs=0.25)
    assert float(np.max(explained)) < 15.0


def test_every_sentence_makes_it_surer() -> None:
    random = np.random.default_rng(6)
    taps = room(random)
    known = shown(random, taps, 0.3)
    alike = [float(known.taps @ taps)]
    for _ in range(3):
        known = known.updated(shown(random, taps, 0.3))
        alike.append(float(known.taps @ taps))
    assert alike == sorted(alike)
    assert alike[0] < 0.75
    assert alike[-1] > 0.85


def test_a_signal_is_found_at_its_place_through_its_response() -> None:
    random = np.random.default_rng(8)
    taps = room(random)
    for place in (5000, 5003, 9001):
        said = Way(0.1 * signal(random, 4000))
        heard = 0.02 * signal(random, 24_000)
        heard[place - PRE_TAPS :][: 4000 + TAPS - 1] += np.convolve(said.samples, taps).astype(np.float32)
        found = WhitenedSound(heard, heard[:4000]).correlation(said, 4000, 8000, taps)
        assert int(found.argmax()) == place - 4000


def heard_by(
    listener: ChannelRecogniser, text: str, room_seed: int, noise: float, seed: int, voice: str = "oak"
) -> SearchResult:
    """The sentences in a segment of sound, through a room."""
    sound = through_a_room(spoken(text, voice), room_seed)
    return listener.search(ChannelSegment(scene(AT + len(sound) + 12_000, (AT, sound), noise=noise, seed=seed), 0, AT))


def words(found: SearchResult) -> list[str]:
    return [" ".join(each.words) for each in found.sentences]


@pytest.mark.parametrize("seed", range(4))
def test_who_was_heard_before_is_heard_in_more_noise(seed: int) -> None:
    listener = fresh()
    assert words(heard_by(listener, "hi bot, water rose", 7, LOUD, seed)) == []
    assert words(heard_by(listener, "all, who is here", 7, 0.3, seed)) == ["all who is here"]
    assert words(heard_by(listener, "hi bot, water rose", 7, LOUD, seed)) == ["hi bot water rose"]


def test_a_robot_that_has_moved_is_heard_as_if_for_the_first_time_and_known_again() -> None:
    listener = fresh()
    assert words(heard_by(listener, "all, who is here", 7, 0.3, 1)) == ["all who is here"]
    assert words(heard_by(listener, "hi bot, water rose", 8, 1.0, 2)) == ["hi bot water rose"]
    assert words(heard_by(listener, "hi bot, water rose", 8, LOUD, 3)) == ["hi bot water rose"]


def test_noise_alone_is_no_sentence_of_a_known_robot() -> None:
    listener = fresh()
    assert words(heard_by(listener, "all, who is here", 7, 0.3, 1)) == ["all who is here"]
    for seed in range(3):
        result = listener.search(ChannelSegment(scene(80_000, noise=LOUD, seed=20 + seed), 0, AT))
        assert (result.sentences, result.robot) == ((), False)


def test_what_came_through_a_known_response_is_not_checked_by_its_phones() -> None:
    losses = [0.0]
    listener = ChannelRecogniser(GRAPH, tuple(BOOKS.values()), check=lambda words, sound, noise: losses[-1])
    assert words(heard_by(listener, "all, who is here", 7, 0.3, 1)) == ["all who is here"]
    losses.append(2.0 * MOST_LOSS)
    assert words(heard_by(listener, "hi bot, water rose", 7, 0.3, 2)) == ["hi bot water rose"]
    assert words(heard_by(listener, "hi bot, water rose", 7, 0.3, 2, "willow")) == []


@pytest.mark.parametrize("louder_db", [6.0, 12.0])
def test_a_known_voice_is_heard_under_a_louder_one(louder_db: float) -> None:
    listener = fresh()
    assert words(heard_by(listener, "all, who is here", 7, 0.1, 1)) == ["all who is here"]
    known, louder = through_a_room(spoken("hi bot, water rose"), 7), through_a_room(spoken("who is here", "willow"), 9)
    gain = np.float32(10.0 ** (louder_db / 20.0))
    both = scene(AT + 60_000, (AT, known), (AT + 1500, gain * louder), noise=0.1)
    assert set(words(listener.search(ChannelSegment(both, 0, AT)))) == {"hi bot water rose", "who is here"}
