"""Matched filters: detect where a known sound begins, with a strength for each sample.

The detector of a known signal in Gaussian noise correlates the signal with the received sound over the noise's power
spectrum (D. North, "An analysis of the factors which determine signal/noise discrimination", Proc. IEEE 51(7), 1963; G.
Turin, "An introduction to matched filters", IRE Trans. IT 6(3), 1960). Its output over its own deviation, the
*strength* here, grows with the square root of the signal's duration times its bandwidth: a word of 0.4 s stands out by
20 where the noise has ten times its power."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.frontend import SILENT_POWER, TINY, rfft

FRAME = 1024
"""Samples of a frame of the noise's spectrum: 16 Hz apart, which parts a motor's lines from a voice."""
BINS = FRAME // 2 + 1
HOP = FRAME // 2
MEMORY_S = 2.0
"""Time constant of the spectrum: several words long, so that no single word is taken for the noise."""
MEMORY_FRAMES = MEMORY_S * SAMPLE_RATE_HZ / HOP
REFRESH_FRAMES = 8
"""The filter follows the spectrum every 0.26 s."""
SMOOTHING = 5
"""Bins that are averaged, 78 Hz: with fewer, a spectrum of few frames is noise itself."""
FLOOR = 1e-4
"""No bin counts as more than 40 dB below the mean: a converter's empty bands would outweigh all else."""
VOICED = slice(100 * FRAME // SAMPLE_RATE_HZ, 4000 * FRAME // SAMPLE_RATE_HZ)
"""Bins in which voices have their harmonics."""
RISE = 0.0489
"""Mean rise of a bin in steady noise (see `WhiteningFilter.voiced`): the exponential integral E1(2)."""
RISEN = ((6, 1.1), (14, 0.95))
"""Numbers of last frames (0.19 and 0.45 s), and the mean rise over them that is a sign of speech. Steady noise passes
one of them once in 15 minutes where three voices are known, and once in three where eight are; at -10 dB nearly all
that is said does, in a fan's noise nine of ten short sentences, where four do if all bins count alike."""
TAPERED = 0.3
"""A bin counts at most as much as 1 / 0.3 mean ones, since the mean over a few bins is not steady."""
REACH = 256
"""Samples that the filter looks ahead, and back: 16 ms."""
PART = FRAME
"""Samples of a part of a word: 64 ms, about a phone."""
LEAST_ENERGY = 0.01
"""Least energy of a part, as a share of the parts' mean: a faded end has none."""
LEAST_PART = 0.35
"""Least ratio of a part's strength to the one expected at the gain of the whole sound."""
SLACK = 3.5
"""Deviations by which the strength of a part may fall short by chance."""

Spectrum = NDArray[np.float32]
_WINDOW = np.hanning(FRAME).astype(np.float32)
_WINDOW_POWER = np.square(_WINDOW).sum()
_TAPER = np.hanning(2 * REACH).astype(np.float32)
_SMOOTHER = np.full(SMOOTHING, 1.0 / SMOOTHING, np.float32)


class WhiteningFilter:
    """Whitening filter of the mean power spectrum of the last seconds (Welch's method, with forgetting), and energy
    detector of voices that stand out from it."""

    def __init__(self) -> None:
        self._power: Spectrum = np.zeros(BINS, np.float32)
        self._frames = 0
        self._framed: Samples = np.zeros(0, np.float32)
        self.weights: Spectrum = np.zeros(BINS, np.float32)
        """One over the power of each bin, as the filter has it."""
        self._filter: Samples = np.zeros(2 * REACH, np.float32)
        self._filters: dict[int, NDArray[np.complex64]] = {}
        self.version = 0
        """Version number, raised whenever the weights change."""
        self._usual: Spectrum = np.full(BINS, np.inf, np.float32)
        self._voices: Spectrum = np.zeros((0, BINS), np.float32)
        self._watched: Spectrum = np.zeros((0, BINS), np.float32)[:, VOICED]
        """Weight of each bin for each voice."""
        self._rises: Spectrum = np.zeros((RISEN[-1][0], 0), np.float32)
        """Weighted rises of the last frames for each voice."""
        self.voiced = False
        """Whether, anywhere in what was pushed last, the bins in which a known voice has its harmonics have more than
        usual, as in noise that hides the voice as a whole.

        In steady noise a bin's power over its own mean is distributed exponentially. Of that over two the logarithm is
        taken, where it is positive, so that no single bin counts for much; a bin counts by the voice's power over the
        noise's, as the optimum detector of a faint sound of known spectrum has it (Van Trees, "Detection, Estimation,
        and Modulation Theory", part III, 1971). False until the mean is known well.
        """

    def expect(self, voices: Spectrum) -> None:
        """`voices`: mean power spectra, at any level, of the beginnings of their sentences, shape (n, BINS)."""
        self._voices = voices
        self._rises = np.zeros((RISEN[-1][0], len(voices)), np.float32)
        self._watch()

    def push(self, samples: Samples) -> None:
        """Learn from the next samples, shape (n,)."""
        heard = np.concatenate([self._framed, samples])
        n = max(1 + (len(heard) - FRAME) // HOP, 0)
        self._framed = heard[n * HOP :]
        # Overlapping rows of one array, as many at once as there are before the weights change.
        frames: Samples = np.ndarray((n, FRAME), np.float32, heard, 0, (HOP * heard.itemsize, heard.itemsize))
        self.voiced = self.voiced and not n
        frames = frames[np.einsum("ns,ns->n", frames, frames) > FRAME * SILENT_POWER]  # zeros are no noise
        while len(frames):
            some = REFRESH_FRAMES - self._frames % REFRESH_FRAMES
            self._learn(frames[:some])
            frames = frames[some:]

    def _learn(self, frames: Samples) -> None:
        spectra = rfft(frames * _WINDOW)
        powers = (spectra.real**2 + spectra.imag**2) / _WINDOW_POWER
        rises = np.log(np.maximum(0.5 * powers[:, VOICED] / self._usual[VOICED], 1.0)) - np.float32(RISE)
        known = np.arange(self._frames, self._frames + len(frames)) >= MEMORY_FRAMES
        self._rises = np.concatenate([self._rises, rises @ self._watched.T * known[:, None]])
        self.voiced = self.voiced or self._rises_enough(len(frames))
        self._rises = self._rises[-RISEN[-1][0] :]
        for power in powers:
            self._frames += 1
            self._power += (power - self._power) / np.float32(min(self._frames, MEMORY_FRAMES))
        if self._frames % REFRESH_FRAMES == 0:
            self._refresh()

    def interrupt(self) -> None:
        """Note a gap: the next samples do not follow on the last ones."""
        self._framed = self._framed[:0]
        self._rises = np.zeros_like(self._rises)
        self.voiced = False

    def _rises_enough(self, n_frames: int) -> bool:
        """Whether a sufficient rise ends in any of the last frames."""
        sums = np.cumsum(self._rises, axis=0)
        return any(bool((sums[-n_frames:] - sums[-n_frames - n : -n] > least * n**0.5).any()) for n, least in RISEN)

    @property
    def ready(self) -> bool:
        """Whether enough sound was heard for an estimate."""
        return bool(self.weights.any())

    def whiten(self, heard: Samples) -> Samples:
        """Whiten a sound, shape (n + 2 REACH,), by the spectrum; returns shape (n,), without REACH at either end."""
        size = transform_size(len(heard))
        if size not in self._filters:
            self._filters[size] = np.asarray(rfft(self._filter, size), np.complex64)
        out = np.fft.irfft(rfft(heard, size) * self._filters[size], size)
        return np.asarray(out[2 * REACH : len(heard)], np.float32)

    def _refresh(self) -> None:
        edge = SMOOTHING // 2
        padded = np.concatenate([self._power[:1]] * edge + [self._power] + [self._power[-1:]] * edge)
        smooth = np.asarray(np.convolve(padded, _SMOOTHER, "valid"), np.float32)
        smooth += np.float32(FLOOR * smooth.mean() + SILENT_POWER)
        self._usual = smooth
        self._watch()
        inverse = np.fft.irfft(1.0 / smooth)
        response = np.asarray(np.concatenate([inverse[-REACH:], inverse[:REACH]]) * _TAPER, np.float32)
        self._filter = response
        self._filters = {}
        self.version += 1
        full = np.zeros(FRAME, np.float32)
        full[:REACH], full[-REACH:] = response[REACH:], response[:REACH]
        self.weights = np.asarray(np.maximum(rfft(full).real, 0.0), np.float32)

    def _watch(self) -> None:
        """Weight each bin by each voice's power over the noise's."""
        above = self._voices[:, VOICED] / self._usual[VOICED]
        above /= np.maximum(above.mean(axis=1, keepdims=True), TINY)
        counts = above / (1.0 + TAPERED * above)
        self._watched = counts / np.maximum(np.linalg.norm(counts, axis=1, keepdims=True), TINY)


def transform_size(n: int) -> int:
    """Samples of a transform for `n`: a multiple of FRAME, most of which are quick."""
    return -(-max(n, FRAME) // FRAME) * FRAME


def power_of(sound: Samples) -> Spectrum:
    """Energy of a sound at each of BINS frequencies, shape (BINS,), for the expectation under a filter's weights."""
    size = transform_size(len(sound))
    spectrum = rfft(sound, size)
    energy = spectrum.real**2 + spectrum.imag**2
    ratio = size // FRAME
    summed = np.add.reduceat(np.pad(energy, (ratio // 2, 0)), np.arange(0, len(energy) + ratio // 2, ratio))
    return np.asarray(2.0 * summed[:BINS] / size, np.float32)


def faded(sound: Samples) -> Samples:
    """The beginning of a longer sound, shape (n,), with an end that fades over REACH samples. A cut end would have the
    power of a click at all frequencies, mostly where the weights are highest, although that click is not heard."""
    n = min(REACH, len(sound))
    return np.concatenate([sound[: len(sound) - n], sound[len(sound) - n :] * _TAPER[2 * REACH - n :]])


@dataclass(frozen=True)
class Match:
    """How a known sound fits the received sound.

    `strength`: its correlation over the standard deviation that the residual would give it, 1 for chance; `expected`:
    the same for the sound at gain 1; `whole`: whether each part of it fits.
    """

    strength: float
    expected: float
    whole: bool


def correlated(whitened: Samples, sound: Samples, expected: float) -> tuple[float, int]:
    """The greatest strength in steady noise of `sound`, shape (n,), over all lags in `whitened`, shape (n + lags - 1,);
    and the sample at which it begins."""
    values = np.correlate(whitened, sound, "valid")
    offset = int(values.argmax())
    return float(values[offset]) / expected, offset


def scrutinized(
    whitened: Samples, sound: Samples, power: Spectrum, whitening: WhiteningFilter, strength: float, expected: float
) -> Match:
    """The strength at a known place: the residual gives the deviation, and the parts show whether the sound is
    complete.

    `whitened` and `sound` have the same shape (n,), `power` is the sound's `power_of`; strength and expectation are
    those in steady noise. Where other speech is loud, a part of the sound carries less information. So the parts are
    weighted by the residual in each of them, as in the optimum detector for noise that changes.
    """
    whole = whitening.whiten(np.pad(sound, REACH))
    edges = np.arange(0, len(sound), PART)
    lengths = np.diff([*edges, len(sound)])
    energy = np.add.reduceat(whole * sound, edges)
    least = max(LEAST_ENERGY * float(energy.mean()), TINY)
    faint = energy < least  # as before a burst: nothing of it can be missing, however loud the rest is
    energy = np.maximum(energy, least)
    # Each part has a gain of its own. With a common gain, a missing part would look like noise that hides it.
    gains = np.add.reduceat(whitened * sound, edges) / energy
    left = np.zeros(len(edges) * PART)  # double: a faint part's gain squared is more than single precision holds
    left[: len(sound)] = whitened - np.repeat(np.maximum(gains, 0.0).astype(np.float64), lengths) * whole
    residual = np.fft.rfft(left.reshape(-1, PART))
    spread = (residual.real**2 + residual.imag**2) @ power
    counts = energy / np.maximum(spread / (lengths * max(expected**2, TINY)), 1.0)
    gain = max(strength, 0.0) / expected
    found, wanted = gains * np.sqrt(counts), gain * np.sqrt(counts)
    fits = bool(np.all((found >= np.minimum(LEAST_PART * wanted, wanted - SLACK)) | faint))
    share = float(counts.sum() / energy.sum())
    there = float(np.dot(gains, counts) / counts.sum())
    return Match(there * expected * share**0.5, expected * share**0.5, fits)


KEPT = 3 * SAMPLE_RATE_HZ
"""Samples that are kept; a word is compared soon after it ended, and the one before a short sentence then."""
AGAIN = 3 * SAMPLE_RATE_HZ // 4
"""Samples that are whitened again when the weights have changed: most words are shorter."""


class WhitenedSound:
    """The last seconds of sound; whitens each sample once for each version of the filter."""

    def __init__(self) -> None:
        self.whitening = WhiteningFilter()
        self.end = 0
        """The number of the sample that comes next."""
        self._buffer = np.zeros(2 * KEPT, np.float32)
        self._filled = 0
        self._version = -1
        self._from = self._to = 0
        self._whitened: Samples = np.zeros(0, np.float32)

    def push(self, samples: Samples) -> None:
        """Append the next samples, shape (n,)."""
        if self._filled + len(samples) > len(self._buffer):
            self._buffer[:KEPT] = self._buffer[self._filled - KEPT : self._filled]
            self._filled = KEPT
        self._buffer[self._filled : self._filled + len(samples)] = samples
        self._filled += len(samples)
        self.end += len(samples)
        self.whitening.push(samples)

    def break_off(self, at: int) -> None:
        """Note a gap: the next sample has number `at` and does not follow on the last one."""
        self.whitening.interrupt()
        self._filled = 0
        self.end = at
        self._version = -1

    def between(self, start: int, end: int, more: bool = True) -> Samples:
        """Samples `start` up to `end`, whitened; silence where none are kept. `more`: further requests will follow."""
        if self._version != self.whitening.version or start < self._from:
            self._version = self.whitening.version
            self._from = self._to = min(start, self.end - AGAIN) if more else start
            self._whitened = np.zeros(0, np.float32)
        if self._to < self.end:
            heard = self.heard(self._to - REACH, self.end + REACH)
            self._whitened = np.concatenate([self._whitened, self.whitening.whiten(heard)])
            self._to = self.end
        found = self._whitened[start - self._from : end - self._from]
        return np.pad(found, (0, end - start - len(found))) if len(found) < end - start else found

    def heard(self, start: int, end: int) -> Samples:
        """Samples `start` up to `end`, unfiltered; silence where none are kept."""
        oldest = self.end - self._filled
        kept = self._buffer[max(start - oldest, 0) : max(min(end, self.end) - oldest, 0)]
        return np.pad(kept, (max(oldest - start, 0), max(end - self.end, 0)))


QUANTA = np.float32(16_384.0)
"""Steps in a full scale of 1, -84 dB apart, far below the noise of any microphone; what is beyond 2 is cut off."""

Quantised = NDArray[np.int16]
"""A sound in half the memory. Whole numbers, since to make half floats takes a processor eight times as long."""


def quantised(sound: Samples) -> Quantised:
    """A sound, any shape, in int16."""
    steps = np.rint(sound * QUANTA)
    out: Quantised = np.clip(steps, -32_768, 32_767, out=steps).astype(np.int16)
    return out


def restored(steps: Quantised) -> Samples:
    """The sound again, float32, off by half a step at most."""
    sound = steps.astype(np.float32)
    sound *= np.float32(1.0) / QUANTA
    return sound
