"""Paths with fewer points that still tell where a robot was, and when."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.reporting.events import Trail

TOLERANCE_M = 0.02
"""Less than the width of the line that is drawn."""


def simplified(trail: Trail, tolerance_m: float = TOLERANCE_M) -> Trail:
    """The trail by some of its points, first and last among them; what is not finite is left out.

    Douglas & Peucker's method (1973) with the synchronous distance of Meratnia & de By (2004): between two kept points
    every dropped one lies within `tolerance_m` of where steady motion would have had it *at its time*.
    """
    points = np.stack([trail.t_s, trail.x_m, trail.y_m]).astype(np.float64)
    points = points[:, np.all(np.isfinite(points), axis=0)]
    kept = _kept(points, tolerance_m)
    return Trail(trail.robot, points[0, kept], points[1, kept], points[2, kept])


def _kept(points: NDArray[np.float64], tolerance_m: float) -> NDArray[np.intp]:
    n = points.shape[1]
    keep = np.zeros(n, dtype=bool)
    if n:
        keep[[0, -1]] = True
    open_ends = [(0, n - 1)]
    while open_ends:
        first, last = open_ends.pop()
        if last - first < 2:
            continue
        far = _off_m(points[:, first : last + 1])
        worst = int(np.argmax(far))
        if far[worst] > tolerance_m:
            keep[first + worst] = True
            open_ends += [(first, first + worst), (first + worst, last)]
    return np.flatnonzero(keep)


def _off_m(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far each point is from the straight, steady way between the first and the last, m."""
    t, places = points[0], points[1:]
    length_s = t[-1] - t[0]
    share = (t - t[0]) / length_s if length_s > 0 else np.zeros_like(t)
    steady = places[:, :1] + share * (places[:, -1:] - places[:, :1])
    off: NDArray[np.float64] = np.hypot(*(places - steady))
    off[[0, -1]] = 0.0
    return off


def length_m(trail: Trail) -> float:
    """How far the robot went."""
    return float(np.sum(np.hypot(np.diff(trail.x_m), np.diff(trail.y_m))))
