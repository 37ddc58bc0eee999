"""Weights that count what is louder than the noise for little, cell by cell."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.recogniser import ChannelRecogniser
from hvcpd.recognition.channel.search import ChannelSegment
from hvcpd.recognition.channel.whitening import (
    BINS,
    CELL_STEP,
    CELLS,
    cell_weights,
    inverse_spectrum,
    with_cell_weights,
)
from tests.recognition.hisses import BOOKS, GRAPH, scene, spoken, through_a_room

AT = 40_000
TONE_HZ = 3000.0


def noise(n: int, seed: int = 0) -> Samples:
    return np.random.default_rng(seed).standard_normal(n).astype(np.float32)


def weights(heard: Samples, alone: Samples) -> np.ndarray:
    return cell_weights(heard, alone, inverse_spectrum(alone, alone))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 5000), st.integers(0, 2**31))
def test_with_weights_of_one_a_sound_is_as_it_was(n: int, seed: int) -> None:
    sound = noise(n, seed)
    ones = np.ones_like(weights(sound, noise(2000)))
    assert with_cell_weights(sound, ones) == pytest.approx(sound, abs=1e-4)


def test_a_loud_tone_takes_its_own_cells_away_and_leaves_the_others() -> None:
    heard, alone = noise(16_000), noise(8000, 1)
    during = slice(6000, 12_000)
    tone = np.zeros(16_000, np.float32)
    tone[during] = 20.0 * np.sin(2 * np.pi * TONE_HZ / SAMPLE_RATE_HZ * np.arange(6000))
    before, after = weights(heard, alone), weights(heard + tone, alone)
    inside = slice(6000 // CELL_STEP + 4, 12_000 // CELL_STEP - 4)
    cell = round(TONE_HZ / (SAMPLE_RATE_HZ / 2) * (CELLS - 1))
    assert (after[inside, cell] < 0.3 * before[inside, cell]).all()
    far = np.abs(np.arange(CELLS) - cell) > 6
    assert (after[inside][:, far] > before[inside][:, far] - 0.1).all()
    assert (after[: inside.start - 8] > before[: inside.start - 8] - 1e-3).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_sentence_is_found_among_plates_that_are_put_down(seed: int) -> None:
    """Tones that ring on, one every 50 ms, thirty times as loud as the voice: most of the spectrum is as it was."""
    voice = through_a_room(spoken("hi rob, water rose"), 1)
    sound = scene(AT + len(voice) + SAMPLE_RATE_HZ, (AT, voice))
    loud = 30.0 * float(np.sqrt(np.mean(np.square(voice))))
    rng, time = np.random.default_rng(seed), np.arange(2400)
    for begin in range(AT, AT + len(voice), 800):
        hz = rng.choice([1700.0, 3100.0, 5200.0])
        ring = loud * np.exp(-time / 800.0) * np.sin(2 * np.pi * hz / SAMPLE_RATE_HZ * time)
        sound[begin : begin + 2400] += ring[: len(sound) - begin].astype(np.float32)
    found = ChannelRecogniser(GRAPH, (BOOKS["oak"],)).search(ChannelSegment(sound, 0, AT))
    assert [" ".join(each.words) for each in found.sentences] == ["hi rob water rose"]


def cut_off(sound: Samples, hz: float = 3800.0) -> Samples:
    """As a narrow microphone gives it."""
    spectrum = np.fft.rfft(sound)
    spectrum[np.fft.rfftfreq(len(sound), 1.0 / SAMPLE_RATE_HZ) > hz] = 0.0
    return np.asarray(np.fft.irfft(spectrum, len(sound)), np.float32)


def test_what_a_narrow_microphone_does_not_give_counts_nothing() -> None:
    heard, alone = cut_off(noise(32_000)), cut_off(noise(16_000, 1))
    weighted = inverse_spectrum(heard, alone)
    hz = np.linspace(0.0, SAMPLE_RATE_HZ / 2, BINS)
    assert (weighted[hz > 4000.0] == 0.0).all()
    assert (weighted[(hz > 150.0) & (hz < 3700.0)] > 0.0).all()


@pytest.mark.parametrize("loud", ["offset", "hum"])
def test_neither_an_offset_nor_a_hum_empties_the_other_bands(loud: str) -> None:
    """Both 60 dB louder than the noise."""
    time = np.arange(32_000) / SAMPLE_RATE_HZ
    more = 1000.0 * (np.ones(32_000) if loud == "offset" else np.sin(2 * np.pi * 150.0 * time))
    heard, alone = noise(32_000) + more.astype(np.float32), noise(16_000, 1) + more[:16_000].astype(np.float32)
    hz = np.linspace(0.0, SAMPLE_RATE_HZ / 2, BINS)
    assert (inverse_spectrum(heard, alone)[(hz > 400.0) & (hz < 7500.0)] > 0.0).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_sentence_is_found_through_a_narrow_microphone(seed: int) -> None:
    voice = through_a_room(spoken("hi rob, water rose"), 1)
    sound = cut_off(scene(AT + len(voice) + SAMPLE_RATE_HZ, (AT, voice), seed=seed))
    found = ChannelRecogniser(GRAPH, (BOOKS["oak"],)).search(ChannelSegment(sound, 0, AT))
    assert [" ".join(each.words) for each in found.sentences] == ["hi rob water rose"]
