"""Tracking the background noise while listening, and what steady noise looks like to the front end.

The noise in each band is a low percentile of the recent past, as in minimum statistics (R. Martin, "Noise power
spectral density estimation based on optimal smoothing and minimum statistics", IEEE Trans. SAP 9(5), 2001):
speech leaves gaps in every band, so its presence hardly moves that percentile.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.frontend import ENERGY_FLOOR, HOP_SAMPLES, N_BANDS, Energies, energies_of

PERCENTILE = 20.0
"""Low enough that speech present four fifths of the time leaves the estimate alone."""
MEMORY_FRAMES = 300
"""3 s: longer than any word, shorter than most sentences' stay."""
WARM_UP_FRAMES = 12
"""Fewer frames than this give no estimate (0.12 s)."""


@dataclass(frozen=True)
class SteadyNoise:
    """Statistics of the log energies of steady white noise, measured once through the same front end.

    `percentile_ratio`: PERCENTILE of a band's energies over their mean; `mean_log`, `std_log`: mean and standard
    deviation of the natural logarithm of energy over mean energy. All have shape (N_BANDS,).
    """

    percentile_ratio: NDArray[np.float32]
    mean_log: NDArray[np.float32]
    std_log: NDArray[np.float32]


@lru_cache(maxsize=1)
def steady_noise() -> SteadyNoise:
    """Measure `SteadyNoise` on 40 s of seeded white noise (estimates good to about 1 %)."""
    noise = np.random.default_rng(1).standard_normal(4000 * HOP_SAMPLES).astype(np.float32)
    energies = energies_of(noise)
    mean = energies.mean(axis=0)
    logs = np.log(energies / mean)
    ratio = np.percentile(energies, PERCENTILE, axis=0) / mean
    return SteadyNoise(ratio.astype(np.float32), logs.mean(axis=0), logs.std(axis=0))


class NoiseTracker:
    """Estimates the mean noise energy of each band from the last seconds of sound."""

    def __init__(self) -> None:
        self._ring = np.zeros((MEMORY_FRAMES, N_BANDS), np.float32)
        self._filled = 0
        self._next = 0
        self._steady = steady_noise()
        self.estimate: NDArray[np.float32] = np.full(N_BANDS, ENERGY_FLOOR, np.float32)
        """Mean noise energy a band, shape (N_BANDS,), linear power."""

    @property
    def ready(self) -> bool:
        """Whether enough has been heard for an estimate."""
        return self._filled >= WARM_UP_FRAMES

    def push(self, energies: Energies) -> None:
        """Remember frames of shape (n, N_BANDS), n at most MEMORY_FRAMES, and renew the estimate."""
        for row in energies:
            self._ring[self._next] = row
            self._next = (self._next + 1) % MEMORY_FRAMES
        self._filled = min(self._filled + len(energies), MEMORY_FRAMES)
        if self.ready:
            self._renew()

    def _renew(self) -> None:
        rank = int(PERCENTILE / 100.0 * (self._filled - 1))
        low = np.partition(self._ring[: self._filled], rank, axis=0)[rank]
        np.maximum(low / self._steady.percentile_ratio, ENERGY_FLOOR, out=self.estimate)

    def restart_from(self, energies: Energies) -> None:
        """Forget the past and take `energies` (frames known to be steady noise) for the present."""
        self._filled = 0
        self._next = 0
        self.push(energies)
