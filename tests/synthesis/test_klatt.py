"""The synthesizer proper: its filters against their recursions, its source against the pitch asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.synthesis.klatt import (
    RING_SAMPLES,
    Band,
    Controls,
    Frication,
    Track,
    glottal_spectrum,
    parallel_response,
    pulse_times,
    resonator_response,
    synthesize,
    tract_response,
)
from tests.synthesis.sounds import pitch_hz, spectrum_db

OFF = Track((0.0,), (-99.0,))


def constant(value: float) -> Track:
    return Track((0.0,), (value,))


def vowel(f0_hz: float = 120.0, formants: tuple[float, ...] = (700.0, 1220.0, 2600.0)) -> Controls:
    return Controls(
        duration_s=0.6,
        f0_hz=constant(f0_hz),
        voicing_db=constant(0.0),
        aspiration_db=OFF,
        tilt_hz=constant(2600.0),
        formants_hz=tuple(constant(f) for f in formants),
        bandwidths_hz=tuple(constant(b) for b in (90.0, 100.0, 140.0)),
        nasal_zero_hz=constant(270.0),
        nasal_pole_hz=270.0,
        voiced_hz=constant(3000.0),
        fixed=((3500.0, 200.0), (4500.0, 300.0)),
    )


def recursion(centre_hz: float, width_hz: float) -> tuple[list[float], list[float]]:
    """Numerator and denominator of Klatt's y(n) = A x(n) + B y(n-1) + C y(n-2), equations 1 and 2 of his paper."""
    t = 1.0 / SAMPLE_RATE_HZ
    c = -np.exp(-2 * np.pi * width_hz * t)
    b = 2 * np.exp(-np.pi * width_hz * t) * np.cos(2 * np.pi * centre_hz * t)
    return [1 - b - c], [1.0, -b, -c]


def impulse_response(filters: list[tuple[list[float], list[float]]]) -> np.ndarray:
    x = np.zeros(RING_SAMPLES)
    x[0] = 1.0
    for numerator, denominator in filters:
        x = lfilter(numerator, denominator, x)
    return x


@pytest.mark.parametrize(("centre_hz", "width_hz"), [(300.0, 60.0), (1500.0, 90.0), (2600.0, 160.0), (6500.0, 500.0)])
def test_a_resonator_peaks_where_asked_with_the_width_asked(centre_hz: float, width_hz: float) -> None:
    grid = np.arange(10.0, 7990.0, 1.0)
    power = np.abs(
        resonator_response(np.array([centre_hz]), np.array([width_hz]), np.exp(-2j * np.pi * grid / SAMPLE_RATE_HZ))[0]
    )
    peak = int(np.argmax(power))
    assert grid[peak] == pytest.approx(centre_hz, abs=0.1 * width_hz + 3.0)
    above = np.flatnonzero(power >= power[peak] / np.sqrt(2.0))
    assert grid[above[-1]] - grid[above[0]] == pytest.approx(width_hz, rel=0.06)


