"""Loudspeakers: a cone that distorts, then its response, of minimum phase."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

NYQUIST_HZ = SAMPLE_RATE_HZ / 2


@dataclass(frozen=True)
class Peak:
    """A resonance, or a dip where `gain_db` is negative."""

    hz: float
    gain_db: float
    q: float


@dataclass(frozen=True)
class Loudspeaker:
    """Corners in Hz with the orders of their Butterworth filters (order 0: none), resonances, and distortion.

    `distortion` is that of a sine 10 dB above the mean power of the sentence: its harmonics' amplitude over its own,
    where the second and the third harmonic share it evenly.
    """

    name: str
    low_hz: float = 0.0
    low_order: int = 0
    high_hz: float = NYQUIST_HZ
    high_order: int = 0
    peaks: tuple[Peak, ...] = ()
    distortion: float = 0.0

    def play(self, sound: Samples) -> NDArray[np.float64]:
        """What it makes of a sound, shape (n,)."""
        out = self._distorted(sound.astype(np.float64))
        if self.low_order:
            out = sosfilt(butter(self.low_order, self.low_hz, "highpass", fs=SAMPLE_RATE_HZ, output="sos"), out)
        if self.high_order and self.high_hz < NYQUIST_HZ:
            out = sosfilt(butter(self.high_order, self.high_hz, fs=SAMPLE_RATE_HZ, output="sos"), out)
        for peak in self.peaks:
            out = sosfilt(_peaking(peak), out)
        return np.asarray(out)

    def _distorted(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        loud = x[np.abs(x) > 1e-4]
        if not self.distortion or not len(loud):
            return x
        amplitude = float(np.sqrt(20.0 * np.mean(loud**2)))  # of a sine 10 dB above the mean power
        share = self.distortion / np.sqrt(2.0)
        y = np.clip(x / amplitude, -1.5, 1.5)
        # sin^2 has half its size in the second harmonic, sin^3 a quarter in the third
        return np.asarray(amplitude * (y + 2.0 * share * y**2 - 4.0 * share * y**3 / (1.0 + 3.0 * share)))


def _peaking(peak: Peak) -> NDArray[np.float64]:
    """R. Bristow-Johnson, "Cookbook formulae for audio EQ biquad filter coefficients": peakingEQ."""
    omega = 2.0 * np.pi * peak.hz / SAMPLE_RATE_HZ
    alpha, gain = np.sin(omega) / (2.0 * peak.q), 10.0 ** (peak.gain_db / 40.0)
    a0 = 1.0 + alpha / gain
    b = [1.0 + alpha * gain, -2.0 * np.cos(omega), 1.0 - alpha * gain]
    return np.array([[*(each / a0 for each in b), 1.0, -2.0 * np.cos(omega) / a0, (1.0 - alpha / gain) / a0]])


IDEAL = Loudspeaker("ideal")
SMALL = Loudspeaker("small driver", 400.0, 4, 6000.0, 2, (Peak(900.0, 8.0, 2.0),))
SMALL_DISTORTING = Loudspeaker("small driver, 5 %", 400.0, 4, 6000.0, 2, (Peak(900.0, 8.0, 2.0),), 0.05)
GOOD = Loudspeaker("good", 150.0, 2, 7000.0, 2)


def draw_loudspeaker(chance: np.random.Generator) -> Loudspeaker:
    """Any from a telephone's to a good one; one in ten is ideal."""
    if chance.random() < 0.1:
        return IDEAL
    peaks = [Peak(_log_uniform(chance, 300.0, 1500.0), chance.uniform(0, 10), chance.uniform(1, 4))]
    for _ in range(chance.integers(0, 4)):
        peaks.append(Peak(_log_uniform(chance, 1000.0, 6500.0), chance.uniform(-8, 6), chance.uniform(1, 6)))
    return Loudspeaker(
        "drawn",
        _log_uniform(chance, 80.0, 500.0),
        int(chance.integers(2, 5)),
        float(chance.uniform(4500, 8000)),
        int(chance.integers(1, 5)),
        tuple(peaks),
        float(chance.choice([0.0, chance.uniform(0.0, 0.08)])),
    )


def _log_uniform(chance: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(chance.uniform(np.log(low), np.log(high))))
