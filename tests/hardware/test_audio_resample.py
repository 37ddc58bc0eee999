"""Sample-rate conversion against the analytic sine."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from hvcpd.hardware.audio_resample import StreamResampler, resample
from hvcpd.ports import Samples

RATES_HZ = (8_000, 11_025, 22_050, 44_100, 48_000)
EDGE_S = 0.02
"""At the ends the filter sees the silence outside."""


def sine(frequency_hz: float, rate_hz: int, duration_s: float = 0.5, phase_rad: float = 0.3) -> NDArray[np.float64]:
    t = np.arange(round(duration_s * rate_hz)) / rate_hz
    return np.sin(2 * np.pi * frequency_hz * t + phase_rad)


def inner(samples: NDArray[np.floating], rate_hz: int) -> NDArray[np.floating]:
    edge = round(EDGE_S * rate_hz)
    return samples[edge:-edge]


def level_db(samples: NDArray[np.floating]) -> float:
    return float(10 * np.log10(np.mean(samples.astype(np.float64) ** 2) / 0.5 + 1e-30))


@pytest.mark.parametrize("rate_hz", RATES_HZ)
@pytest.mark.parametrize("share", [0.01, 0.2, 0.5, 0.8])
def test_a_sine_in_the_pass_band_comes_out_as_the_analytic_one(rate_hz: int, share: float) -> None:
    """Up to 0.8 of the lower Nyquist frequency, in phase, with an error 70 dB below it."""
    frequency_hz = share * min(rate_hz, 16_000) / 2
    got = resample(sine(frequency_hz, rate_hz).astype(np.float32), rate_hz, 16_000)
    wanted = sine(frequency_hz, 16_000)
    assert level_db(inner(got - wanted[: len(got)], 16_000)) < -70.0


@pytest.mark.parametrize("rate_hz", [44_100, 48_000])
@pytest.mark.parametrize("frequency_hz", [8_050.0, 9_000.0, 12_000.0, 15_990.0, 20_000.0])
def test_what_16_khz_cannot_hold_is_gone(rate_hz: int, frequency_hz: float) -> None:
    """A sine beyond 8 kHz would come back as a false tone; it is 70 dB down."""
    got = resample(sine(frequency_hz, rate_hz).astype(np.float32), rate_hz, 16_000)
    assert level_db(inner(got, 16_000)) < -70.0


@pytest.mark.parametrize("rate_hz", RATES_HZ)
def test_a_constant_stays_a_constant(rate_hz: int) -> None:
    got = resample(np.full(rate_hz // 2, 0.5, np.float32), rate_hz, 16_000)
    np.testing.assert_allclose(inner(got, 16_000), 0.5, atol=1e-5)


@pytest.mark.parametrize("rate_hz", [44_100, 48_000])
def test_there_is_no_delay(rate_hz: int) -> None:
    click = np.zeros(rate_hz, np.float32)
    click[rate_hz // 2] = 1.0
    assert int(np.argmax(resample(click, rate_hz, 16_000))) == 8_000


@given(st.integers(0, 500), st.sampled_from([*RATES_HZ, 16_000, 96_000]), st.sampled_from([8_000, 16_000, 48_000]))
def test_the_length_follows_the_rates(count: int, from_hz: int, to_hz: int) -> None:
    got = resample(np.ones(count, np.float32), from_hz, to_hz)
    assert got.dtype == np.float32
    assert len(got) == -(-count * to_hz // from_hz)


def test_the_same_rate_changes_nothing() -> None:
    samples: Samples = np.random.default_rng(1).standard_normal(1000).astype(np.float32)
    np.testing.assert_array_equal(resample(samples, 16_000, 16_000), samples)


@pytest.mark.parametrize(("from_hz", "to_hz"), [(0, 16_000), (16_000, 0), (-8_000, 16_000), (16_000, -1)])
def test_impossible_rates_are_our_own_mistake(from_hz: int, to_hz: int) -> None:
    with pytest.raises(ValueError, match="must be positive"):
        resample(np.zeros(10, np.float32), from_hz, to_hz)


@given(
    st.sampled_from([(48_000, 16_000), (16_000, 48_000), (44_100, 16_000), (16_000, 44_100), (16_000, 16_000)]),
    st.lists(st.integers(0, 700), min_size=1, max_size=12),
)
def test_a_stream_gives_the_samples_of_the_whole_whatever_its_blocks(rates: tuple[int, int], cuts: list[int]) -> None:
    from_hz, to_hz = rates
    whole: Samples = np.random.default_rng(2).standard_normal(sum(cuts)).astype(np.float32)
    stream = StreamResampler(from_hz, to_hz)
    parts, begin = [], 0
    for count in cuts:
        parts.append(stream.push(whole[begin : begin + count]))
        begin += count
        reach = round(stream.delay_s * from_hz)
        assert sum(map(len, parts)) == max(0, -(-(begin - reach) * to_hz // from_hz)), "not one more or less"
    got = np.concatenate(parts)
    np.testing.assert_allclose(got, resample(whole, from_hz, to_hz)[: len(got)], atol=1e-5)


@pytest.mark.parametrize(("from_hz", "to_hz"), [(44_100, 16_000), (16_000, 44_100)])
def test_a_stream_does_not_drift(from_hz: int, to_hz: int) -> None:
    stream = StreamResampler(from_hz, to_hz)
    block = np.zeros(from_hz // 10, np.float32)
    count = sum(len(stream.push(block)) for _ in range(600))
    assert count == -(-(len(block) * 600 - round(stream.delay_s * from_hz)) * to_hz // from_hz)
