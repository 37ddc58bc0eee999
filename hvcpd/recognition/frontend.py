"""The front end: sound to mel filterbank energies to cepstra (MFCC) with deltas.

Davis & Mermelstein, "Comparison of parametric representations for monosyllabic word recognition", IEEE Trans. ASSP
28(4), 1980. The energies stay linear until the last step, so that noise can be added to a template (`templates`).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

Energies = NDArray[np.float32]
"""Mel filterbank energies, shape (frames, N_BANDS), float32, linear power."""
Features = NDArray[np.float32]
"""Weighted cepstra and deltas, shape (frames, N_FEATURES), float32; the Euclidean distance between two rows counts."""

HOP_SAMPLES = 160
"""10 ms between frames: the usual step of MFCC front ends."""
WINDOW_SAMPLES = 400
"""25 ms a frame: two to three pitch periods of a low voice (the usual choice)."""
FFT_SIZE = 512
"""The next power of two above the window."""
N_BANDS = 24
"""Triangular filters from LOW_HZ to HIGH_HZ, about one critical band each."""
LOW_HZ = 150.0
"""Below it are mains hum and rumble; small loudspeakers radiate nothing there."""
HIGH_HZ = 7000.0
"""Above it an anti-aliasing filter may already fall."""
HARMONICS_HZ = 250.0
"""A filter's least width to either side: the pitch of the highest voices, so that a band's energy hardly depends on
where their harmonics lie."""
RUMBLE_HZ = 80.0
"""Wide low filters end here: below are mains hum and footsteps."""
MEL_BREAK_HZ = 700.0
"""The mel scale is about linear below and logarithmic above it (D. O'Shaughnessy, "Speech Communication", 1987)."""
N_CEPSTRA = 13
"""c0 to c12: the spectral envelope without the pitch's ripples."""
N_FEATURES = 2 * N_CEPSTRA
DELTA_REACH = 2
"""Frames to either side in the regression for deltas; also the front end's look-ahead."""
ENERGY_FLOOR = np.float32(1e-7)
"""Added to each energy: about the power of 16-bit rounding noise (-101 dBFS) in a band, window and FFT included."""

SILENT_POWER = 1e-12
"""Power of a sample (-120 dBFS) that nobody hears: less counts as this much where something is divided by it."""
TINY = 1e-20
"""Divisors are at least this much, where what is divided is 0 with them."""

CONTEXT_FRAMES = DELTA_REACH + 1
"""Neighbours to either side that the features of a frame need: one to smooth, the rest for deltas."""
SMOOTH_SIDE = np.float32(0.25)
"""Weight of the neighbours in `smoothed`."""

C0_WEIGHT = 0.3
"""Loudness counts less than the shape of the spectrum: the level of a word varies with distance and stress."""
LIFTER = 22
"""Length of the sine lifter that balances low and high cepstra (HTK's customary value)."""
DELTA_WEIGHT = 3.0
"""Deltas per frame are about a third of the cepstra's spread."""


def frame_powers(sound: Samples, size: int) -> NDArray[np.float64]:
    """The mean power of each whole frame of `size` samples of a sound, shape (n,)."""
    frames = sound[: len(sound) // size * size].reshape(-1, size)
    return np.asarray(np.square(frames, dtype=np.float64).mean(axis=1))


def power_ratio(db: float) -> float:
    """The ratio of two powers whose levels differ by `db` decibels."""
    return float(10.0 ** (db / 10.0))


def decibels(ratio: float) -> float:
    """Ten times the decimal logarithm of a ratio of powers, above 0."""
    return 10.0 * math.log10(ratio)


def mel_edges_hz(low_hz: float, high_hz: float, n_bands: int) -> NDArray[np.float64]:
    """Corners of `n_bands` overlapping triangular filters, evenly spaced on the mel scale, shape (n_bands + 2,)."""
    low, high = (1.0 + hz / MEL_BREAK_HZ for hz in (low_hz, high_hz))
    return np.asarray(MEL_BREAK_HZ * (np.geomspace(low, high, n_bands + 2) - 1.0))


def mel_filterbank() -> NDArray[np.float32]:
    """Triangular filters of unit height on the mel scale, shape (FFT_SIZE // 2 + 1, N_BANDS)."""
    edges_hz = mel_edges_hz(LOW_HZ, HIGH_HZ, N_BANDS)
    bins_hz = np.fft.rfftfreq(FFT_SIZE, 1.0 / SAMPLE_RATE_HZ)[:, None]
    rising = (bins_hz - edges_hz[1:-1]) / np.maximum(edges_hz[1:-1] - edges_hz[:-2], HARMONICS_HZ) + 1.0
    falling = (edges_hz[1:-1] - bins_hz) / np.maximum(edges_hz[2:] - edges_hz[1:-1], HARMONICS_HZ) + 1.0
    audible = bins_hz >= RUMBLE_HZ
    return np.asarray(np.clip(np.minimum(rising, falling), 0.0, None) * audible, np.float32)


def cepstral_transform() -> NDArray[np.float32]:
    """The orthonormal DCT-II of the log energies with the lifter's weights, shape (N_BANDS, N_CEPSTRA)."""
    order = np.arange(N_CEPSTRA)
    basis = np.cos(np.pi * order * (np.arange(N_BANDS)[:, None] + 0.5) / N_BANDS) * np.sqrt(2.0 / N_BANDS)
    basis[:, 0] /= np.sqrt(2.0)
    weight = 1.0 + LIFTER / 2.0 * np.sin(np.pi * order / LIFTER)
    weight /= weight[1:].mean()
    weight[0] = C0_WEIGHT
    return np.asarray(basis * weight, np.float32)


def power_weights() -> NDArray[np.float32]:
    """A weight for each band, its mean share where bands overlap, shape (N_BANDS,).

    The weighted sum of a frame's energies is about its power between RUMBLE_HZ and HIGH_HZ.
    """
    filters = mel_filterbank()
    share = 1.0 / np.maximum(filters.sum(axis=1), 1.0)
    return np.asarray(share @ filters / filters.sum(axis=0), np.float32)


def rfft(signals: NDArray[np.floating], size: int | None = None) -> NDArray[np.complex64]:
    """Transform of real signals, shape (..., n), along the last axis, in single precision.

    numpy (2.4) computes a forward transform in double precision unless it scales the result. That takes twice to four
    times as long.
    """
    n = size or signals.shape[-1]
    out = np.fft.rfft(signals, n, norm="forward").astype(np.complex64, copy=False)
    out *= np.float32(n)
    return out


def frames_of(sound: NDArray[Any], size: int, hop: int) -> NDArray[Any]:
    """The frames of `size` samples, from every `hop`-th on, of a sound of one frame at least, shape (n, size): a view,
    as from sliding_window_view but with much less Python."""
    n, step = 1 + (len(sound) - size) // hop, sound.strides[0]
    return np.ndarray((n, size), sound.dtype, sound, 0, (hop * step, step))


FRAMES_AT_ONCE = 200
"""2 s: spectra of longer sounds would only take memory."""
_WINDOW = np.hamming(WINDOW_SAMPLES).astype(np.float32)
_FILTERS = mel_filterbank()
_TRANSFORM = cepstral_transform()


def energies_of(samples: Samples) -> Energies:
    """Mel energies of every whole frame in `samples`, shape (frames, N_BANDS); zero rows when it is too short."""
    if samples.size < WINDOW_SAMPLES:
        return np.zeros((0, N_BANDS), np.float32)
    frames = frames_of(np.ascontiguousarray(samples, np.float32), WINDOW_SAMPLES, HOP_SAMPLES)
    return np.concatenate([_energies(frames[i : i + FRAMES_AT_ONCE]) for i in range(0, len(frames), FRAMES_AT_ONCE)])


def _energies(frames: NDArray[np.float32]) -> Energies:
    offset = np.add.reduce(frames, axis=1, keepdims=True) / np.float32(WINDOW_SAMPLES)
    spectra = rfft((frames - offset) * _WINDOW, FFT_SIZE)  # the offset would leak into the low bands
    power = np.asarray(spectra.real**2 + spectra.imag**2, np.float32)
    return (power @ _FILTERS) + ENERGY_FLOOR


def smoothed(energies: Energies) -> Energies:
    """Weighted mean over three neighbouring frames; two rows fewer than `energies`.

    It halves the variance of noise before the logarithm, which would stretch its dips.
    """
    return SMOOTH_SIDE * (energies[:-2] + energies[2:]) + (1 - 2 * SMOOTH_SIDE) * energies[1:-1]


def cepstra_of(energies: Energies) -> NDArray[np.float32]:
    """Weighted cepstra of linear energies (any leading shape), last axis N_CEPSTRA."""
    return np.asarray(np.log(energies) @ _TRANSFORM, np.float32)


def deltas_of(before2: Features, before1: Features, after1: Features, after2: Features) -> Features:
    """Slope by regression over two frames to either side (Furui 1986), weighted for the distance."""
    return np.float32(DELTA_WEIGHT / 10.0) * (2.0 * (after2 - before2) + (after1 - before1))


def features_of(energies: Energies) -> Features:
    """Features of the frames that have `DELTA_REACH` neighbours on both sides.

    `energies` has shape (n + 2 * CONTEXT_FRAMES, N_BANDS); returns shape (n, N_FEATURES).
    """
    c = cepstra_of(smoothed(energies))
    return np.concatenate([c[2:-2], deltas_of(c[:-4], c[1:-3], c[3:-1], c[4:])], axis=1)