def test_the_cascade_is_the_spectrum_of_its_recursions_run_sample_by_sample() -> None:
    controls = vowel()
    filters = [recursion(*pair) for pair in ((700, 90), (1220, 100), (2600, 140), (3500, 200), (4500, 300))]
    wanted = np.fft.rfft(impulse_response(filters))
    got = tract_response(controls, np.array([0.1, 0.3]))
    assert got.shape == (2, RING_SAMPLES // 2 + 1)
    assert np.max(np.abs(got - wanted)) < 2e-3 * np.max(np.abs(wanted))


def test_a_nasal_has_a_pole_and_a_zero_where_asked() -> None:
    nasal = replace(vowel(), nasal_zero_hz=constant(450.0))
    oral = tract_response(vowel(), np.array([0.1]))[0]
    ratio = np.abs(tract_response(nasal, np.array([0.1]))[0] / oral)
    bins_hz = np.arange(len(ratio)) * SAMPLE_RATE_HZ / RING_SAMPLES
    low = bins_hz < 1000
    assert bins_hz[low][np.argmin(ratio[low])] == pytest.approx(450.0, abs=25.0)
    assert bins_hz[low][np.argmax(ratio[low])] == pytest.approx(270.0, abs=25.0)


def test_the_glottal_pulse_in_closed_form_is_that_of_the_waveform() -> None:
    """KLGLOTT88's flow derivative 2at - 3bt² (scaled to -1 at closure), sampled finely, against its spectrum."""
    open_s, delay_s = 0.0045, 0.01
    over = 64
    t = np.arange(int(0.02 * SAMPLE_RATE_HZ * over)) / (SAMPLE_RATE_HZ * over) - (delay_s - open_s)
    inside = (t >= 0) & (t < open_s)
    derivative = np.where(inside, (2.0 * t / open_s - 3.0 * (t / open_s) ** 2), 0.0)
    hz = np.array([105.0, 400.0, 1500.0, 3000.0])
    bins = np.round(hz * RING_SAMPLES / SAMPLE_RATE_HZ).astype(int)
    seconds = np.arange(len(t)) / (SAMPLE_RATE_HZ * over)
    wanted = [
        np.sum(derivative * np.exp(-2j * np.pi * k * SAMPLE_RATE_HZ / RING_SAMPLES * seconds)) / over for k in bins
    ]
    got = glottal_spectrum(np.array([open_s]), np.array([delay_s]))[0, bins]
    assert np.abs(got) == pytest.approx(np.abs(wanted), rel=0.02)


@pytest.mark.parametrize("f0_hz", [86.0, 138.0, 205.0, 258.0])
def test_the_pitch_is_the_one_asked_for(f0_hz: float) -> None:
    assert pitch_hz(synthesize(vowel(f0_hz))) == pytest.approx(f0_hz, rel=0.02)


def test_pulses_follow_a_gliding_pitch() -> None:
    times = pulse_times(Track((0.0, 1.0), (100.0, 200.0)), 1.0, np.random.default_rng(5))
    times = times[times < 1.0]
    assert len(times) == pytest.approx(150, abs=1)
    intervals = np.diff(times)
    assert 1.0 / intervals[0] == pytest.approx(100.0, rel=0.03)
    assert 1.0 / intervals[-1] == pytest.approx(200.0, rel=0.03)


def test_formants_stand_in_the_sound() -> None:
    """An /i/ has a valley where an /a/ has its first two formants, measured on the sound itself."""
    hz = np.arange(2049) * SAMPLE_RATE_HZ / 4096
    a = spectrum_db(synthesize(vowel(100.0)))
    i = spectrum_db(synthesize(vowel(100.0, (310.0, 2080.0, 2960.0))))

    def level(db: np.ndarray, low: float, high: float) -> float:
        return float(np.max(db[(hz >= low) & (hz < high)]))

    assert level(a, 600, 1400) - level(a, 1700, 2300) > 12.0
    assert level(i, 1900, 2300) - level(i, 900, 1400) > 10.0
    assert level(i, 200, 400) - level(a, 200, 400) > 3.0


def test_frication_has_the_spectrum_of_its_bands() -> None:
    band = (Band(5000.0, 800.0, 0.0),)
    event = Frication((0.05, 0.08, 0.5, 0.55), (-20.0, 0.0, 0.0, -30.0), band)
    sound = synthesize(replace(vowel(), voicing_db=OFF, frications=(event,)))
    hz = np.arange(2049) * SAMPLE_RATE_HZ / 4096
    power = 10.0 ** (spectrum_db(sound) / 10.0)
    assert float(np.sum(hz * power) / np.sum(power)) == pytest.approx(5000.0, abs=500.0)
    assert float(np.std(sound[3200:6400])) == pytest.approx(0.1, rel=0.15)
    z1 = np.exp(-2j * np.pi * hz / SAMPLE_RATE_HZ)
    assert hz[np.argmax(np.abs(parallel_response(band, z1)))] == pytest.approx(5000.0, abs=60.0)


def test_silence_asked_for_is_silence() -> None:
    sound = synthesize(replace(vowel(), voicing_db=OFF))
    assert len(sound) == round(0.6 * SAMPLE_RATE_HZ)
    assert not sound.any()


def harmonicity_db(sound: np.ndarray, f0_hz: float, low_hz: float, high_hz: float) -> float:
    """Power at the harmonics over power half-way between them, in a band, dB."""
    power = 10.0 ** (spectrum_db(sound) / 10.0)
    hz = np.arange(len(power)) * SAMPLE_RATE_HZ / (2 * (len(power) - 1))
    from_harmonic = np.abs((hz / f0_hz + 0.5) % 1.0 - 0.5)
    band = (hz >= low_hz) & (hz < high_hz)
    on, off = power[band & (from_harmonic < 0.15)].mean(), power[band & (from_harmonic > 0.35)].mean()
    return float(10.0 * np.log10(on / off))


def test_the_source_is_periodic_below_the_maximum_voiced_frequency_and_noise_above() -> None:
    sound = synthesize(vowel(160.0))
    assert harmonicity_db(sound, 160.0, 300.0, 2000.0) > 8.0
    assert abs(harmonicity_db(sound, 160.0, 4200.0, 7500.0)) < 3.0


def test_noise_in_place_of_pulses_changes_no_level() -> None:
    """In thirds of an octave the spectrum is that of the purely periodic vowel, above the change too."""
    periodic, mixed = (synthesize(replace(vowel(), voiced_hz=constant(hz))) for hz in (20000.0, 3000.0))
    hz = np.arange(2049) * SAMPLE_RATE_HZ / 4096
    for low in (300.0, 1000.0, 3600.0, 4500.0):
        band = (hz >= low) & (hz < 1.26 * low)
        levels = [10.0 * np.log10(np.sum(10.0 ** (spectrum_db(sound)[band] / 10.0))) for sound in (periodic, mixed)]
        assert levels[0] == pytest.approx(levels[1], abs=2.0)


def test_the_seed_decides_the_noise_and_the_pulses() -> None:
    first, again, other = (synthesize(replace(vowel(), noise_seed=seed)) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.allclose(first, other, atol=1e-3)


@pytest.mark.parametrize("f0_hz", [89.0, 141.0, 203.0])
def test_a_rounding_error_stays_a_rounding_error(f0_hz: float) -> None:
    """Another processor's last digit may move no random number to another pulse: peers compute the same samples."""
    sound = synthesize(vowel(f0_hz)).astype(float)
    for off in (1.0 - 1e-13, 1.0 + 1e-13):
        other = synthesize(vowel(f0_hz * off)).astype(float)
        assert np.sum((sound - other) ** 2) < 1e-6 * np.sum(sound**2)
