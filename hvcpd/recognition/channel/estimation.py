"""Channel estimation: a segment of sound, whitened by its noise, and least-squares responses between it and known
signals."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import Samples
from hvcpd.recognition.channel.whitening import (
    CELL,
    CELL_BINS,
    CELL_STEP,
    Spectrum,
    cell_weights,
    filtered,
    interpolated,
    inverse_spectrum,
    transform_size,
    with_cell_weights,
)
from hvcpd.recognition.frontend import SILENT_POWER, TINY, frames_of, rfft

Taps = NDArray[np.float32]

LEAST_RIDGE, MOST_RIDGE = 2e-3, 0.3
"""Bounds of the ridge, as a share of the known signal's energy."""
_STEPS = 40
_CLOSE = 1e-3
"""Conjugate gradients end here: relative residual. The estimate's own error is far larger."""


def channel_responses(autocorrelations: Taps, correlations: Taps, n: int) -> Taps:
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
    energy = np.maximum(column[:, 0], np.float32(TINY))
    explained = np.maximum(_products(p, p) / energy, 1.0)
    ridge = (energy * np.clip(n / explained, LEAST_RIDGE, MOST_RIDGE)).astype(np.float32)[:, None]
    column[:, :1] += ridge
    spectrum = np.asarray(rfft(column).real, np.float32)
    weight = np.arange(n, dtype=np.float32) / n
    around = (1.0 - weight) * column[:, :n]
    around[:, 1:] += weight[1:] * column[:, n - 1 : 0 : -1]
    smooth = np.asarray(np.maximum(rfft(around).real, 0.1 * ridge), np.float32)
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
        image = np.asarray(np.fft.irfft(rfft(direction, 2 * n) * spectrum, 2 * n)[:, :n], np.float32)
        alpha = np.where(going, rho / np.maximum(_products(direction, image), TINY), 0.0).astype(np.float32)[:, None]
        h += alpha * direction
        left -= alpha * image
        z = _conditioned(left, smooth)
        before, rho = rho, _products(left, z)
        direction = z + np.where(going, rho / np.maximum(before, TINY), 0.0).astype(np.float32)[:, None] * direction
    return h


def _conditioned(left: Taps, smooth: Taps) -> Taps:
    return np.asarray(np.fft.irfft(rfft(left) / smooth, left.shape[1]), np.float32)


def _products(a: Taps, b: Taps) -> NDArray[np.float64]:
    """The inner products of the rows."""
    return np.asarray(np.einsum("ij,ij->i", a, b), np.float64)


TAPS = CELL
"""Maximum length of a response in samples: 32 ms, the direct sound and a room's early reflections."""
FIRST_TAPS = 64
"""4 ms: for a first word, enough for most loudspeakers without a room."""
PRE_TAPS = 192
"""Number of these samples before the place where a signal was found: there may be an echo, louder than the direct
sound."""
MAX_SHIFT = 16
"""Samples (1 ms) that a word may begin off its place: clocks 1,300 ppm apart over the longest word and a pause. Places
of first words are as far apart."""
BLOCK = 1024
"""Number of samples of a known signal that are transformed at once, with as many zeros: at 1,025 lags."""
SIZE = 2 * BLOCK
GRID = 256
"""Samples from one transformed block of the sound to the next: with the lags of a `SignalFit`, fewer than 1,025."""
CACHED_WORDS = 512
"""Words whose spectra are kept: about 66 kB each, 35 MB in all."""
_WINDOW = np.sin(np.pi / 2 * np.sin(np.pi * (np.arange(SIZE) + 0.5) / SIZE) ** 2).astype(np.float32)
"""Its squares, BLOCK apart, add up to 1, and what is loud at one frequency hardly shows at others (that of the Vorbis
codec). So the power densities of a signal that it cuts out add up to that of the signal."""


class Signal(Hashable, Protocol):
    """A sound that is known to the sample. It may be on disk, so request it only to compare it."""

    @property
    def length(self) -> int:
        """Its length, samples."""

    @property
    def samples(self) -> Samples:
        """The sound, shape (length,)."""


