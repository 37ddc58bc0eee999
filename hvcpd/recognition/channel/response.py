"""Least-squares estimate of the response between a known signal and what was heard of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Taps = NDArray[np.float32]

LEAST_RIDGE, MOST_RIDGE = 2e-3, 0.3
"""Bounds of the ridge, as a share of the known signal's energy."""
_STEPS = 40
_CLOSE = 1e-3
"""Conjugate gradients end here: relative residual. The estimate's own error is far larger."""


def transform_size(n: int) -> int:
    """The least size of at least `n` samples whose transform is quick: 2^k, or 5/4 or 3/2 of it."""
    power = 1 << max(n - 1, 1).bit_length()
    return next(size for size in (power * 5 // 8, power * 3 // 4, power) if size >= n)


def response(autocorrelation: Taps, correlation: Taps, n: int) -> Taps:
    """The `n` taps h that minimise |x - h*s|² + ridge·|h|², shape (n,), float32.

    `autocorrelation` of s, shape (≥ n,), and `correlation` of x with s at lags from 0, shape (≥ n,), both over noise of
    variance 1. The ridge is the noise's variance over the mean square of a tap, as a Gaussian prior has it: in a band
    in which s has nothing, the response stays near 0. Solves the Toeplitz system by conjugate gradients with a
    circulant preconditioner (T. Chan, "An optimal circulant preconditioner for Toeplitz systems", SIAM J. Sci. Stat.
    Comput. 9, 1988).
    """
    p = correlation[:n]
    column = np.zeros(2 * n, np.float32)
    column[:n] = autocorrelation[:n]
    column[n + 1 :] = column[n - 1 : 0 : -1]
    spectrum = np.fft.rfft(column).real
    energy = max(float(autocorrelation[0]), 1e-9)
    explained = max(float(p @ p) / energy, 1.0)
    ridge = energy * min(max(n / explained, LEAST_RIDGE), MOST_RIDGE)
    column[0] += ridge
    spectrum = spectrum + ridge
    weight = np.arange(n, dtype=np.float32) / n
    around = (1.0 - weight) * column[:n]
    around[1:] += weight[1:] * column[n - 1 : 0 : -1]
    smooth = np.maximum(np.fft.rfft(around).real, 0.1 * ridge)
    return _solved(spectrum, smooth, p)


def _solved(spectrum: NDArray[np.floating], smooth: NDArray[np.floating], p: NDArray[np.floating]) -> Taps:
    """Conjugate gradients; `spectrum` of the circulant matrix that holds the Toeplitz one, `smooth` of the nearest."""
    n = len(p)
    h: NDArray[np.floating] = np.zeros(n, np.float32)
    left: NDArray[np.floating] = p.copy()
    z = np.fft.irfft(np.fft.rfft(left) / smooth, n)
    direction, rho = z, float(left @ z)
    goal = _CLOSE**2 * float(p @ p)
    for _ in range(_STEPS):
        if float(left @ left) <= goal or rho <= 0.0:
            break
        image = np.fft.irfft(np.fft.rfft(direction, 2 * n) * spectrum, 2 * n)[:n]
        alpha = rho / max(float(direction @ image), 1e-30)
        h = h + alpha * direction
        left = left - alpha * image
        z = np.fft.irfft(np.fft.rfft(left) / smooth, n)
        before, rho = rho, float(left @ z)
        direction = z + (rho / before) * direction
    return np.asarray(h, np.float32)
