"""Statistics of steady noise in the front end, band by band: no spectrum of it, only how its energies spread.

`python -m benchmarks.fit --only steady_noise` measures them on 40 s of white noise (estimates good to about 1 %), so
whoever listens needs no generator of noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.fitted import fitted

PERCENTILE = 20.0
"""Low enough that speech present four fifths of the time leaves the estimate of the noise alone."""


@dataclass(frozen=True)
class SteadyNoise:
    """Statistics of the log energies of steady noise.

    `percentile_ratio`: PERCENTILE of a band's energies over their mean; `mean_log`, `std_log`: mean and standard
    deviation of the natural logarithm of energy over mean energy. All have shape (N_BANDS,).
    """

    percentile_ratio: NDArray[np.float32]
    mean_log: NDArray[np.float32]
    std_log: NDArray[np.float32]


def measured(energies: NDArray[np.float32]) -> SteadyNoise:
    """Statistics of steady noise whose mel energies have shape (frames, N_BANDS)."""
    mean = energies.mean(axis=0)
    logs = np.log(energies / mean)
    ratio = np.percentile(energies, PERCENTILE, axis=0) / mean
    return SteadyNoise(*(np.asarray(each, np.float32) for each in (ratio, logs.mean(axis=0), logs.std(axis=0))))


_WEIGHTS = fitted("steady_noise")["weights"]
STEADY_NOISE = SteadyNoise(
    *(np.array(_WEIGHTS[name], np.float32) for name in ("percentile_ratio", "mean_log", "std_log"))
)
