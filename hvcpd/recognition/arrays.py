"""Functions of NumPy that take less memory here: unique numbers, quantiles, and large arrays of zeros.

NumPy's own functions for the first two load its masked arrays, which keep 2 MB of memory for good.
"""

from __future__ import annotations

import math
import mmap
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray


def unique(numbers: NDArray[np.intp]) -> NDArray[np.intp]:
    """Each of some numbers, 0 or more, once, in ascending order, shape (n,); as `numpy.unique`."""
    ordered = np.sort(numbers, axis=None, kind="stable")
    return ordered[first_occurrences(ordered)]


def first_occurrences(ordered: NDArray[np.intp]) -> NDArray[np.intp]:
    """Where each of some numbers, 0 or more and in ascending order, comes first, shape (n,)."""
    return np.flatnonzero(np.diff(ordered, prepend=-1))


def quantile(values: NDArray[np.floating[Any]], share: float) -> float:
    """The value below which a share, 0 to 1, of all values lies, one or more, none NaN; as `numpy.quantile`."""
    ordered = np.sort(values, axis=None)
    place = (len(ordered) - 1) * share
    before = int(place)
    low, high = ordered[before], ordered[min(before + 1, len(ordered) - 1)]
    weight = place - before
    return float(high - (high - low) * (1 - weight) if weight >= 0.5 else low + (high - low) * weight)


def lazy_zeros(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """Zeros, on pages of their own, which take memory only where something was written to them.

    `numpy.zeros` has such pages only where the heap has no gap as large; in a gap it writes to all of it: 2 MB of
    a listening robot, for the back pointers and the scorer (six daemons, 68.0 to 69.0 MB instead of 70.1 to 70.8).
    """
    size = np.dtype(dtype).itemsize * math.prod(shape)
    pages = mmap.mmap(-1, max(size, 1), mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    return np.frombuffer(pages, dtype, math.prod(shape)).reshape(shape)
