"""Distances between the sound and every template frame in the noise and at the level of the moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.decoder import UNREACHABLE
from hvcpd.recognition.frontend import N_BANDS, N_FEATURES, Energies, Features
from hvcpd.recognition.network import Network
from hvcpd.recognition.templates import TemplateBank, noise_features

LEVEL_FRAMES = 7
"""The level is that of the loudest 70 ms: a vowel."""
RECOMPOSE_NEPER = 0.12
"""Templates are composed anew when the noise moved by 0.5 dB (mean over the bands): below it nothing is gained."""

MASK_DB = 16.0
"""Below the voice's loud spectrum by this much, sound is masked (Klatt 1976): in quiet, faint remainders of a word vary
from one utterance to the next, and their logarithms would count as much as the vowels; clipping and reverberation fill
the gaps between them. Measured: at 28 dB, 10 of 15 sentences with a tenth of their samples clipped; at 16 dB, 15."""


@dataclass(frozen=True)
class Scores:
    """Distances of n frames: `templates` (n_rungs, n, n_frames + 1), `noise` (n,), `cohort` (n,) (the smallest)."""

    templates: NDArray[np.float32]
    noise: NDArray[np.float32]
    cohort: NDArray[np.float32]


class Scorer:
    """Composes the templates with noise and gains, and measures distances to them."""

    def __init__(self, bank: TemplateBank, network: Network, ladder_db: tuple[float, ...]) -> None:
        self._bank = bank
        self._ladder = 10.0 ** (np.array(ladder_db) / 10.0)
        self._frame_of_state = network.frame_of_state
        n_rungs = len(ladder_db)
        self._features = np.zeros((n_rungs, bank.n_frames, N_FEATURES), np.float32)
        self._norms = np.zeros((n_rungs, bank.n_frames), np.float32)
        self._noise_features = np.zeros(N_FEATURES, np.float32)
        self._noise = np.zeros(N_BANDS, np.float32)
        self._gain = 0.0
        self._mask_energy = 10.0 ** (-MASK_DB / 10.0) * float(bank.loud_spectrum.mean())

    def level_of(self, energies: Energies, noise: NDArray[np.float32]) -> float:
        """Power gain from the templates to the loudest syllable in `energies`; 0 when nothing is above the noise.

        Weighted least squares over the bands, a band's weight falling with its noise and signal; a band where voices
        are weak hardly counts, or a hiss there would pass for a shout.
        """
        n = len(energies) - LEVEL_FRAMES + 1
        if n < 1:
            return 0.0
        sums = np.cumsum(np.concatenate([np.zeros((1, N_BANDS), np.float32), energies]), axis=0)
        above = (sums[LEVEL_FRAMES:] - sums[:-LEVEL_FRAMES]) / LEVEL_FRAMES - noise
        spectrum = self._bank.loud_spectrum
        gain = 0.0
        for _ in range(3):
            weight = spectrum / (noise + gain * (spectrum + spectrum.mean())) ** 2
            gain = max(float((above @ weight).max() / (spectrum @ weight)), 0.0)
        return gain

    def mask(self, gain: float) -> np.float32:
        """Energy added to every band of sound and templates alike: what lies MASK_DB below the voice does not count."""
        return np.float32(gain * self._mask_energy)

    def compose(self, noise: NDArray[np.float32], gain: float) -> None:
        """Make the templates what they would be in this noise at this gain, if either moved enough to matter."""
        if gain == self._gain and float(np.abs(np.log(noise / self._noise)).mean()) < RECOMPOSE_NEPER:
            return
        self._noise = noise.copy()
        self._gain = gain
        self._noise_features = noise_features(noise)
        for rung, step in enumerate(self._ladder):
            self._bank.compose(noise, gain * float(step), self._features[rung])
            np.einsum("uf,uf->u", self._features[rung], self._features[rung], out=self._norms[rung])

    def score(self, features: Features) -> Scores:
        """Euclidean distances of `features` (n, N_FEATURES) to every template frame, the noise and the cohort."""
        n = len(features)
        own = np.einsum("nf,nf->n", features, features)
        out = np.full((len(self._ladder), n, self._bank.n_frames + 1), UNREACHABLE, np.float32)
        for rung in range(len(self._ladder)):
            d = features @ self._features[rung].T
            d *= -2.0
            d += self._norms[rung]
            d += own[:, None]
            np.maximum(d, 0.0, out=d)
            np.sqrt(d, out=out[rung, :, :-1])
        noise = np.sqrt(((features - self._noise_features) ** 2).sum(axis=1))
        return Scores(out, noise, out.min(axis=(0, 2)))

    def gather(self, scores: Scores, index: int, filler: float, out: NDArray[np.float32]) -> None:
        """Distances of frame `index` less the filler's cost, a state each: `out` has shape (n_rungs, n_states)."""
        for rung in range(len(self._ladder)):
            np.take(scores.templates[rung, index] - np.float32(filler), self._frame_of_state, out=out[rung])
