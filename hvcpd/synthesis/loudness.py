"""Loudness by ITU-R BS.1770-4 for sound at 16 kHz: K-weighting, 400 ms blocks, absolute and relative gates.

BS.1770 gives its two filters as coefficients for 48 kHz. Here they are designed anew for our rate by the bilinear
transform from the analogue filters behind them (a high shelf of 4 dB at 1682 Hz and a high-pass at 38 Hz), as De Man
("Evaluation of implementations of the EBU R128 loudness measurement", AES 145, 2018) describes.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

SILENCE_LUFS = -70.0
"""BS.1770's absolute gate: blocks below count as silence."""

RELATIVE_GATE_LU = 10.0
"""Blocks that lie further below the mean of all that pass the absolute gate do not count."""

BLOCK_SAMPLES = SAMPLE_RATE_HZ * 2 // 5
STEP_SAMPLES = BLOCK_SAMPLES // 4
"""Blocks of 400 ms overlap by 75 %."""

_OFFSET_LU = -0.691
"""BS.1770: makes the loudness of a 997 Hz sine its level."""

_SHELF_HZ, _SHELF_Q, _SHELF_DB = 1681.974450955533, 0.7071752369554196, 3.999843853973347
_HIGH_PASS_HZ, _HIGH_PASS_Q = 38.13547087602444, 0.5003270373238773
_RING_SAMPLES = SAMPLE_RATE_HZ // 4
"""The high-pass has died away by more than 100 dB after a quarter of a second."""
_LARGEST_FFT = 1 << 14
"""Longer sounds are filtered part by part: the weights of each size are kept, and those of a sentence took 0.5 MB."""


def k_weighting(hz: NDArray[np.float64]) -> NDArray[np.complex128]:
    """The response of both filters at those frequencies; same shape."""
    z1 = np.exp(-2j * np.pi * hz / SAMPLE_RATE_HZ)
    k = np.tan(np.pi * _SHELF_HZ / SAMPLE_RATE_HZ)
    high = 10.0 ** (_SHELF_DB / 20.0)
    middle = high**0.4996667741545416
    shelf = (high + middle * k / _SHELF_Q + k * k) + 2.0 * (k * k - high) * z1
    shelf = shelf + (high - middle * k / _SHELF_Q + k * k) * z1 * z1
    shelf /= (1.0 + k / _SHELF_Q + k * k) + 2.0 * (k * k - 1.0) * z1 + (1.0 - k / _SHELF_Q + k * k) * z1 * z1
    k = np.tan(np.pi * _HIGH_PASS_HZ / SAMPLE_RATE_HZ)
    a0 = 1.0 + k / _HIGH_PASS_Q + k * k
    passing = (1.0 - z1) ** 2
    passing /= 1.0 + 2.0 * (k * k - 1.0) / a0 * z1 + (1.0 - k / _HIGH_PASS_Q + k * k) / a0 * z1 * z1
    return np.asarray(shelf * passing)


def _fft_size(least: int) -> int:
    """The next four, five or six times a power of two: little is padded, and the sizes, whose weights are kept, are
    few."""
    octave = 1 << max(least - 1, 4).bit_length() - 3
    return -(-least // octave) * octave if least <= 6 * octave else 8 * octave


@lru_cache(maxsize=8)
def _weights(size: int) -> NDArray[np.complex128]:
    """The response at the bins of a real FFT of that size; words and sentences need few sizes."""
    return k_weighting(np.arange(size // 2 + 1, dtype=np.float64) * (SAMPLE_RATE_HZ / size))


def _weighted(sound: Samples) -> NDArray[np.float64]:
    """The sound through both filters, shape (n,); a long one part by part, by overlap-save (A. Oppenheim & R. Schafer,
    "Discrete-Time Signal Processing", ch. 8)."""
    size = _fft_size(len(sound) + _RING_SAMPLES)
    if size <= _LARGEST_FFT:
        return _filtered(sound, size)[: len(sound)]
    padded = np.concatenate((np.zeros(_RING_SAMPLES, np.float32), sound))
    begins = range(0, len(sound), _LARGEST_FFT - _RING_SAMPLES)
    parts = [_filtered(padded[at : at + _LARGEST_FFT], _LARGEST_FFT)[_RING_SAMPLES:] for at in begins]
    return np.concatenate(parts)[: len(sound)]


def _filtered(sound: Samples, size: int) -> NDArray[np.float64]:
    return np.fft.irfft(np.fft.rfft(sound.astype(np.float64), size) * _weights(size), size)


def loudness_lufs(sound: Samples) -> float:
    """Integrated loudness of a sound, shape (n,); `SILENCE_LUFS` for silence.

    A sound shorter than a block counts as one block of its own length: BS.1770 says nothing of those.
    """
    if not len(sound):
        return SILENCE_LUFS
    sums = np.concatenate(([0.0], np.cumsum(_weighted(sound) ** 2)))
    length = min(BLOCK_SAMPLES, len(sound))
    starts = np.arange(0, len(sound) - length + 1, STEP_SAMPLES)
    power = (sums[starts + length] - sums[starts]) / length
    power = power[power > 10.0 ** ((SILENCE_LUFS - _OFFSET_LU) / 10.0)]
    if not len(power):
        return SILENCE_LUFS
    power = power[power > power.mean() * 10.0 ** (-RELATIVE_GATE_LU / 10.0)]
    return float(_OFFSET_LU + 10.0 * np.log10(power.mean()))
