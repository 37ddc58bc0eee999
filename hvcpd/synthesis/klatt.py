"""A formant synthesizer after Klatt, worked out pulse by pulse in the frequency domain.

The vocal tract is Klatt's cascade of digital resonators (D. H. Klatt, "Software for a cascade/parallel formant
synthesizer", JASA 67, 1980); frication goes through parallel resonators. The glottal source is KLGLOTT88 (Klatt and
Klatt, JASA 87, 1990). Instead of running the recursions sample by sample, which is slow in Python, the spectrum of
every glottal pulse (source times tract, both in closed form) is transformed back at once and overlap-added, so
each pulse rings out through the tract as it stood when the glottis closed. Pulses are band-limited and fall
between samples exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

RING_SAMPLES = 768
"""Length of a pulse's response, samples (48 ms): a 50 Hz wide formant has decayed by 65 dB."""
HOP_SAMPLES = 80
"""Step of the aspiration filter, samples: 5 ms, Klatt's frame."""
SILENCE_DB = -60.0
"""Sources weaker than this, dB below a vowel, are left out."""
VOICE_GAIN = 0.42
"""Scale that brings an open vowel near 0.1 rms, the level to which the noise levels of `phones` refer."""
NASAL_WIDTH_HZ = 100.0
"""Bandwidth of the nasal pole and of the nasal zero (Klatt 1980)."""
SMOOTH_S = 0.02
"""Time over which corners of formant tracks are rounded."""

