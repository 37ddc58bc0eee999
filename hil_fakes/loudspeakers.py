"""Loudspeakers: a cone that distorts, then its response, of minimum phase; for whole sounds, or block by block."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

RESPONSE = 1024
"""Samples (64 ms) of a loudspeaker's response: a resonance of Q 4 at 300 Hz has fallen by 130 dB."""
NYQUIST_HZ = SAMPLE_RATE_HZ / 2
LOUD = 10.0 ** (-10.0 / 20.0) * 2.0**0.5
"""Amplitude of a sine of -10 dBFS (RMS), a loud vowel of speech at -20 dBFS; at 1.5 times as much the cone stops."""


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
        """Its output for a whole sound, shape (n,), starting from silence."""
        return Playing(self).play(sound)

    @cached_property
    def sections(self) -> NDArray[np.float64]:
        """Its response as second-order sections, shape (n, 6), as scipy.signal has them."""
        sections = [np.array([1.0, 0.0, 0.0, 1.0, 0.0, 0.0])]
        if self.low_order:
            sections += butterworth(self.low_order, self.low_hz, high_pass=True)
        if self.high_order and self.high_hz < NYQUIST_HZ:
            sections += butterworth(self.high_order, self.high_hz, high_pass=False)
        return np.array([*sections, *map(peaking, self.peaks)])

    @cached_property
    def response(self) -> NDArray[np.float64]:
        """Its impulse response, shape (RESPONSE,)."""
        z = np.exp(-2j * np.pi * np.fft.rfftfreq(8 * RESPONSE))
        powers = np.stack([z**0, z, z**2])
        spectrum = np.prod((self.sections[:, :3] @ powers) / (self.sections[:, 3:] @ powers), axis=0)
        return np.fft.irfft(spectrum)[:RESPONSE]

    def distorted(self, sound: NDArray[np.float64]) -> NDArray[np.float64]:
        """The cone's distortion: a square has half its size in the second harmonic, a cube a quarter in the third,
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
        self._before = np.zeros(RESPONSE - 1)
        self._spectra: dict[int, NDArray[np.complex128]] = {}

    def play(self, block: Samples) -> NDArray[np.float64]:
        """Its output for the next samples, shape (n,); zeros once a sound has faded away."""
        heard = np.concatenate([self._before, self._loudspeaker.distorted(block.astype(np.float64))])
        self._before = heard[len(block) :]
        if not heard.any():
            return heard[: len(block)]
        size = 1 << (len(heard) - 1).bit_length()
        if size not in self._spectra:
            self._spectra = {size: np.fft.rfft(self._loudspeaker.response, size)}
        played = np.fft.irfft(np.fft.rfft(heard, size) * self._spectra[size], size)
        return played[RESPONSE - 1 : RESPONSE - 1 + len(block)]


def butterworth(order: int, hz: float, high_pass: bool) -> list[NDArray[np.float64]]:
    """A Butterworth filter as second-order sections, shape (6,) each: poles of the Q that it has, by the bilinear
    transform (A. Oppenheim & R. Schafer, "Discrete-Time Signal Processing", ch. 7)."""
    k = np.tan(np.pi * hz / SAMPLE_RATE_HZ)
    side = -1.0 if high_pass else 1.0
    sections = []
    for pair in range(order // 2):
        damping = 2.0 * np.sin(np.pi * (2 * pair + 1) / (2 * order))
        a0 = 1.0 + damping * k + k * k
        b = (1.0 if high_pass else k * k) / a0
        sections.append(
            np.array([b, 2.0 * side * b, b, 1.0, 2.0 * (k * k - 1.0) / a0, (1.0 - damping * k + k * k) / a0])
        )
    if order % 2:
        b = (1.0 if high_pass else k) / (1.0 + k)
        sections.append(np.array([b, side * b, 0.0, 1.0, (k - 1.0) / (k + 1.0), 0.0]))
    return sections


def peaking(peak: Peak) -> NDArray[np.float64]:
    """R. Bristow-Johnson, "Cookbook formulae for audio EQ biquad filter coefficients": peakingEQ; shape (6,)."""
    omega = 2.0 * np.pi * peak.hz / SAMPLE_RATE_HZ
    alpha, gain = np.sin(omega) / (2.0 * peak.q), 10.0 ** (peak.gain_db / 40.0)
    a0 = 1.0 + alpha / gain
    b = [1.0 + alpha * gain, -2.0 * np.cos(omega), 1.0 - alpha * gain]
    return np.array([*(each / a0 for each in b), 1.0, -2.0 * np.cos(omega) / a0, (1.0 - alpha / gain) / a0])


IDEAL = Loudspeaker("ideal")
GOOD = Loudspeaker("good", 150.0, 2, 7000.0, 2)
"""A bookshelf box, or a good portable one."""
USUAL = Loudspeaker("usual", 200.0, 3, 6500.0, 2, (Peak(1000.0, 4.0, 1.5),), 0.01)
"""A small box with one driver of about 5 cm, as robots carry it: nothing below 200 Hz, one mild resonance."""
SMALL = Loudspeaker("small driver", 400.0, 4, 6000.0, 2, (Peak(900.0, 8.0, 2.0),))
"""A driver of 2 to 3 cm without a box to speak of, as on a sound HAT."""
SMALL_DISTORTING = Loudspeaker("small driver, 5 %", 400.0, 4, 6000.0, 2, (Peak(900.0, 8.0, 2.0),), 0.05)