@dataclass(frozen=True, eq=False)
class SignalFit:
    """A known signal against the received sound around its place, over noise of variance 1.

    `correlation` at lags from -PRE_TAPS - MAX_SHIFT on, shape (TAPS + 2 MAX_SHIFT,); the signal's power `density`, of
    which the autocorrelation is the inverse transform, shape (SIZE / 2 + 1,).
    """

    correlation: Taps
    density: Spectrum


@dataclass(frozen=True, eq=False)
class Blocks:
    """A known signal in blocks of BLOCK samples: their `spectra`, conjugate, shape (n_blocks, SIZE / 2 + 1); the power
    `densities` around each block's beginning, and around the end, shape (n_blocks + 1, SIZE / 2 + 1); and how the power
    is spread in `time` there, in steps of CELL_STEP, shape (n_blocks + 1, SIZE / CELL_STEP), each row of sum 1."""

    spectra: NDArray[np.complex64]
    densities: Spectrum
    time: Spectrum


@lru_cache(CACHED_WORDS)
def blocks_of(said: Signal) -> Blocks:
    """The blocks of a signal; the words used last are kept."""
    n_blocks = -(-said.length // BLOCK)
    sound = np.zeros((n_blocks + 2) * BLOCK, np.float32)
    sound[BLOCK : BLOCK + said.length] = said.samples
    spectra = np.conj(rfft(sound[BLOCK:-BLOCK].reshape(n_blocks, BLOCK), SIZE))
    around = frames_of(sound, SIZE, BLOCK) * _WINDOW
    both = rfft(around)
    slopes = np.diff(around, axis=1, prepend=0.0)  # whitened, low frequencies count little
    time = np.square(slopes).reshape(n_blocks + 1, -1, CELL_STEP).sum(axis=2) + SILENT_POWER
    time /= time.sum(axis=1, keepdims=True)
    return Blocks(spectra, np.asarray(both.real**2 + both.imag**2, np.float32), np.asarray(time, np.float32))


class WhitenedSound:
    """The received sound, whitened by its noise and by its own power, scaled to variance 1.

    Whitened once, it is kept as spectra of SIZE samples from every GRID-th on. A signal's blocks against the spectra
    where they lie, summed, make its correlation by one small transform (overlap-save, as in partitioned convolution).
    """

    def __init__(self, heard: Samples, noise: Samples) -> None:
        """`heard` and `noise` alone, shapes (n,) and (m,), m ≥ FRAME, float32 at 16 kHz."""
        self.n = len(heard)
        inverse = inverse_spectrum(heard, noise)
        cells = cell_weights(heard, noise, inverse)
        weighted = with_cell_weights(heard, cells)
        white = np.square(filtered(weighted, np.sqrt(inverse)), dtype=np.float64)
        variance = max(float(np.mean(white)), TINY)
        self._energy = np.concatenate([[0.0], np.cumsum(white / variance)])
        silence = SIZE // CELL_STEP, 2 * SIZE // CELL_STEP
        around = np.pad(np.square(cells)[: self.n // CELL_STEP + 1], (silence, (0, 0)))
        self._cells = np.lib.stride_tricks.sliding_window_view(around, SIZE // CELL_STEP, axis=0)
        self._inverse = interpolated(inverse / variance, SIZE)
        self._twice = filtered(weighted, inverse / variance)
        self._fixed_weights = _frames_of(self._twice)
        self._frames = _frames_of(with_cell_weights(self._twice, cells))
        self._matched: dict[bytes, NDArray[np.complex64]] = {}
        self._fits: dict[tuple[Signal, int], SignalFit] = {}

    def energy(self, first: int, last: int) -> float:
        """The received energy from sample `first` up to `last`, in variances of the noise."""
        begin, end = min(max(first, 0), self.n), min(max(last, 0), self.n)
        return float(self._energy[end] - self._energy[begin])

    def correlation(self, said: Signal, first: int, n: int, response: Taps | None = None) -> Taps:
        """The correlation with the signal, through a `response` at lags from -PRE_TAPS on if there is one, beginning at
        each of `n` samples from `first` on, over the root of the signal's energy; as if the weights did not change
        during the signal."""
        blocks, frames, weights = blocks_of(said), self._fixed_weights, self._inverse
        if response is not None:
            frames, weights = self._through(response), weights * np.square(np.abs(rfft(response, SIZE)))
        n_blocks, at, off = len(blocks.spectra), *divmod(first, GRID)
        n_frames = -(-(n + off) // BLOCK)
        heard = frames[self._block_indices(at, n_frames + n_blocks - 1)]
        both = sum(blocks.spectra[b] * heard[b : b + n_frames] for b in range(n_blocks))
        found = np.fft.irfft(both, SIZE)[:, :BLOCK].reshape(-1)[off : off + n]
        energy = 2.0 * float((blocks.densities @ weights).sum()) / SIZE
        return np.asarray(found / np.sqrt(max(energy, TINY)), np.float32)

    def _through(self, response: Taps) -> NDArray[np.complex64]:
        """The spectra of the sound through the filter that is matched to a response; they are kept."""
        if (key := response.tobytes()) not in self._matched:
            size = transform_size(self.n + TAPS)
            matched = np.fft.irfft(rfft(self._twice, size) * np.conj(rfft(response, size)), size)
            shifted = np.roll(matched, PRE_TAPS)[: self.n]
            self._matched[key] = _frames_of(np.asarray(shifted, np.float32))
        return self._matched[key]

    def fits(self, wanted: Iterable[tuple[Signal, int]]) -> list[SignalFit]:
        """The fits of signals that begin at these samples, or MAX_SHIFT around them; one call for all is quicker."""
        wanted = list(wanted)
        new = [each for each in dict.fromkeys(wanted) if each not in self._fits]
        both = np.empty((len(new), SIZE // 2 + 1), np.complex64)
        own = np.empty(both.shape, np.float32)
        offs = []
        for k, (said, at) in enumerate(new):
            blocks = blocks_of(said)
            number, off = divmod(at - MAX_SHIFT - PRE_TAPS, GRID)
            heard = self._frames[self._block_indices(number, len(blocks.spectra))]
            np.einsum("ij,ij->j", blocks.spectra, heard, out=both[k])
            np.einsum("ij,ij->j", self._block_weights(at, blocks.time), blocks.densities, out=own[k])
            offs.append(off)
        across = np.fft.irfft(both, SIZE)
        own *= self._inverse
        for each, off, correlation, density in zip(new, offs, across, own, strict=True):
            self._fits[each] = SignalFit(correlation[off : off + TAPS + 2 * MAX_SHIFT].copy(), density)
        return [self._fits[each] for each in wanted]

    def _block_indices(self, at: int, n_blocks: int) -> slice | NDArray[np.int_]:
        """The indices of the spectra of blocks from sample `at` GRID on; the first and the last one are of silence."""
        first, step = at + SIZE // GRID, BLOCK // GRID
        if first >= 0 and first + (n_blocks - 1) * step < len(self._frames):
            return slice(first, first + (n_blocks - 1) * step + 1, step)
        return np.clip(first + step * np.arange(n_blocks), 0, len(self._frames) - 1)

    def _block_weights(self, at: int, time: Spectrum) -> Spectrum:
        """The mean square weight, at each bin, of each part of a signal at sample `at` whose power is spread in `time`
        so, shape (n_parts, SIZE / 2 + 1)."""
        first = round(max(at + BLOCK, 0) / CELL_STEP)
        seen = self._cells[first :: BLOCK // CELL_STEP][: len(time)]
        shares = np.zeros((len(time), seen.shape[1]), np.float32)  # after the end there is no sound
        np.einsum("ibj,ij->ib", seen, time[: len(seen)], out=shares[: len(seen)])
        return np.repeat(shares, CELL_BINS * SIZE // CELL, axis=1)[:, : SIZE // 2 + 1]


def autocorrelations(fits: Sequence[SignalFit]) -> Taps:
    """Those of the signals at lags from 0 on, weighted as the sound is where they lie, shape (len(fits), TAPS)."""
    return np.asarray(np.fft.irfft(np.stack([fit.density for fit in fits]), SIZE)[:, :TAPS], np.float32)


def _frames_of(sound: Samples) -> NDArray[np.complex64]:
    """The spectra of SIZE samples from every GRID-th on; the first one and the last one are of silence."""
    frames = frames_of(np.pad(sound, (SIZE, SIZE + GRID)), SIZE, GRID)
    return np.concatenate([rfft(frames[k : k + 64]) for k in range(0, len(frames), 64)])
