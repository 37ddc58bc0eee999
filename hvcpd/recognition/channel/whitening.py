"""Whitening: weights that make all noise alike, and count what is louder than the noise for little.

A cell of the short-time spectrum that is much louder than the noise may be the voice, its echoes, or a plate that is
put down: so it counts little more than one that is as loud as the noise. As whitening by the phase transform in an
echoing room (C. Knapp & G. Carter, "The generalized correlation method for estimation of time delay", IEEE Trans. ASSP
24(4), 1976), but cell by cell, so that a sound at some frequencies leaves the others as they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.arrays import quantile
from hvcpd.recognition.frontend import SILENT_POWER, TINY, frames_of, power_ratio, rfft

FRAME = 1024
BINS = FRAME // 2 + 1
BAND_HZ = (100.0, 7600.0)
"""Band that counts: rumble lies below it, and converters' filters differ above it."""
LATE_ECHO_SHARE = 0.3
"""Share of the received spectrum that counts as noise: late echoes, which no short response explains."""
EMPTY_SHARE = power_ratio(-35.0)
"""Power of a bin relative to that of bins of LOUD_QUANTILE below which it counts nothing: whitened, the empty
bands of a narrow microphone outweigh all others, and any voice seems to be a robot's (docs/decisions/channel.md)."""
LOUD_QUANTILE = 0.75
"""A hum does not change it, and a band up to 3.4 kHz suffices for it."""

CELL = 512
"""Samples (32 ms) of a cell: as long as a response."""
CELL_STEP = CELL // 4
CELL_BINS = 4
"""Bins of a cell, 125 Hz: about the width of a formant."""
CELLS = -(-(CELL // 2 + 1) // CELL_BINS)
"""Number of cells from 0 to 8 kHz."""
CELL_LOUD = 6.0
"""Ratio to the noise's power above which a cell is weighted by its own power."""
CELL_FLOOR = 0.02
"""Least noise of a cell, as a share of the mean power of what was heard (-17 dB): what no short response explains. With
1e-6 all cells of a voice in a quiet room counted alike, and sealed sentences were lost; with 0.003, 0.01 and 0.05 the
likeliest of 88 sentences in kitchens and eight other worlds were right in 80."""

_HANN = np.hanning(FRAME).astype(np.float32)
_CELL_WINDOW = np.hanning(CELL + 1)[:-1].astype(np.float32)

Spectrum = NDArray[np.float32]


def transform_size(n: int) -> int:
    """The least size of at least `n` samples whose transform is quick: 2^k, or 5/4 or 3/2 of it."""
    power = 1 << max(n - 1, 1).bit_length()
    return next(size for size in (power * 5 // 8, power * 3 // 4, power) if size >= n)


def inverse_spectrum(heard: Samples, noise: Samples) -> NDArray[np.float64]:
    """One over the power of the noise and of late echoes, at BINS frequencies; 0 outside BAND_HZ and in empty bands."""
    alone = moving_average(power_spectra(noise).mean(axis=0), 3)
    received = moving_average(power_spectra(heard).mean(axis=0), 6)
    hz = np.linspace(0.0, SAMPLE_RATE_HZ / 2, BINS)
    within = (hz >= BAND_HZ[0]) & (hz <= BAND_HZ[1])
    counts = within & (received >= EMPTY_SHARE * quantile(received[within], LOUD_QUANTILE))
    return np.where(counts, 1.0 / (alone + LATE_ECHO_SHARE * received + SILENT_POWER), 0.0)


def cell_weights(heard: Samples, noise: Samples, inverse: NDArray[np.float64]) -> Spectrum:
    """The weight, at most 1, of each cell of `heard`, shape (n, CELLS): cell k is around sample CELL_STEP k. Less where
    the whitened sound is louder than the whitened noise."""
    power = _cell_powers(heard, inverse)
    alone = _cell_powers(noise, inverse)
    usual = np.partition(alone, len(alone) // 2, axis=0)[len(alone) // 2]
    floor = np.maximum(usual, CELL_FLOOR * float(power.mean()) + TINY)
    return np.asarray((1.0 + power / (CELL_LOUD * floor)) ** -0.5, np.float32)


def with_cell_weights(sound: Samples, weights: Spectrum) -> Samples:
    """A sound, shape (n,), with its cells weighted."""
    spectra = _cell_spectra(sound)
    spectra *= np.repeat(weights, CELL_BINS, axis=1)[:, : CELL // 2 + 1]
    parts = np.fft.irfft(spectra, CELL).reshape(len(spectra), -1, CELL_STEP)
    out = np.zeros((len(parts) + parts.shape[1], CELL_STEP), np.float32)
    overlap = np.zeros_like(out)
    for k, window in enumerate(_CELL_WINDOW.reshape(-1, CELL_STEP)):
        out[k : k + len(parts)] += parts[:, k]
        overlap[k : k + len(parts)] += window
    seen = slice(CELL // 2, CELL // 2 + len(sound))
    return np.asarray(out.reshape(-1)[seen] / overlap.reshape(-1)[seen], np.float32)


def _cell_spectra(sound: Samples) -> NDArray[np.complex64]:
    return rfft(frames_of(np.pad(sound, (CELL // 2, CELL)), CELL, CELL_STEP) * _CELL_WINDOW)


def _cell_powers(sound: Samples, inverse: NDArray[np.float64]) -> Spectrum:
    """The mean power of each whitened cell and its neighbours, shape (n, CELLS)."""
    spectra = _cell_spectra(sound)
    power = (spectra.real**2 + spectra.imag**2) * interpolated(inverse, CELL)
    power = np.pad(power, ((0, 0), (0, CELLS * CELL_BINS - power.shape[1])), mode="edge")
    power = power.reshape(len(power), CELLS, CELL_BINS).mean(axis=2)
    around = np.pad(power, 1, mode="edge")
    across = (around[:-2] + 2.0 * around[1:-1] + around[2:]) / 4.0
    return np.asarray((across[:, :-2] + 2.0 * across[:, 1:-1] + across[:, 2:]) / 4.0, np.float32)


def interpolated(spectrum: NDArray[np.floating], size: int) -> Spectrum:
    """A spectrum of BINS at the bins of a transform of `size` samples."""
    at = np.linspace(0.0, BINS - 1.0, size // 2 + 1)
    return np.asarray(np.interp(at, np.arange(BINS), spectrum), np.float32)


def filtered(sound: Samples, gains: NDArray[np.floating]) -> Samples:
    """A sound through a filter of these gains at BINS frequencies, without delay."""
    size = transform_size(len(sound) + FRAME)
    return np.asarray(np.fft.irfft(rfft(sound, size) * interpolated(gains, size), size)[: len(sound)])


def power_spectra(sound: Samples) -> Spectrum:
    """Power at BINS frequencies in frames of FRAME samples, half a frame apart (for Welch's method), shape (frames,
    BINS)."""
    padded = np.pad(sound, (0, max(FRAME - len(sound), 0)))
    spectra = rfft(frames_of(padded, FRAME, FRAME // 2) * _HANN)
    return np.asarray((spectra.real**2 + spectra.imag**2) / np.square(_HANN).sum(), np.float32)


def moving_average(values: NDArray[np.floating], reach: int) -> NDArray[np.float64]:
    """The mean over `reach` neighbours on either side."""
    return np.convolve(np.pad(values, reach, mode="edge"), np.full(2 * reach + 1, 1.0 / (2 * reach + 1)), "valid")
