"""What the net of phones is given: mel bands without the noise, and with what a narrow microphone lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from hvcpd.assembly.sound import Sound, make_sound
from hvcpd.people.bands import (
    LEAST,
    N_BANDS,
    SPECTRAL_FLOOR,
    estimated_noise,
    log_bands,
    mel_bands,
    noise_subtracted,
)
from hvcpd.people.phones import mean_normalised
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.voices import VOICES

NOBODY = np.zeros(N_BANDS)


@pytest.fixture(scope="module")
def sound(units: Path) -> Sound:
    return make_sound(None, units)


@pytest.fixture(scope="module")
def sentence(sound: Sound) -> Samples:
    """With half a second of a quiet room around it."""
    speech = np.pad(sound.speaker_in(VOICES[0]).render([["bot", "six", "is", "left"]]), 8000)
    return np.asarray(0.3 * speech + noise(len(speech), 1e-4), np.float32)


def noise(n: int, rms: float) -> NDArray[np.float64]:
    return rms * np.random.default_rng(7).standard_normal(n)


def distance(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    return float(np.sqrt(np.mean((one - other) ** 2)))


def centred_logs(sound: Samples, noise: NDArray[np.float64]) -> NDArray[np.float32]:
    return mean_normalised(log_bands(sound, noise))


def test_shapes(sentence: Samples) -> None:
    assert log_bands(sentence, NOBODY).shape == (1 + (len(sentence) - 410) // 160, N_BANDS)
    assert log_bands(sentence[:300], NOBODY).shape == (0, N_BANDS)


def test_the_level_does_not_count(sentence: Samples) -> None:
    assert distance(centred_logs(sentence, NOBODY), centred_logs(np.float32(0.1) * sentence, NOBODY)) < 0.05


def test_known_noise_is_taken_away(sentence: Samples) -> None:
    noisy = np.asarray(sentence + noise(len(sentence), 0.01), np.float32)
    known = mel_bands(np.asarray(noise(3 * SAMPLE_RATE_HZ, 0.01), np.float32)).mean(axis=0)
    loudness, ours = (np.ptp(centred_logs(noisy, each).mean(axis=1)) for each in (NOBODY, known))
    assert ours > 1.3 * loudness


def test_no_band_falls_further_than_it_may() -> None:
    bands = np.full((20, N_BANDS), 5.0)
    assert np.allclose(noise_subtracted(bands, np.full(N_BANDS, 5.0)), 5.0 * SPECTRAL_FLOOR)
    assert np.allclose(noise_subtracted(bands, NOBODY), 5.0)
    assert np.isfinite(np.log(noise_subtracted(0.0 * bands, NOBODY) + LEAST)).all()


@pytest.mark.parametrize("spoken", [7000, 20000])
def test_the_noise_is_what_was_heard_before_without_who_spoke_before(spoken: int) -> None:
    before = noise(3 * SAMPLE_RATE_HZ, 0.01)
    wanted = mel_bands(np.asarray(before, np.float32)).mean(axis=0)
    before[5000 : 5000 + spoken] += 0.3 * np.sin(0.3 * np.arange(spoken))
    both = np.concatenate([before, noise(8000, 0.3)]).astype(np.float32)
    found = estimated_noise(both, len(before))
    assert np.abs(np.log(found / wanted)).max() < 0.5
    assert np.isfinite(estimated_noise(both[:500], 0)).all()