_BIN_HZ = np.arange(RING_SAMPLES // 2 + 1) * (SAMPLE_RATE_HZ / RING_SAMPLES)
_Z1: ComplexArray = np.exp(-2j * np.pi * _BIN_HZ / SAMPLE_RATE_HZ)


@dataclass(frozen=True)
class Band:
    """One parallel resonator of a noise: centre and bandwidth in Hz, peak gain in dB."""

    centre_hz: float
    width_hz: float
    gain_db: float = 0.0


@dataclass(frozen=True)
class Track:
    """A control parameter over time as breakpoints, linear in between, constant outside."""

    times_s: tuple[float, ...]
    values: tuple[float, ...]

    def at(self, times_s: Array) -> Array:
        """The parameter at the times given (s); same shape."""
        return np.interp(times_s, self.times_s, self.values)

    def smooth(self, times_s: Array) -> Array:
        """The parameter with rounded corners, as tongue and lips move: the mean over `SMOOTH_S`; same shape."""
        steps = np.linspace(-0.5, 0.5, 5)[:, None] * SMOOTH_S
        return np.asarray(self.at(times_s + steps).mean(axis=0))


@dataclass(frozen=True)
class Frication(Track):
    """A stretch of noise made at a constriction: its level, dB relative to a vowel, and its spectrum."""

    bands: tuple[Band, ...]


@dataclass(frozen=True)
class Controls:
    """Everything that the synthesizer is told of one stretch of speech.

    `formants_hz` and `bandwidths_hz` hold one track per moving resonator; `fixed` the (Hz, Hz) pairs of those that
    stay; `tilt_hz` is the corner of the source's low-pass; `nasal_zero_hz` parts from `nasal_pole_hz` in nasals;
    `voiced_hz` is the maximum voiced frequency, above which the source is noise; `noise_seed` decides every
    randomness.
    """

    duration_s: float
    f0_hz: Track
    voicing_db: Track
    aspiration_db: Track
    tilt_hz: Track
    formants_hz: tuple[Track, ...]
    bandwidths_hz: tuple[Track, ...]
    nasal_zero_hz: Track
    nasal_pole_hz: float
    voiced_hz: Track
    fixed: tuple[tuple[float, float], ...] = ()
    frications: tuple[Frication, ...] = ()
    open_quotient: float = 0.6
    noise_seed: int = 1980


def resonator_response(centre_hz: Array, width_hz: Array, z1: ComplexArray = _Z1) -> ComplexArray:
    """Klatt's digital resonator on the unit circle, unity gain at 0 Hz.

    `centre_hz` and `width_hz` have shape (n,), `z1` = exp(-jωT) shape (k,); returns (n, k). H = A / (1 - B/z - C/z²)
    with C = -exp(-2πbT), B = 2·exp(-πbT)·cos(2πfT), A = 1 - B - C (Klatt 1980, eq. 1 and 2).
    """
    a, b, c = _coefficients(centre_hz, width_hz)
    return np.asarray(a[:, None] / (1.0 - b[:, None] * z1 - c[:, None] * (z1 * z1)))


def _coefficients(centre_hz: Array, width_hz: Array) -> tuple[Array, Array, Array]:
    c = -np.exp(-2.0 * np.pi * width_hz / SAMPLE_RATE_HZ)
    b = 2.0 * np.exp(-np.pi * width_hz / SAMPLE_RATE_HZ) * np.cos(2.0 * np.pi * centre_hz / SAMPLE_RATE_HZ)
    return 1.0 - b - c, b, c


def tract_response(controls: Controls, times_s: Array) -> ComplexArray:
    """The cascade branch at each time, shape (n, RING_SAMPLES // 2 + 1).

    The moving resonators' denominators are multiplied as polynomials in 1/z, of degree two each, and the product is
    evaluated at all bins at once: one product of real matrices instead of five complex operations for each resonator.
    """
    count = len(times_s)
    poles, gain = np.ones((count, 1)), np.ones(count)
    for centre, width in zip(controls.formants_hz, controls.bandwidths_hz, strict=True):
        a, b, c = _coefficients(centre.smooth(times_s), width.at(times_s))
        poles, gain = _times_quadratic(poles, b, c), gain * a
    zero_hz = controls.nasal_zero_hz.at(times_s)
    nasal = np.abs(zero_hz - controls.nasal_pole_hz) > 1.0
    response = np.empty((count, len(_Z1)), dtype=np.complex128)
    if nasal.any():
        widths = np.full(count, NASAL_WIDTH_HZ)
        a, b, c = _coefficients(np.full(count, controls.nasal_pole_hz), widths)
        poles, gain = _times_quadratic(poles, b * nasal, c * nasal), np.where(nasal, gain * a, gain)
        a, b, c = _coefficients(zero_hz, widths)
        zeros = _times_quadratic(np.ones((count, 1)), b * nasal, c * nasal)
        np.divide(_at_bins(zeros * (gain / np.where(nasal, a, 1.0))[:, None]), _at_bins(poles), out=response)
    else:
        np.divide(gain[:, None], _at_bins(poles), out=response)
    response *= _fixed_response(controls.fixed)
    return response


def _times_quadratic(polynomials: Array, b: Array, c: Array) -> Array:
    """Polynomials in 1/z, shape (n, k), each times its 1 - b/z - c/z²: shape (n, k + 2)."""
    out = np.zeros((len(polynomials), polynomials.shape[1] + 2))
    out[:, :-2] = polynomials
    out[:, 1:-1] -= b[:, None] * polynomials
    out[:, 2:] -= c[:, None] * polynomials
    return out


def _at_bins(polynomials: Array) -> ComplexArray:
    """Polynomials in 1/z, shape (n, k), at all bins: shape (n, RING_SAMPLES // 2 + 1)."""
    values: ComplexArray = (polynomials @ _powers(polynomials.shape[1])).view(np.complex128)
    return values


@lru_cache
def _powers(count: int) -> Array:
    """1/z at each bin to the powers 0 to `count` - 1; shape (count, 2 · bins), real and imaginary parts in turn."""
    powers: ComplexArray = _Z1 ** np.arange(count)[:, None]
    return powers.view(np.float64)


@lru_cache
def _fixed_response(fixed: tuple[tuple[float, float], ...]) -> ComplexArray:
    """The resonators that stay, (Hz, Hz) each, together; shape (RING_SAMPLES // 2 + 1,)."""
    centres, widths = np.array(fixed).reshape(-1, 2).T
    return np.asarray(np.prod(resonator_response(centres, widths), axis=0))


def _delay(delay_s: Array) -> ComplexArray:
    """Spectra (n, bins) of unit impulses so late: exp(-jωt) bin by bin as powers, which is faster than exponentials."""
    phasors = np.empty((len(delay_s), len(_BIN_HZ)), dtype=np.complex128)
    phasors[:, 0] = 1.0
    phasors[:, 1:] = np.exp(-2j * np.pi * _BIN_HZ[1] * delay_s)[:, None]
    return np.cumprod(phasors, axis=1, out=phasors)


def glottal_spectrum(open_s: Array, delay_s: Array) -> ComplexArray:
    """Spectra (n, bins) of KLGLOTT88 flow derivatives whose closure falls `delay_s` after the buffer's start.

    Flow a·t² - b·t³ for 0 <= t <= `open_s` = a/b, scaled to a derivative of -1 at closure; integrated by parts.
    """
    a = (1.0 / open_s)[:, None]
    curvature = -6.0 * a / open_s[:, None]
    inverse = 1.0 / (2j * np.pi * np.maximum(_BIN_HZ, 1e-3))
    inverse2 = inverse * inverse
    opening = inverse2 * (2.0 * a + curvature * inverse)
    closing = inverse * (-1.0 + inverse * (-4.0 * a + curvature * inverse))
    spectrum = (opening * _delay(delay_s - open_s) - closing * _delay(delay_s)) * SAMPLE_RATE_HZ
    spectrum[:, 0] = 0.0
    return np.asarray(spectrum)


JITTER = 0.006
"""Standard deviation of a glottal closure's moment, in periods: people's periods vary by 0.3 to 1 %."""

SHIMMER_DB = 0.35
"""Standard deviation of a pulse's level; people's voices have 0.2 to 0.4 dB."""

FLUTTER_HZ = (1.3, 2.9, 4.7, 7.1, 12.7)
FLUTTER = (0.006, 0.005, 0.004, 0.0025, 0.0025)
"""Slow movements of the pitch beside its track, incommensurate so that they do not repeat (Klatt and Klatt 1990)."""


def pulse_times(f0_hz: Track, duration_s: float, rng: np.random.Generator) -> Array:
    """Return the moments of glottal closure (s) for a pitch track until 20 ms after `duration_s`: where the integral of
    the frequency passes integers, with flutter and jitter by `rng`."""
    grid = np.arange(0.0, duration_s + 0.02, 1e-3)  # the last pulses begin before the end, whatever its rounding
    phases = rng.uniform(0.0, 2.0 * np.pi, len(FLUTTER))
    flutter = sum(
        a * np.sin(2.0 * np.pi * hz * grid + phase) for a, hz, phase in zip(FLUTTER, FLUTTER_HZ, phases, strict=True)
    )
    f0 = f0_hz.at(grid) * (1.0 + flutter)
    cycles = np.concatenate(([0.0], np.cumsum(0.5e-3 * (f0[1:] + f0[:-1]))))
    wanted = np.arange(0.5, cycles[-1])
    closures: Array = np.interp(wanted + JITTER * rng.standard_normal(len(wanted)), cycles, grid)
    return closures


BLEND_HZ = 350.0
"""Width of the change from pulses to noise: the noise has 12 % of the power this far below `voiced_hz`, 88 % above."""

NOISE_SPAN = 1.2
"""Length of the noise of a pulse, glottal periods, round the closure: so it comes and goes with the glottis."""

NOISE_LAG = 160
"""Most samples of it on either side of the closure: enough for 60 Hz. Fixed, so that no rounding shifts the sequence of
random numbers between one processor and another."""


def mixed_excitation(voiced_hz: Array, period_s: Array, white: Array) -> ComplexArray:
    """Return factors, shape (n, bins), that turn the spectrum of each pulse into noise of the same power above
    `voiced_hz`, in a raised-cosine window of `NOISE_SPAN` periods round the closure.

    `voiced_hz` and `period_s` have shape (n,), `white` is unit noise, shape (n, 2 · NOISE_LAG + 1).
    """
    lag = np.arange(-NOISE_LAG, NOISE_LAG + 1)
    turn = np.clip(lag / (NOISE_SPAN * SAMPLE_RATE_HZ * period_s[:, None]), -0.5, 0.5)
    window = 0.5 + 0.5 * np.cos(2.0 * np.pi * turn)
    placed = np.zeros((len(white), RING_SAMPLES))
    placed[:, lag] = white * window / np.sqrt(np.sum(window**2, axis=1, keepdims=True))
    share = 1.0 / (1.0 + np.exp(np.clip((voiced_hz[:, None] - _BIN_HZ) / (0.5 * BLEND_HZ), -30.0, 30.0)))
    return np.asarray(np.sqrt(1.0 - share) + np.sqrt(share) * np.fft.rfft(placed, axis=1))


def _voiced(controls: Controls, out: Array) -> None:
    """Add the glottal pulses, each through the tract of its moment."""
    times = pulse_times(controls.f0_hz, controls.duration_s, _rng(controls, 0))
    level_db = controls.voicing_db.at(times)
    keep = level_db > SILENCE_DB
    if not keep.any():
        return
    level_db = (level_db + SHIMMER_DB * _rng(controls, 1).standard_normal(len(times)))[keep]
    white = _rng(controls, 2).standard_normal((len(times), 2 * NOISE_LAG + 1))[keep]
    times = times[keep]
    period_s = 1.0 / controls.f0_hz.at(times)
    open_s = controls.open_quotient * period_s
    lead = np.ceil(open_s * SAMPLE_RATE_HZ) + 1.0
    start = np.floor(times * SAMPLE_RATE_HZ) - lead
    spectra = glottal_spectrum(open_s, times - start / SAMPLE_RATE_HZ)
    corner = np.exp(-2.0 * np.pi * controls.tilt_hz.at(times) / SAMPLE_RATE_HZ)
    spectra *= ((1.0 - corner) * VOICE_GAIN * 10.0 ** (level_db / 20.0))[:, None] / (1.0 - corner[:, None] * _Z1)
    spectra *= tract_response(controls, times)
    spectra *= mixed_excitation(controls.voiced_hz.at(times), period_s, white)
    _overlap_add(out, np.fft.irfft(spectra, RING_SAMPLES, axis=1), start.astype(np.int64))


def _rng(controls: Controls, use: int) -> np.random.Generator:
    """Return a generator of its own for each use: what one draws shifts no other's sequence."""
    return np.random.default_rng((controls.noise_seed, use))


_BREATH: ComplexArray = (1.0 - 0.9 * _Z1) * (0.6 / (1.0 - 0.4 * _Z1)) ** 2
"""Spectrum of breath: rising by radiation up to 2 kHz, level within 2 dB above."""


def _aspirated(controls: Controls, out: Array, rng: np.random.Generator) -> None:
    """Add breath noise through the cascade, in Hann windows of two hops."""
    hops = np.arange(int(controls.duration_s * SAMPLE_RATE_HZ) // HOP_SAMPLES + 1)
    level_db = controls.aspiration_db.at(hops * HOP_SAMPLES / SAMPLE_RATE_HZ)
    white = rng.standard_normal((len(hops) + 1) * HOP_SAMPLES)
    active = np.flatnonzero(level_db > SILENCE_DB)
    if not len(active):
        return
    window = 0.5 - 0.5 * np.cos(np.pi * np.arange(2 * HOP_SAMPLES) / HOP_SAMPLES)
    index = active[:, None] * HOP_SAMPLES + np.arange(2 * HOP_SAMPLES)
    grains = white[index] * window * (ASPIRATION_GAIN * 10.0 ** (level_db[active] / 20.0))[:, None]
    spectra = np.fft.rfft(grains, RING_SAMPLES, axis=1)
    times_s = active * HOP_SAMPLES / SAMPLE_RATE_HZ
    spectra *= tract_response(controls, times_s) * _BREATH
    _overlap_add(out, np.fft.irfft(spectra, RING_SAMPLES, axis=1), (active - 1) * HOP_SAMPLES)


ASPIRATION_GAIN = 0.05
"""Brings aspiration at 0 dB near the level of a vowel at 0 dB."""


def parallel_response(bands: tuple[Band, ...], z1: ComplexArray) -> ComplexArray:
    """The parallel branch, shape (k,): resonators after a first difference, each with peak gain `gain_db`.

    Neighbours have opposite signs so that no zero falls between them (Klatt 1980, p. 983).
    """
    total = np.zeros(len(z1), dtype=np.complex128)
    for number, band in enumerate(bands):
        centre, width = np.array([band.centre_hz]), np.array([band.width_hz])
        response = resonator_response(centre, width, z1)[0] * (1.0 - z1)
        peak = float(np.max(np.abs(response)))
        total += (-1.0) ** number * 10.0 ** (band.gain_db / 20.0) / peak * response
    return total


def _frication(event: Frication, out: Array, rng: np.random.Generator) -> None:
    """Add one stretch of noise of a fixed spectrum, scaled so that 0 dB is the level of a vowel."""
    first = int(event.times_s[0] * SAMPLE_RATE_HZ)
    count = int(event.times_s[-1] * SAMPLE_RATE_HZ) - first
    if count <= 0:
        return
    size = 1 << (count + RING_SAMPLES // 2).bit_length()
    z1 = np.exp(-2j * np.pi * np.arange(size // 2 + 1) / size)
    response = parallel_response(event.bands, z1)
    response *= 0.1 / np.sqrt(np.mean(np.abs(response) ** 2))
    seconds = (first + np.arange(count)) / SAMPLE_RATE_HZ
    level = 10.0 ** (event.at(seconds) / 20.0)
    noise = np.fft.irfft(np.fft.rfft(rng.standard_normal(count) * level, size) * response, size)
    _overlap_add(out, noise[None, : count + RING_SAMPLES // 2], np.array([first]))


def _overlap_add(out: Array, grains: Array, starts: NDArray[np.int64]) -> None:
    for grain, start in zip(grains, starts.tolist(), strict=True):
        skip = max(0, -start)
        end = min(len(out), start + len(grain))
        if end > start + skip:
            out[start + skip : end] += grain[skip : end - start]


def synthesize(controls: Controls) -> Samples:
    """The sound of the controls: float32, shape (duration_s * 16 kHz,), an open vowel near 0.1 rms."""
    out = np.zeros(round(controls.duration_s * SAMPLE_RATE_HZ))
    _voiced(controls, out)
    _aspirated(controls, out, _rng(controls, 3))
    for number, event in enumerate(controls.frications, start=4):
        _frication(event, out, _rng(controls, number))
    return out.astype(np.float32)
