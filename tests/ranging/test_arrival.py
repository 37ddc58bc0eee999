"""When a known sound arrived: between samples, by a clock that differs, before its echoes, in noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from hvcpd.ports import Samples
from hvcpd.ranging.arrival import REACH, arrival
from hvcpd.ranging.distance import is_sure

LENGTH = 40_000
FINE = 8
"""Steps to a sample in which the test moves sounds."""


def voice() -> Samples:
    """Bursts of noise, as words are, without the highest frequencies."""
    rng = np.random.default_rng(5)
    spectrum = np.fft.rfft(rng.standard_normal(LENGTH))
    spectrum *= 1.0 / (1.0 + (np.fft.rfftfreq(LENGTH, 1 / 16_000) / 2500.0) ** 4)
    bursts = 0.3 + np.abs(np.sin(np.arange(LENGTH) / 1500.0))
    return np.asarray(0.1 * bursts * np.fft.irfft(spectrum, LENGTH), np.float32)


VOICE = voice()
_FINE_VOICE = np.fft.irfft(np.fft.rfft(np.pad(VOICE, (0, 4096))), FINE * (LENGTH + 4096)) * FINE


def at(start: float, skew: float = 0.0) -> NDArray[np.float64]:
    """The voice as it is heard from sample `start` on, by a clock that runs 1 + `skew` times as fast."""
    times = (np.arange(LENGTH + 2 * REACH) - start) / (1.0 + skew) * FINE
    return np.interp(times, np.arange(len(_FINE_VOICE)), _FINE_VOICE, left=0.0, right=0.0)


@settings(max_examples=25, deadline=None)
@given(st.floats(REACH - 500.0, REACH + 500.0), st.floats(-2e-4, 2e-4))
def test_it_is_known_between_samples_and_so_is_the_clock(start: float, skew: float) -> None:
    found = arrival(at(start, skew).astype(np.float32), VOICE, REACH)
    assert found is not None
    assert found.at == pytest.approx(start, abs=0.15)
    assert found.stretch == pytest.approx(skew, abs=3e-6)


@pytest.mark.parametrize("speed_m_s", [-0.2, 0.2])
def test_a_robot_that_drives_is_not_sure(speed_m_s: float) -> None:
    found = arrival(at(REACH + 5.0, speed_m_s / 343.0).astype(np.float32), VOICE, REACH)
    assert found is not None
    assert found.stretch == pytest.approx(speed_m_s / 343.0, abs=1e-5)
    assert not is_sure(found)


@pytest.mark.parametrize("later", [12.0, 60.0, 300.0])
def test_a_louder_echo_is_not_taken_for_it(later: float) -> None:
    start = REACH + 20.4
    heard = at(start) + 1.4 * at(start + later)
    found = arrival(heard.astype(np.float32), VOICE, REACH)
    assert found is not None
    assert found.at == pytest.approx(start, abs=0.4)
    assert found.first < 0.9


def test_noise_as_loud_as_the_voice_moves_it_by_a_fraction_of_a_sample() -> None:
    rng, errors = np.random.default_rng(3), []
    for _ in range(5):
        noise = rng.standard_normal(LENGTH + 2 * REACH) * np.std(VOICE)
        found = arrival((at(REACH + 7.3) + noise).astype(np.float32), VOICE, REACH)
        assert found is not None
        errors.append(found.at - REACH - 7.3)
    assert np.abs(errors).max() < 0.5


def test_where_it_is_not_said_nothing_stands_out() -> None:
    noise = np.random.default_rng(1).standard_normal(LENGTH + 2 * REACH).astype(np.float32)
    found = arrival(noise, VOICE, REACH)
    assert found is None or found.clear < 8.0
    assert arrival(np.zeros(LENGTH + 2 * REACH, np.float32), VOICE, REACH) is None


def test_a_peak_at_the_last_lag_is_no_peak() -> None:
    """Of a tone in what is next to silence; it had no neighbour, and ended in an exception."""
    tone = np.sin(np.arange(4096) * 0.1).astype(np.float32)
    assert arrival(np.full(len(tone) + 2 * REACH, 1e-30, np.float32), tone, REACH) is None
