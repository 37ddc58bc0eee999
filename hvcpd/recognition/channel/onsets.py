"""Onset detection: where robots' sentences may begin, through any channel and in any noise.

Most sentences begin with a greeting, which in a robot's voice is a known signal. The whitened sound is correlated with
it, and the energy of the correlation in a window as long as a short response is compared with the median of all such
windows: a detector of constant false-alarm rate (M. Richards, "Fundamentals of Radar Signal Processing", 2nd ed.,
2014, chapter 7). It needs neither a channel estimate nor voice activity.

Other onsets are found by their energy at the frequencies where robots' voices stand out from the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.graph import WordGraph
from hvcpd.ports import Samples
from hvcpd.recognition.arrays import quantile
from hvcpd.recognition.channel.path import GREETING, RenderedVoice, Rendering
from hvcpd.recognition.channel.whitening import (
    BINS,
    FRAME,
    Spectrum,
    interpolated,
    inverse_spectrum,
    loudness_weights,
    power_spectra,
)
from hvcpd.recognition.frontend import TINY, rfft

SIZE = 16_384
"""Samples of the transform, and of the sound that is searched at a time: 1.02 s."""
STEP = 8_000
"""Lags that are new each time, samples (0.5 s)."""
WINDOW = 64
"""Samples (4 ms) of the channel response whose energy is summed, as in the search's first step."""
BLOCK = 16
"""Resolution of onsets, samples (1 ms)."""
LENGTH = SIZE - STEP - WINDOW
"""Samples of a greeting that are correlated; a slow greeting is a little longer."""
LEAST_RATIO = 6.5
"""Ratio of a window's energy to the median from which on it is the onset of a greeting. In four rooms and four kinds of
noise at -10 to 0 dB, 43 right ones had 6.7 to 178, and 300 half seconds of noise alone at most 6.5."""
RISE_FRAMES = 6
"""Frames (0.21 s) over which the rise over the noise is averaged."""
LEAST_RISE = 1.5
"""Mean weighted rise from which on a voice has begun. In steady noise at -10 dB, speech reaches 1.7 to 7.0 (72
sentences), and half seconds of noise alone 0.6 to 1.46 (250)."""
MEAN_RISE = 0.0489
"""Mean rise of a bin in steady noise, where its power over the mean is distributed exponentially and half of it
counts: the exponential integral E1(2)."""
TAPERED = 0.3
"""A bin counts at most as much as 1 / 0.3 mean ones, since the mean over a few bins is not steady."""
VOICED = slice(100 * FRAME // 16_000, 4000 * FRAME // 16_000)
"""Bins (100 Hz to 4 kHz) in which voices have their harmonics."""


@dataclass(frozen=True)
class Onset:
    """A sentence may begin at sample `at` of the sound, with a `greeting`; otherwise it began before `at`."""

    at: int
    greeting: bool


class OnsetDetector:
    """Detects the first words of sentences in robots' voices."""

    def __init__(self, graph: WordGraph, books: Sequence[RenderedVoice]) -> None:
        firsts = [
            (book.voice, word, said)
            for book in books
            for word, node in graph.following[graph.start]
            for said in book.renderings(word, 0)
            if not said.final or node in graph.rests
        ]
        self._greetings: list[Rendering] = [said for _, word, said in firsts if word == GREETING]
        spectra = [np.conj(rfft(said.samples[:LENGTH], SIZE)) for said in self._greetings]
        self._spectra = np.array(spectra, np.complex64).reshape(-1, SIZE // 2 + 1)
        self._powers = np.square(np.abs(self._spectra))
        voices = {voice: np.zeros(BINS) for voice, _, _ in firsts}
        for voice, _, said in firsts:
            power = power_spectra(said.samples[:SIZE]).mean(axis=0)
            voices[voice] += power / max(float(power.sum()), TINY)
        self._voices = np.array(list(voices.values()), np.float32).reshape(-1, BINS)

    def find(self, heard: Samples, noise: Samples) -> Onset | None:
        """The first onset in `heard`, shape (SIZE,): a greeting within the first STEP samples, or else where a voice
        rises over the noise; None if there is none. `noise`: sound without speech, shape (n,), n ≥ FRAME."""
        if not self._greetings:
            return None
        inverse = inverse_spectrum(heard, noise)
        greeting = self._greeting(heard, noise, inverse)
        rise = greeting if greeting is not None else self._rise(heard, noise)
        return Onset(rise, greeting is not None) if rise is not None else None

    def _greeting(self, heard: Samples, noise: Samples, inverse: NDArray[np.float64]) -> int | None:
        weighted = heard * loudness_weights(heard, noise, inverse)
        there = interpolated(inverse, SIZE)
        received = np.asarray(rfft(np.asarray(weighted, np.float32), SIZE) * there, np.complex64)
        lags = np.fft.irfft(self._spectra * received, SIZE)[:, : STEP + WINDOW]
        energies = _windows(np.square(lags, dtype=np.float32)) / np.maximum(self._powers @ there, TINY)[:, None]
        way, block = divmod(int(energies.argmax()), energies.shape[1])
        if energies[way, block] < LEAST_RATIO * max(quantile(energies, 0.5), TINY):
            return None
        lead: int = self._greetings[way].lead
        return int(block) * BLOCK + lead

    def _rise(self, heard: Samples, noise: Samples) -> int | None:
        """The end of the first window in which the power rises over the noise in the bins of a voice.

        In steady noise the ratio of a bin's power to its mean is distributed exponentially. The logarithm of half that
        ratio, where it is positive, limits the influence of single bins. Bins are weighted by the ratio of the voice's
        power to the noise's, as in the optimum detector of a faint sound of known spectrum (H. Van Trees, "Detection,
        Estimation, and Modulation Theory", part III, 1971)."""
        usual = power_spectra(noise).mean(axis=0)
        usual = np.convolve(np.pad(usual, 2, mode="edge"), np.full(5, 0.2), "valid")[VOICED]
        usual += 1e-4 * usual.mean() + TINY
        rises = np.log(np.maximum(0.5 * power_spectra(heard)[:, VOICED] / usual, 1.0)) - MEAN_RISE
        above = self._voices[:, VOICED] / usual
        above /= np.maximum(above.mean(axis=1, keepdims=True), TINY)
        counts = above / (1.0 + TAPERED * above)
        counts /= np.maximum(np.linalg.norm(counts, axis=1, keepdims=True), TINY)
        total = np.cumsum(np.pad(rises @ counts.T, ((1, 0), (0, 0))), axis=0)
        risen = (total[RISE_FRAMES:] - total[:-RISE_FRAMES]).max(axis=1) > LEAST_RISE * RISE_FRAMES**0.5
        return (int(risen.argmax()) + RISE_FRAMES) * FRAME // 2 if risen.any() else None


def _windows(squares: Spectrum) -> Spectrum:
    """The sums over WINDOW samples from every BLOCK-th on, shape (n, STEP / BLOCK)."""
    blocks = squares[:, : squares.shape[1] // BLOCK * BLOCK].reshape(len(squares), -1, BLOCK).sum(axis=2)
    total = np.cumsum(np.pad(blocks, ((0, 0), (1, 0))), axis=1)
    across = WINDOW // BLOCK
    return np.asarray(total[:, across:] - total[:, :-across], np.float32)
