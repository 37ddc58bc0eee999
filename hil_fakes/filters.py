"""Recursive filters in numpy alone, so that a mission can be simulated without scipy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

NEGLIGIBLE = 1e-18
"""A share of a sample, far below the last bit of a double, that need not be added."""


def one_pole(x: NDArray[np.float64], pole: float, before: float = 0.0) -> NDArray[np.float64]:
    """Return y[n] = x[n] + pole * y[n - 1], shape (n,), float64, for x of that shape; y[-1] is `before`.

    `pole` lies between 0 and 1. By recursive doubling (Kogge & Stone, IEEE Trans. Computers C-22, 1973): after k steps
    every output holds the last 2^k inputs.
    """
    y = x.copy()
    if len(y):
        y[0] += pole * before
    shift, weight = 1, pole
    while shift < len(y) and weight > NEGLIGIBLE:
        y[shift:] += weight * y[:-shift]
        shift, weight = 2 * shift, weight * weight
    return y
