"""Where robots' sentences may begin, in noise that hides them and through rooms."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.recognition.channel.endpoints import ONSET_STEP, ONSET_WINDOW, Onset, OnsetDetector
from tests.recognition.hisses import BOOKS, GRAPH, scene, spoken, through_a_room

DETECTOR = OnsetDetector(GRAPH, (BOOKS["oak"],))
RNG = np.random.default_rng(5)
NOISE = RNG.standard_normal(16_000).astype(np.float32)


def over_noise(sound: np.ndarray, snr_db: float) -> np.ndarray:
    """SIZE samples of a sound with noise of deviation 1; the ratio is to the sound's mean power."""
    gain = 10.0 ** (snr_db / 20.0) / np.sqrt(np.mean(sound[sound != 0.0] ** 2))
    noise = np.random.default_rng(6).standard_normal(ONSET_WINDOW)
    return np.asarray(gain * sound[:ONSET_WINDOW] + noise, np.float32)


@pytest.mark.parametrize("snr_db", [20.0, 5.0, 0.0])
@pytest.mark.parametrize("at", [500, 3000, 7500])
@pytest.mark.parametrize("in_a_room", [False, True])
def test_a_greeting_is_found_at_its_place(snr_db: float, at: int, in_a_room: bool) -> None:
    said = spoken("hi rob, water rose")
    heard = through_a_room(said, 1) if in_a_room else said
    found = DETECTOR.find(over_noise(scene(ONSET_WINDOW, (at, heard[: ONSET_WINDOW - at])), snr_db), NOISE)
    assert found is not None
    assert found.greeting
    assert abs(found.at - at) <= 160


def test_noise_alone_is_no_beginning() -> None:
    for seed in range(40):
        noise = np.random.default_rng(100 + seed).standard_normal(ONSET_WINDOW).astype(np.float32)
        assert DETECTOR.find(noise, NOISE) is None


def test_what_begins_in_the_next_step_is_left_to_it() -> None:
    said = spoken("hi rob, water rose")
    found = DETECTOR.find(
        over_noise(scene(ONSET_WINDOW, (ONSET_STEP + 500, said[: ONSET_WINDOW - ONSET_STEP - 500])), 0.0), NOISE
    )
    assert found is None or not found.greeting


def test_without_words_nothing_is_found() -> None:
    assert OnsetDetector(GRAPH, ()).find(NOISE[:ONSET_WINDOW], NOISE) is None
    assert Onset(3, True) == Onset(3, True)


def test_silence_is_no_beginning() -> None:
    assert DETECTOR.find(np.zeros(ONSET_WINDOW, np.float32), np.zeros(16_000, np.float32)) is None
