"""Loudspeakers: a cone that distorts, then its response, of minimum phase; for whole sounds, or block by block."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

NYQUIST_HZ = SAMPLE_RATE_HZ / 2
LOUD = 10.0 ** (-10.0 / 20.0) * 2.0**0.5
"""Amplitude of a sine of -10 dBFS (RMS), a loud vowel of speech at -20 dBFS; at 1.5 times as much the cone stops."""
FADED = 1e-6
"""What is left of a sound at this amplitude, a thirtieth of a step of 16 bits, is silence."""


@dataclass(frozen=True)
class Peak:
    """A resonance, or a dip where `gain_db` is negative."""

    hz: float
    gain_db: float
    q: float


@dataclass(frozen=True)
class Loudspeaker:
    """Corners in Hz with the orders of their Butterworth filters (order 0: none), resonances, and distortion.

    `distortion` is that of a sine of amplitude LOUD: its harmonics' amplitude over its own, of which the second and the
    third have the same.
    """

    name: str
    low_hz: float = 0.0
    low_order: int = 0
    high_hz: float = NYQUIST_HZ
    high_order: int = 0
    peaks: tuple[Peak, ...] = ()
    distortion: float = 0.0

    def play(self, sound: Samples) -> NDArray[np.float64]:
        """What it makes of a whole sound, shape (n,), from silence on."""
        return Playing(self).play(sound)

    @cached_property
    def sections(self) -> NDArray[np.float64]:
        """Its response as second-order sections, shape (n, 6)."""
        sections = [np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]])]
        if self.low_order:
            sections.append(butter(self.low_order, self.low_hz, "highpass", fs=SAMPLE_RATE_HZ, output="sos"))
        if self.high_order and self.high_hz < NYQUIST_HZ:
            sections.append(butter(self.high_order, self.high_hz, fs=SAMPLE_RATE_HZ, output="sos"))
        return np.concatenate([*sections, *map(peaking, self.peaks)])

    def distorted(self, sound: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the cone makes of it: a square has half its size in the second harmonic, a cube a quarter in the third,
        and takes three times that from the first."""
        if not self.distortion:
            return sound
        share = self.distortion / np.sqrt(2.0)
        y = np.clip(sound / LOUD, -1.5, 1.5)
        return np.asarray(LOUD * ((1.0 + 3.0 * share) * y + 2.0 * share * y**2 - 4.0 * share * y**3))


class Playing:
    """A loudspeaker that plays block after block."""

    def __init__(self, loudspeaker: Loudspeaker) -> None:
        self._loudspeaker = loudspeaker
        self._state = np.zeros((len(loudspeaker.sections), 2))

    def play(self, block: Samples) -> NDArray[np.float64]:
        """What it makes of the next samples, shape (n,); zeros once a sound has faded away."""
        distorted = self._loudspeaker.distorted(block.astype(np.float64))
        played, self._state = sosfilt(self._loudspeaker.sections, distorted, zi=self._state)
        if not np.any(block) and np.max(np.abs(played), initial=0.0) < FADED:
            self._state[:] = 0.0
            played[:] = 0.0
        return np.asarray(played)


def peaking(peak: Peak) -> NDArray[np.float64]:
    """R. Bristow-Johnson, "Cookbook formulae for audio EQ biquad filter coefficients": peakingEQ; shape (1, 6)."""
    omega = 2.0 * np.pi * peak.hz / SAMPLE_RATE_HZ
    alpha, gain = np.sin(omega) / (2.0 * peak.q), 10.0 ** (peak.gain_db / 40.0)
    a0 = 1.0 + alpha / gain
    b = [1.0 + alpha * gain, -2.0 * np.cos(omega), 1.0 - alpha * gain]
    return np.array([[*(each / a0 for each in b), 1.0, -2.0 * np.cos(omega) / a0, (1.0 - alpha / gain) / a0]])


IDEAL = Loudspeaker("ideal")
GOOD = Loudspeaker("good", 150.0, 2, 7000.0, 2)
"""A bookshelf box, or a good portable one."""
USUAL = Loudspeaker("usual", 200.0, 3, 6500.0, 2, (Peak(1000.0, 4.0, 1.5),), 0.01)
"""A small box with one driver of some 5 cm, as robots carry it: nothing below 200 Hz, one mild resonance."""
SMALL = Loudspeaker("small driver", 400.0, 4, 6000.0, 2, (Peak(900.0, 8.0, 2.0),))
"""A driver of 2 to 3 cm without a box to speak of, as on a sound HAT."""
SMALL_DISTORTING = Loudspeaker("small driver, 5 %", 400.0, 4, 6000.0, 2, (Peak(900.0, 8.0, 2.0),), 0.05)
