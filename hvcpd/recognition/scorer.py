"""The acoustic scorer: distances of the sound to template frames composed with the current noise and level."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.arrays import lazy_zeros, unique
from hvcpd.recognition.frontend import N_BANDS, N_FEATURES, Features, power_ratio, snr_db
from hvcpd.recognition.network import ActiveStates
from hvcpd.recognition.templates import Noise, TemplateBank, noise_features

RECOMPOSE_NEPER = 0.12
"""Change of the noise (0.5 dB, mean over the bands) from which on templates are composed again: a lower threshold gains
nothing."""

NOISE_DISTANCE = 1.7
"""Distance of a frame of steady noise to the noise's mean (measured, white and pink)."""

CODEBOOK_FRAMES = 3000
"""Size of the cohort: template frames, evenly chosen, that represent all speech sounds."""


class Scorer:
    """Composes the templates in use with noise and gains, and measures distances to them."""

    def __init__(self, bank: TemplateBank, gains_db: tuple[float, ...]) -> None:
        self._bank = bank
        self._gain_factors = [power_ratio(db) for db in gains_db]
        self._codebook = unique(np.linspace(0, bank.n_frames - 1, CODEBOOK_FRAMES).astype(np.intp))
        self._codebook_features = np.zeros((0, N_FEATURES), np.float32)
        self._codebook_norms = np.zeros(0, np.float32)
        self.free_memory()
        self._features = np.zeros((0, N_FEATURES), np.float32)
        self._norms = np.zeros(0, np.float32)
        self._noise_features = np.zeros(N_FEATURES, np.float32)
        self._noise = np.zeros(N_BANDS, np.float32)
        self._gain = math.nan

    def free_memory(self) -> None:
        """Free the memory of composed templates, most of the scorer's memory: nothing is decoded for a while.

        `_composed` has the features of each frame at each gain hypothesis, where `_is_composed`.
        """
        shape = len(self._gain_factors), self._bank.n_frames
        self._composed: Features = lazy_zeros((*shape, N_FEATURES), np.float32)
        self._is_composed = np.zeros(shape, np.bool_)

    def voice_snr_db(self, gain: float) -> float:
        """Level of the voice's vowels, at this gain, above the noise, dB over all bands."""
        noise = float(self._noise.sum()) - N_BANDS * float(self._bank.mask(gain))
        return snr_db(gain * float(self._bank.loud_spectrum.sum()), noise)

    def compose(self, noise: Noise, gain: float) -> None:
        """Compose the templates again with this noise at this gain, if either changed enough to matter."""
        if gain == self._gain and float(np.abs(np.log(noise / self._noise)).mean()) < RECOMPOSE_NEPER:
            return
        self._noise = noise.copy()
        self._gain = gain
        self._is_composed.fill(False)
        self._noise_features = noise_features(noise)
        self._codebook_features = self._bank.compose(self._codebook, noise, gain)
        self._codebook_norms = norms_of(self._codebook_features)

    def expected_gain(self, rows: NDArray[np.intp], most: float) -> float:
        """Expected gain per frame of the right word over the noise, for the template's frames `rows`; `most` in each
        frame.

        Its distance to its template is that of noise, and so is its distance to the noise, except for the template's
        own distance.
        """
        away = self._bank.compose(rows, self._noise, self._gain) - self._noise_features
        squares = np.einsum("uf,uf->u", away, away) + NOISE_DISTANCE**2
        return float(np.minimum(np.sqrt(squares) - NOISE_DISTANCE, most).mean())

    def load_states(self, states: ActiveStates) -> None:
        """Load the features of these active states; templates are composed when first needed."""
        features = np.empty((states.n_states, N_FEATURES), np.float32)
        for hypothesis, (begin, end) in enumerate(pairwise(states.hypothesis_begins)):
            rows, composed = states.row[begin:end], self._composed[hypothesis]
            missing = rows[~self._is_composed[hypothesis, rows]]
            if len(missing):
                new = unique(missing)
                composed[new] = self._bank.compose(new, self._noise, self._gain * self._gain_factors[hypothesis])
                self._is_composed[hypothesis, new] = True
            np.take(composed, rows, axis=0, out=features[begin:end])
        self._features, self._norms = features, norms_of(features)

    def score(self, features: Features) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        """Euclidean distances of `features`, shape (n, N_FEATURES), to every active state, shape (n, n_states),
        to the noise, shape (n,), and to the nearest frame of the cohort, shape (n,)."""
        states = distances(features, self._features, self._norms)
        cohort = squared_distances(features, self._codebook_features, self._codebook_norms).min(axis=1)
        noise = np.sqrt(((features - self._noise_features) ** 2).sum(axis=1))
        return states, noise, np.asarray(np.sqrt(cohort), np.float32)


def norms_of(features: Features) -> NDArray[np.float32]:
    """Squared norm of each row, shape (n,)."""
    norms: NDArray[np.float32] = np.einsum("uf,uf->u", features, features)
    return norms


def squared_distances(features: Features, others: Features, norms: NDArray[np.float32]) -> NDArray[np.float32]:
    """Squared distances, shape (len(features), len(others)), of `features` to `others`, whose squared norms are
    `norms`; 0 or more."""
    d: NDArray[np.float32] = features @ others.T
    d *= -2.0
    d += norms
    d += norms_of(features)[:, None]
    np.maximum(d, 0.0, out=d)
    return d


def distances(features: Features, others: Features, norms: NDArray[np.float32]) -> NDArray[np.float32]:
    """Euclidean distances, likewise."""
    squares = squared_distances(features, others, norms)
    found: NDArray[np.float32] = np.sqrt(squares, out=squares)
    return found
