"""The response between a known signal and what was heard of it, and sound over its noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve, toeplitz

from hvcpd.ports import Samples
from hvcpd.recognition.channel.estimation import (
    LEAST_RIDGE,
    MAX_SHIFT,
    MOST_RIDGE,
    PRE_TAPS,
    TAPS,
    Taps,
    WhitenedSound,
    autocorrelations,
)
from hvcpd.recognition.channel.whitening import transform_size
from tests.recognition.way import Way, response


def correlations(known: Samples, heard: Samples, n: int) -> tuple[Taps, Taps]:
    """Of a signal with itself and with what was heard, at lags from 0."""
    middle = len(known) - 1
    own = np.correlate(known, known, "full")[middle : middle + n]
    across = np.correlate(heard, known, "full")[middle : middle + n]
    return own.astype(np.float32), across.astype(np.float32)


def decaying(random: np.random.Generator, n: int, decay: float) -> Samples:
    return np.asarray(random.standard_normal(n) * np.exp(-np.arange(n) / decay), np.float32)


@settings(max_examples=40)
@given(
    n=st.integers(1, 512),
    decay=st.floats(2.0, 300.0),
    colour=st.floats(-0.8, 0.8),
    gain=st.floats(0.01, 10.0),
    seed=st.integers(0, 2**16),
)
def test_the_taps_are_those_of_a_dense_solution(n: int, decay: float, colour: float, gain: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    known = np.convolve(random.standard_normal(2000), [1.0, colour]).astype(np.float32)
    heard = gain * np.convolve(known, decaying(random, n, decay)) + random.standard_normal(len(known) + n - 1)
    own, across = correlations(known, heard.astype(np.float32), n)
    taps = response(own, across, n)
    energy, explained = float(own[0]), max(float(across @ across) / float(own[0]), 1.0)
    matrix = toeplitz(own.astype(np.float64)) + energy * np.clip(n / explained, LEAST_RIDGE, MOST_RIDGE) * np.eye(n)
    dense = solve(matrix, across.astype(np.float64))
    assert taps.shape == (n,)
    assert taps.dtype == np.float32
    assert np.linalg.norm(matrix @ taps - across) <= 3e-3 * np.linalg.norm(across)
    assert np.linalg.norm(taps - dense) <= 0.05 * np.linalg.norm(dense)
    # What is explained is what paths are compared by.
    assert float(taps @ across) == pytest.approx(float(dense @ across), rel=2e-3)


@pytest.mark.parametrize("n", [64, 256, 512])
def test_known_taps_are_recovered(n: int) -> None:
    random = np.random.default_rng(n)
    known = random.standard_normal(16_000).astype(np.float32)
    there = decaying(random, n, n / 5)
    heard = np.convolve(known, there) + random.standard_normal(16_000 + n - 1)
    taps = response(*correlations(known, heard.astype(np.float32), n), n)
    assert np.linalg.norm(taps - there) <= 0.2 * np.linalg.norm(there)


def test_where_the_signal_has_nothing_the_response_does_not_grow() -> None:
    random = np.random.default_rng(3)
    spectrum = np.fft.rfft(random.standard_normal(16_000))
    spectrum[4000:] = 0.0  # above 4 kHz
    known = np.fft.irfft(spectrum).astype(np.float32)
    there = decaying(random, 128, 20.0)
    heard = np.convolve(known, there) + random.standard_normal(16_127)
    found = np.fft.rfft(response(*correlations(known, heard.astype(np.float32), 128), 128), 512)
    below = np.fft.rfft(there, 512)[:110]
    assert np.linalg.norm(found[:110] - below) < 0.1 * np.linalg.norm(below)
    assert np.abs(found[160:]).max() < np.abs(np.fft.rfft(there, 512)).max()


@pytest.mark.parametrize("n", [1, 64, 512])
def test_of_nothing_comes_nothing(n: int) -> None:
    silent = np.zeros(n, np.float32)
    assert not response(silent, silent, n).any()
    some = np.ones(1, np.float32)
    assert np.isfinite(response(np.pad(some, (0, n - 1)), silent, n)).all()


@given(st.integers(1, 10**6))
def test_a_transform_is_large_enough_and_quick(n: int) -> None:
    size = transform_size(n)
    assert n <= size <= max(1.34 * n, 5)
    while size % 2 == 0:
        size //= 2
    assert size in (1, 3, 5)


WORD = Way(0.1 * np.random.default_rng(5).standard_normal(6000).astype(np.float32))
AT = 9000


def noise(n: int, seed: int) -> Samples:
    return 0.1 * np.random.default_rng(seed).standard_normal(n).astype(np.float32)


def explained(sound: WhitenedSound, at: int, n: int = 64) -> float:
    """What the word explains there beyond what as many taps do by chance, without the taps before its place."""
    [fit] = sound.fits([(WORD, at)])
    there = fit.correlation[MAX_SHIFT + PRE_TAPS : MAX_SHIFT + PRE_TAPS + n]
    return float(response(autocorrelations([fit])[0], there, n) @ there) - n


def with_word(seed: int) -> Samples:
    heard = noise(24_000, seed)
    heard[AT : AT + WORD.length] += WORD.samples
    return heard


@settings(max_examples=10)
@given(level=st.floats(1e-3, 5.0), seed=st.integers(0, 1000))
def test_the_level_of_the_sound_changes_nothing(level: float, seed: int) -> None:
    heard, before = with_word(seed), noise(8000, seed + 1)
    sound = WhitenedSound(heard, before)
    scaled = WhitenedSound(np.float32(level) * heard, np.float32(level) * before)
    assert scaled.energy(2000, 20_000) == pytest.approx(sound.energy(2000, 20_000), rel=1e-3)
    assert explained(scaled, AT) == pytest.approx(explained(sound, AT), rel=0.01)
    found, found_scaled = (each.correlation(WORD, AT - 500, 1000) for each in (sound, scaled))
    assert np.allclose(found_scaled, found, atol=0.02 * float(np.abs(found).max()))


def test_noise_has_variance_1_whatever_its_colour() -> None:
    coloured = np.convolve(noise(40_000, 2), [1.0, 0.9, 0.5], "same").astype(np.float32)
    sound = WhitenedSound(coloured[:24_000], coloured[24_000:])
    assert sound.energy(0, 24_000) == pytest.approx(24_000, rel=0.01)
    assert sound.energy(6000, 12_000) == pytest.approx(6000, rel=0.2)
    assert sound.energy(-500, 10**6) == sound.energy(0, 24_000)


@pytest.mark.parametrize("seed", range(3))
def test_a_signal_is_found_where_it_is_and_explains_energy(seed: int) -> None:
    sound = WhitenedSound(with_word(seed), noise(8000, seed + 50))
    found = sound.correlation(WORD, AT - 2000, 4000)
    assert int(np.abs(found).argmax()) == 2000
    assert float(found[2000]) ** 2 > 1000.0
    assert explained(sound, AT) > 1000.0
    assert explained(sound, AT + 5) < 0.1 * explained(sound, AT)  # no tap is early enough


def test_noise_explains_about_as_much_as_chance() -> None:
    sound = WhitenedSound(noise(160_000, 7), noise(8000, 8))
    by_chance = [explained(sound, 1000 + 4500 * k) for k in range(32)]
    # 64 taps explain 64 variances, with a standard deviation of 11, and less by what the ridge takes.
    assert -40.0 < float(np.mean(by_chance)) < 10.0
    assert max(by_chance) < 50.0


@pytest.mark.parametrize("at", [-5000, -100, 0, 20_000, 23_999, 40_000])
def test_a_signal_may_begin_before_the_sound_and_end_after_it(at: int) -> None:
    [fit] = WhitenedSound(with_word(1), noise(8000, 2)).fits([(WORD, at)])
    assert fit.correlation.shape == (TAPS + 2 * MAX_SHIFT,)
    assert autocorrelations([fit]).shape == (1, TAPS)
    assert np.isfinite(fit.correlation).all()
