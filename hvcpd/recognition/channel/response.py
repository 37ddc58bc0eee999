"""Least-squares estimate of the response between a known signal and the received sound."""

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
    """`responses` of one signal, shape (n,)."""
    taps: Taps = responses(autocorrelation[None], correlation[None], n)[0]
    return taps


def responses(autocorrelations: Taps, correlations: Taps, n: int) -> Taps:
    """For each of several signals s, the `n` taps h that minimise |x - h*s|² + ridge·|h|², shape (m, n), float32.

    `autocorrelations` of s, shape (m, ≥ n), and `correlations` of x with s at lags from 0, shape (m, ≥ n), both over
    noise of variance 1. The ridge is the noise's variance over the mean square of a tap, as a Gaussian prior has it: in
    a band in which s has nothing, the response stays near 0. Solves the Toeplitz systems by conjugate gradients with a
    circulant preconditioner (T. Chan, "An optimal circulant preconditioner for Toeplitz systems", SIAM J. Sci. Stat.
    Comput. 9, 1988).
    """
    p = np.ascontiguousarray(correlations[:, :n], np.float32)
    column = np.zeros((len(p), 2 * n), np.float32)
    column[:, :n] = autocorrelations[:, :n]
    column[:, n + 1 :] = column[:, n - 1 : 0 : -1]
    energy = np.maximum(column[:, 0], np.float32(1e-9))
    explained = np.maximum(_products(p, p) / energy, 1.0)
    ridge = (energy * np.clip(n / explained, LEAST_RIDGE, MOST_RIDGE)).astype(np.float32)[:, None]
    column[:, :1] += ridge
    spectrum = np.asarray(np.fft.rfft(column).real, np.float32)
    weight = np.arange(n, dtype=np.float32) / n
    around = (1.0 - weight) * column[:, :n]
    around[:, 1:] += weight[1:] * column[:, n - 1 : 0 : -1]
    smooth = np.asarray(np.maximum(np.fft.rfft(around).real, 0.1 * ridge), np.float32)
    return _solved(spectrum, smooth, p)


def _solved(spectrum: Taps, smooth: Taps, p: Taps) -> Taps:
    """Conjugate gradients; `spectrum` of the circulant matrices that hold the Toeplitz ones, `smooth` of the nearest.
    All rows at once, until the last of them is close."""
    n = p.shape[1]
    h = np.zeros_like(p)
    left = p.copy()
    z = _conditioned(left, smooth)
    direction, rho = z, _products(left, z)
    goal = _CLOSE**2 * _products(p, p)
    for _ in range(_STEPS):
        going = (_products(left, left) > goal) & (rho > 0.0)
        if not going.any():
            break
        image = np.asarray(np.fft.irfft(np.fft.rfft(direction, 2 * n) * spectrum, 2 * n)[:, :n], np.float32)
        alpha = np.where(going, rho / np.maximum(_products(direction, image), 1e-30), 0.0).astype(np.float32)[:, None]
        h += alpha * direction
        left -= alpha * image
        z = _conditioned(left, smooth)
        before, rho = rho, _products(left, z)
        direction = z + np.where(going, rho / np.maximum(before, 1e-30), 0.0).astype(np.float32)[:, None] * direction
    return h


def _conditioned(left: Taps, smooth: Taps) -> Taps:
    return np.asarray(np.fft.irfft(np.fft.rfft(left) / smooth, left.shape[1]), np.float32)


def _products(a: Taps, b: Taps) -> NDArray[np.float64]:
    """The inner products of the rows."""
    return np.asarray(np.einsum("ij,ij->i", a, b), np.float64)
