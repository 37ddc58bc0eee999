"""The noise tracker with noises that change."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.fit import measured
from hvcpd.recognition.frontend import HOP_SAMPLES, energies_of
from hvcpd.recognition.noise import STEADY_MEAN_LOG, STEADY_RATIO, STEADY_STD_LOG, NoiseTracker
from tests.recognition.signals import sentence

RATE = 16_000


def tone(hz: float, seconds: float) -> NDArray[np.float64]:
    """Of a motor: a few harmonics, with some hiss."""
    t = np.arange(round(seconds * RATE)) / RATE
    hiss = 0.01 * np.random.default_rng(round(hz)).standard_normal(len(t))
    return np.asarray(sum(np.sin(2 * np.pi * k * hz * t) / np.sqrt(k) for k in (1, 3, 6)) * 0.03 + hiss)


def tracked(sound: NDArray[np.float64]) -> NDArray[np.float32]:
    tracker = NoiseTracker()
    energies = energies_of(np.asarray(sound, np.float32))
    for at in range(0, len(energies) - 3, 4):
        tracker.push(energies[at : at + 4])
        tracker.follow_step()
    return tracker.estimate


def off_db(estimate: NDArray[np.float32], sound: NDArray[np.float64]) -> NDArray[np.float64]:
    """By how much each band of the estimate is wrong."""
    return np.asarray(10.0 * np.log10(estimate / energies_of(np.asarray(sound, np.float32)).mean(axis=0)))


@pytest.mark.parametrize(("before_hz", "after_hz"), [(150.0, 260.0), (260.0, 190.0)])
def test_a_motor_that_changes_its_speed_is_followed_in_half_a_second(before_hz: float, after_hz: float) -> None:
    after = tone(after_hz, 0.5)
    estimate = tracked(np.concatenate([tone(before_hz, 4.0), after]))
    assert np.abs(off_db(estimate, after[RATE // 8 :])).mean() < 1.5


def test_a_noise_that_falls_in_some_bands_is_followed_in_half_a_second() -> None:
    white = 0.01 * np.random.default_rng(3).standard_normal(5 * RATE)
    muffled = np.convolve(white, np.ones(8) / 8.0, "same")
    quiet = muffled[round(4.5 * RATE) :]
    estimate = tracked(np.concatenate([white[: 4 * RATE], quiet]))
    assert off_db(estimate, quiet[RATE // 8 :]).max() < 4.0


def test_a_voice_is_no_noise() -> None:
    said = np.concatenate([sentence("hi rob, water green"), sentence("hi bot, water rose")]) * 0.5
    noise = 0.01 * np.random.default_rng(4).standard_normal(2 * RATE + len(said))
    sound = noise.copy()
    sound[2 * RATE :] += said
    assert np.abs(off_db(tracked(sound), noise)).mean() < 1.5


def test_steady_noise_spreads_as_the_front_end_has_it() -> None:
    found = measured(energies_of(np.random.default_rng(1).standard_normal(4000 * HOP_SAMPLES).astype(np.float32)))
    for values, fitted in zip(found.values(), (STEADY_RATIO, STEADY_MEAN_LOG, STEADY_STD_LOG), strict=True):
        assert fitted == pytest.approx(values, rel=1e-4)
