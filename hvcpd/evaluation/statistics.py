"""Shares and pivotal distances, with their intervals. Pure arithmetic; every interval is of 95 %."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Z = 1.959964
"""Quantile of the normal distribution for a two-sided interval of 95 %."""
CHI2 = Z * Z
"""95 % point of the chi-squared distribution with one degree of freedom."""
STEEPNESS = np.concatenate([np.geomspace(0.01, 0.4, 12), np.geomspace(0.5, 100.0, 48)])
"""Slopes that are tried: the change of the logit while the distance grows by a factor of e. 0.01 is flat, 100 is a
cliff: from 99 to 1 % within a tenth of the distance."""
FINE = 600
"""Pivotal points that are tried."""
BEYOND = 2.0
"""Factor by which the pivotal distances tried reach nearer and farther than the measured ones."""


def wilson(right: int, n: int) -> tuple[float, float]:
    """95 % confidence interval of a share (E. B. Wilson, JASA 22, 1927); (0, 1) for n = 0."""
    if n == 0:
        return 0.0, 1.0
    p, z2 = right / n, Z * Z
    centre = p + z2 / (2 * n)
    half = Z * math.sqrt(p * (1.0 - p) / n + z2 / (4.0 * n * n))
    low, high = ((centre + sign * half) / (1.0 + z2 / n) for sign in (-1.0, 1.0))
    return max(low, 0.0), min(high, 1.0)


@dataclass(frozen=True)
class Step:
    """At `at` (m, or dB as a positive factor), `right` of `n` trials succeeded."""

    at: float
    right: int
    n: int
    wrong: int = 0
    """Of those that did not, how many gave a wrong result instead of none."""

    @property
    def shares(self) -> tuple[float, ...]:
        """The share of those that succeeded and its interval, as tables have them."""
        return tuple(round(x, 4) for x in (self.right / self.n, *wilson(self.right, self.n)))


@dataclass(frozen=True)
class Pivot:
    """The distance at which half of the trials succeed, and its confidence interval: from 0 or to infinity where the
    trials do not bound it.

    `sign` is "<" or ">" where all that was tried lies on one side of it: `at` is then the interval's other end.
    """

    at: float
    low: float
    high: float
    sign: str = ""

    @property
    def bounded(self) -> bool:
        """Whether the trials carry any information about that point."""
        return self.low > 0.0 or not math.isinf(self.high)

    def text(self, unit: str = "m", digits: int = 2) -> str:
        """As text: "1.23 m (95 %: 1.10 to 1.40 m)", or "> 20 m"."""
        low, high = (f"{end:.{digits}f}" for end in (self.low, self.high))
        if not self.bounded:
            return f"? {unit} (these trials do not tell)"
        if self.sign:
            return f"{self.sign} {self.at:.{digits}f} {unit}"
        interval = f"{low} to {high} {unit}"
        if math.isinf(self.high):
            interval = f"{low} {unit} and more"
        elif self.low == 0.0:
            interval = f"{high} {unit} and less"
        return f"{self.at:.{digits}f} {unit} (95 %: {interval})"


def pivot(steps: Sequence[Step]) -> Pivot:
    """The 50 % point of the logistic curve in log distance that is likeliest, falling with distance.

    Its interval is of the profile likelihood (Venzon & Moolgavkar, Applied Statistics 37, 1988), which stands where a
    cliff leaves the slope without bound and an estimate by the curvature without sense. Raises ValueError without two
    distances.
    """
    ordered = sorted(steps, key=lambda s: s.at)
    if len({s.at for s in ordered}) < 2:
        raise ValueError("a pivotal point needs trials at two distances at least")
    near, far = ordered[0].at, ordered[-1].at
    points = np.geomspace(near / BEYOND, far * BEYOND, FINE)
    profile = _profile(ordered, points)
    best = int(np.argmax(profile))
    inside = np.flatnonzero(2.0 * (profile[best] - profile) <= CHI2)
    # a step farther to be safe; infinite where it leaves the grid
    low = float(points[inside[0] - 1]) if inside[0] > 0 else 0.0
    high = float(points[inside[-1] + 1]) if inside[-1] < FINE - 1 else math.inf
    at = float(points[best])
    if at > far and all(2 * s.right >= s.n for s in ordered):
        return Pivot(low, low, math.inf, ">")
    if at < near and all(2 * s.right <= s.n for s in ordered):
        return Pivot(high, 0.0, high, "<")
    return Pivot(at, low, high)


def _profile(steps: Sequence[Step], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """For each point the log likelihood with the best slope."""
    x = np.log([s.at for s in steps])
    right = np.array([s.right for s in steps], np.float64)
    wrong = np.array([s.n - s.right for s in steps], np.float64)
    away = x[None, None, :] - np.log(points)[:, None, None]
    logit = -STEEPNESS[None, :, None] * away
    # log p = -log(1 + exp(-logit)), log(1 - p) = log p - logit
    best: NDArray[np.float64] = -((right + wrong) * np.logaddexp(0.0, -logit) + wrong * logit).sum(axis=2).min(axis=1)
    return best
