"""Distinct numbers, medians and quantiles, to the bit as NumPy has them.

NumPy's own functions for these load its masked arrays, which keep 2 MB of memory for good.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def distinct(numbers: NDArray[np.intp]) -> NDArray[np.intp]:
    """Each of some numbers, 0 or more, once, in ascending order, shape (n,); as `numpy.unique`."""
    ordered = np.sort(numbers, axis=None, kind="stable")
    return ordered[first_of_each(ordered)]


def first_of_each(ordered: NDArray[np.intp]) -> NDArray[np.intp]:
    """Where each of some numbers, 0 or more and in ascending order, comes first, shape (n,)."""
    return np.flatnonzero(np.diff(ordered, prepend=-1))


def median(values: NDArray[np.floating[Any]]) -> float:
    """The median of all values, at least one, none of them NaN; as `numpy.median`."""
    ordered = np.sort(values, axis=None)
    middle = len(ordered) // 2
    return float(ordered[middle] if len(ordered) % 2 else (ordered[middle - 1] + ordered[middle]) / 2)


def quantile(values: NDArray[np.floating[Any]], share: float) -> float:
    """The value below which there is a share, 0 to 1, of all values, interpolated, likewise; as `numpy.quantile`."""
    ordered = np.sort(values, axis=None)
    place = (len(ordered) - 1) * share
    before = int(place)
    low, high = ordered[before], ordered[min(before + 1, len(ordered) - 1)]
    weight = place - before
    return float(high - (high - low) * (1 - weight) if weight >= 0.5 else low + (high - low) * weight)
