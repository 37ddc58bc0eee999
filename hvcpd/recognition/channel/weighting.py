"""A piece of sound over its noise: what least squares compare with known signals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.response import Taps, transform_size
from hvcpd.recognition.paths import Said

TAPS = 512
"""Samples of a response, at most: 32 ms, the direct sound and what a room sends after it soon."""
BACK = 192
"""Of them so many are before the place where a signal was found: there may be an echo, louder than the direct sound."""
SHIFT = 16
"""Samples (1 ms) that a word may begin off its place: clocks 1,300 ppm apart over the longest word and a pause."""
FRAME = 1024
BINS = FRAME // 2 + 1
BAND_HZ = (100.0, 7600.0)
"""Below, rumble; above, converters' filters differ."""
ECHOES = 0.3
"""Of the spectrum that was heard, what counts as noise: late echoes, which no short response explains."""
LOUD = 4.0
"""Where sound has more than four times the noise's power, it counts by its own power: clatter is noise, and echoes are
as loud as what they follow."""
POWER_S = 0.04
FLOOR = 1e-4
"""No bin has less than -40 dB of the mean noise: a converter's empty bands would outweigh all others."""
SILENCE = 1e-13

Spectrum = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Fit:
    """A known signal against what was heard around its place, over noise of variance 1.

    `correlation` at lags from -BACK - SHIFT on, shape (TAPS + 2 SHIFT,); the signal's `autocorrelation` at lags from 0,
    shape (TAPS,).
    """

    correlation: Taps
    autocorrelation: Taps


class WeightedSound:
    """What was heard, whitened by its noise and by its own power, scaled to variance 1."""

    def __init__(self, heard: Samples, noise: Samples) -> None:
        """`heard` and `noise` alone, shapes (n,) and (m,), m ≥ FRAME, float32 at 16 kHz."""
        self.n = len(heard)
        usual = _smooth(_spectrum(noise), 3) + ECHOES * _smooth(_spectrum(heard), 6)
        hz = np.linspace(0.0, SAMPLE_RATE_HZ / 2, BINS)
        inverse = 1.0 / (usual + FLOOR * usual.mean() + SILENCE)
        self._inverse: Spectrum = np.where((hz >= BAND_HZ[0]) & (hz <= BAND_HZ[1]), inverse, 0.0).astype(np.float32)
        self._inverses: dict[int, Spectrum] = {}
        floor = float(np.median(_power(self._whitened(noise)))) + 1e-20
        self._weights: Samples = np.asarray((1.0 + _power(self._whitened(heard)) / (LOUD * floor)) ** -0.5, np.float32)
        self._heard: Samples = heard * self._weights
        white = self._whitened(self._heard)
        variance = max(float(np.mean(np.square(white, dtype=np.float64))), 1e-20)
        self._inverse /= np.float32(variance)
        self._inverses = {}
        self._energy = np.concatenate([[0.0], np.cumsum(np.square(white, dtype=np.float64) / variance)])
        self._heard_spectra: dict[tuple[int, int], NDArray[np.complexfloating]] = {}
        self._fits: dict[tuple[Said, int], Fit] = {}

    def energy(self, first: int, last: int) -> float:
        """What was heard from sample `first` up to `last`, in variances of the noise."""
        begin, end = np.clip((first, last), 0, self.n)
        return float(self._energy[end] - self._energy[begin])

    def seek(self, said: Said, first: int, n: int) -> tuple[Taps, float]:
        """The correlation with the signal beginning at each of `n` samples from `first` on, and the signal's energy."""
        size = transform_size(said.length + n)
        known = np.fft.rfft(said.samples, size)
        weighted = np.conj(known) * self._over(size)
        energy = 2.0 * float((known * weighted).real.sum(dtype=np.float64)) / size
        found = np.fft.irfft(np.fft.rfft(self._taken(self._heard, first, size), size) * weighted, size)
        return np.asarray(found[:n], np.float32), energy

    def fit(self, said: Said, at: int) -> Fit:
        """The signal, beginning at sample `at` or SHIFT around it."""
        fit = self._fits.get((said, at))
        if fit is None:
            fit = self._fits[said, at] = self._fitted(said, at)
        return fit

    def _fitted(self, said: Said, at: int) -> Fit:
        size = transform_size(said.length + TAPS + 2 * SHIFT + _GRID)
        known = np.fft.rfft(self._there(said, at), size)
        weighted = np.conj(known) * self._over(size)
        first = at - SHIFT - BACK
        begin = first // _GRID * _GRID
        heard = self._heard_spectra.get((begin, size))
        if heard is None:
            heard = np.fft.rfft(self._taken(self._heard, begin, size), size)
            self._heard_spectra[begin, size] = heard
        both = np.fft.irfft(np.stack([heard, known]) * weighted, size)
        correlation, own = both.astype(np.float32)
        return Fit(correlation[first - begin : first - begin + TAPS + 2 * SHIFT].copy(), own[:TAPS].copy())

    def _there(self, said: Said, at: int) -> Samples:
        """A signal, weighted as what was heard is where it is."""
        return said.samples * self._taken(self._weights, at, said.length)

    @staticmethod
    def _taken(values: Samples, first: int, n: int) -> Samples:
        """`n` values from number `first` on, 0 where there are none."""
        taken = values[max(first, 0) : max(first + n, 0)]
        before = min(max(-first, 0), n)
        return np.pad(taken, (before, n - before - len(taken))) if len(taken) < n else taken

    def _over(self, size: int) -> Spectrum:
        """One over the noise at the bins of a transform."""
        over = self._inverses.get(size)
        if over is None:
            at = np.linspace(0.0, BINS - 1.0, size // 2 + 1)
            over = self._inverses[size] = np.interp(at, np.arange(BINS), self._inverse).astype(np.float32)
        return over

    def _whitened(self, sound: Samples) -> Samples:
        size = transform_size(len(sound) + FRAME)
        return np.asarray(np.fft.irfft(np.fft.rfft(sound, size) * np.sqrt(self._over(size)), size)[: len(sound)])


_GRID = 1024
"""Samples between the beginnings of what is transformed, so that signals at near places share a transform."""


def _spectrum(sound: Samples) -> NDArray[np.float64]:
    """Mean power at BINS frequencies (Welch's method), shape (BINS,)."""
    window = np.hanning(FRAME).astype(np.float32)
    padded = np.pad(sound, (0, max(FRAME - len(sound), 0)))
    frames = np.lib.stride_tricks.sliding_window_view(padded, FRAME)[:: FRAME // 2] * window
    spectra = np.fft.rfft(frames)
    return np.asarray(np.mean(spectra.real**2 + spectra.imag**2, axis=0) / np.square(window).sum(), np.float64)


def _smooth(values: NDArray[np.float64], reach: int) -> NDArray[np.float64]:
    """The mean over `reach` neighbours on either side."""
    return np.convolve(np.pad(values, reach, mode="edge"), np.full(2 * reach + 1, 1.0 / (2 * reach + 1)), "valid")


def _power(sound: Samples) -> NDArray[np.float64]:
    """Mean power around each sample, over POWER_S twice, shape (n,)."""
    half = round(POWER_S * SAMPLE_RATE_HZ / 4)
    power = np.square(sound, dtype=np.float64)
    for _ in range(2):
        total = np.cumsum(np.pad(power, (half + 1, half), mode="edge"))
        power = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
    return np.maximum(power, 0.0)
