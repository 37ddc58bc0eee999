"""Templates of words as linear mel energies, composed with the current noise; and the distances of the sound to them.

Parallel model combination (Gales & Young, "Robust continuous speech recognition using parallel model combination",
IEEE Trans. SAP 4(5), 1996), here for templates: sound powers add, so the noise's energies are added to the word's
before the logarithm and the DCT. The sound is then compared with the word as it would sound in this noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.arrays import lazy_zeros, unique
from hvcpd.recognition.frontend import (
    DELTA_REACH,
    ENERGY_FLOOR,
    HOP_SAMPLES,
    N_BANDS,
    N_CEPSTRA,
    N_FEATURES,
    WINDOW_SAMPLES,
    Energies,
    Features,
    cepstra_of,
    deltas_of,
    energies_of,
    power_ratio,
    smoothed,
)

TRIM_DB = 40.0
"""Edges this far below a template's loudest frame are silence, not part of the word."""
ROOM_RT60_S = 0.3
"""Templates are heard as in a room with this reverberation time: a furnished classroom's is 0.3 to 0.6 s. In the open
it costs nothing down to -9 dB; 0.45 s gains no more in rooms and costs a quarter of the sentences there (measured)."""
LOUD_FRACTION = 0.5
"""The louder half of a voice's frames gives its typical spectrum: vowels and voiced consonants."""
LEVEL_FRAMES = 7
"""The level is that of the loudest 70 ms: a vowel."""
MASK_DB = 16.0
"""Below the voice's loud spectrum by this much, sound is masked (Klatt 1976): in quiet, faint remainders of a word vary
from one utterance to the next, and their logarithms would count as much as the vowels; clipping and reverberation fill
the gaps between them. Measured: at 28 dB, 10 of 15 sentences with a tenth of their samples clipped; at 16 dB, 15."""

Noise = NDArray[np.float32]
HalfEnergies = NDArray[np.float16]
"""Energies to 0.05 %, in half the memory; 42 dB below a voice's mean to 3e-8 of it, far below the mask."""
Take: TypeAlias = "Samples | Energies"
"""One rendering of a word: a recording at 16 kHz, shape (n,), or its energies without noise and the silence around it,
shape (frames, N_BANDS)."""


@dataclass(frozen=True, slots=True)
class Template:
    """Frames `first` to `first + length` of the bank: one rendering of `word` by `voice`."""

    voice: str
    word: str
    first: int
    length: int


def trimmed_energies(samples: Samples) -> Energies:
    """Mel energies of one word without the silence around it, shape (frames, N_BANDS); at least one frame.

    The samples are padded by half a window, so that the first and the last sound keep their frames.
    """
    pad = (WINDOW_SAMPLES - HOP_SAMPLES) // 2
    padded = np.zeros(len(samples) + 2 * pad + HOP_SAMPLES, np.float32)
    padded[pad : pad + len(samples)] = samples
    energies = energies_of(padded)
    power = energies.sum(axis=1)
    loud = np.flatnonzero(power >= power.max() * power_ratio(-TRIM_DB))
    word = energies[loud[0] : loud[-1] + 1]
    return smoothed(np.concatenate([word[:1], word, word[-1:]]))


def reverberated(energies: Energies) -> Energies:
    """The energies of a word, shape (frames, N_BANDS), as they arrive from far across a room: reverberation only.

    Sound energy in a room decays exponentially, by 60 dB in ROOM_RT60_S, so each frame contains the decayed energy of
    the earlier frames (H. Kuttruff, "Room Acoustics"; for models of speech: H.-G. Hirsch & H. Finster, "A new approach
    for the adaptation of HMMs to reverberation and background noise", Speech Communication 50(3), 2008). The tail after
    the last frame is left out.
    """
    left = np.float32(power_ratio(-60.0 * HOP_SAMPLES / SAMPLE_RATE_HZ / ROOM_RT60_S))
    out = (1 - left) * energies
    reach = 1
    while reach < len(out) and left > 0.0:  # each frame sums the last `reach` frames, twice as many each time
        out[reach:] += left * out[:-reach]
        left, reach = left * left, 2 * reach
    return out


class TemplateBank:
    """All templates of all voices, one below the other.

    Each voice is scaled to the same mean power, so one gain describes a speaker's level.
    """

    def __init__(self, takes: Mapping[str, Mapping[str, Sequence[Take]]]) -> None:
        """`takes[voice][word]`: one or more; raises ValueError if there are none at all."""
        templates: list[Template] = []
        blocks: list[HalfEnergies] = []
        first = 0
        for voice, words in takes.items():
            takes_of = [(word, take) for word, of_word in words.items() for take in of_word]
            rows = [(word, take if take.ndim == 2 else trimmed_energies(take)) for word, take in takes_of]
            if not rows:
                raise ValueError(f"voice {voice!r} has no templates")
            scale = np.float32(1.0) / np.concatenate([energies for _, energies in rows]).sum(axis=1).mean()
            for word, energies in rows:
                templates.append(Template(voice, word, first, len(energies)))
                blocks.append(reverberated(np.maximum(energies - ENERGY_FLOOR, 0.0) * scale).astype(np.float16))
                first += len(energies)
        if not blocks:
            raise ValueError("no templates")
        self.templates = tuple(templates)
        self.energies: HalfEnergies = np.concatenate(blocks)
        """Noise-free energies of every frame, shape (n_frames, N_BANDS), a voice's mean total being about 1."""
        self.n_frames = len(self.energies)
        power = self.energies.sum(axis=1, dtype=np.float32)
        rank = math.ceil(LOUD_FRACTION * (len(power) - 1))
        self.loud_spectrum = self.energies[power >= np.partition(power, rank)[rank]].mean(axis=0, dtype=np.float32)
        """Mean energies of the louder frames, shape (N_BANDS,)."""
        self._mask_energy = power_ratio(-MASK_DB) * float(self.loud_spectrum.mean())
        lengths = [t.length for t in templates]
        number = np.arange(len(templates), dtype=np.min_scalar_type(len(templates)))
        self._template = np.repeat(number, lengths)
        """Number of the template to which each frame belongs, shape (n_frames,)."""
        self._first_row = np.array([t.first for t in templates])
        self._last_row = self._first_row + lengths - 1
        """First and last frame of each template."""

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
        spectrum = self.loud_spectrum
        gain = 0.0
        for _ in range(3):
            weight = spectrum / (noise + gain * (spectrum + spectrum.mean())) ** 2
            gain = max(float((above @ weight).max() / (spectrum @ weight)), 0.0)
        return gain

    def mask(self, gain: float) -> np.float32:
        """Energy added to every band of sound and templates alike: sound MASK_DB below the voice does not count."""
        return np.float32(gain * self._mask_energy)

    def compose(self, rows: NDArray[np.intp], noise: Noise, gain: float) -> Features:
        """Features, shape (n, N_FEATURES), of the frames `rows` at power `gain` in `noise` (N_BANDS,).

        Templates are held beyond their first and last frames.
        """
        out = np.empty((len(rows), N_FEATURES), np.float32)
        template = self._template[rows]
        first, last = self._first_row[template], self._last_row[template]
        wanted = np.stack([np.clip(rows + k, first, last) for k in range(-DELTA_REACH, DELTA_REACH + 1)])
        used = unique(wanted)
        place = np.empty(self.n_frames, np.int32)
        place[used] = np.arange(len(used))
        c = cepstra_of(self.energies[used] * np.float32(gain) + noise)
        before2, before1, out[:, :N_CEPSTRA], after1, after2 = (c[at] for at in place[wanted])
        out[:, N_CEPSTRA:] = deltas_of(before2, before1, after1, after2)
        return out


def noise_features(noise: Noise) -> NDArray[np.float32]:
    """Features of the noise alone, shape (N_FEATURES,): its cepstrum, and no change over time."""
    return np.pad(cepstra_of(noise.reshape(1, N_BANDS))[0], (0, N_FEATURES - N_CEPSTRA))


RECOMPOSE_NEPER = 0.12
"""Change of the noise (0.5 dB, mean over the bands) from which on templates are composed again: less gains nothing."""

FILLER_COST = 1.2
"""Cost of the filler above the frame's best template, half-way between right and wrong words (measured)."""

NOISE_DISTANCE = 1.7
"""Distance of a frame of steady noise to the noise's mean (measured, white and pink)."""

CODEBOOK_FRAMES = 3000
"""Size of the cohort: template frames, evenly chosen, that represent all speech sounds."""


class Scorer:
    """Composes the templates in use with noise and gains, and scores frames by their distances to them.

    Costs are relative to the filler, which explains any sound: it costs as much as the noise, or FILLER_COST more than
    the nearest frame of the cohort.
    """

    def __init__(self, bank: TemplateBank, gains_db: tuple[float, ...]) -> None:
        self._bank = bank
        self._gain_factors = [power_ratio(db) for db in gains_db]
        self._codebook = unique(np.linspace(0, bank.n_frames - 1, CODEBOOK_FRAMES).astype(np.intp))
        self._noise, self._gain = np.zeros(N_BANDS, np.float32), math.nan
        self.free_memory()

    def free_memory(self) -> None:
        """Free the memory of composed templates, most of the scorer's memory: nothing is decoded for a while.

        `_composed` has the features of each frame at each gain hypothesis, where `_is_composed`.
        """
        shape = len(self._gain_factors), self._bank.n_frames
        self._composed: Features = lazy_zeros((*shape, N_FEATURES), np.float32)
        self._is_composed = np.zeros(shape, np.bool_)

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

    def expected_gain(self, rows: NDArray[np.intp]) -> float:
        """Expected gain per frame of the right word over the filler, for the template's frames `rows`.

        Its distance to its template is that of noise, and so is its distance to the noise, except for the template's
        own distance.
        """
        away = self._bank.compose(rows, self._noise, self._gain) - self._noise_features
        squares = norms_of(away) + NOISE_DISTANCE**2
        return float(np.minimum(np.sqrt(squares) - NOISE_DISTANCE, FILLER_COST).mean())

    def score(
        self, heard: Features, rows: NDArray[np.intp], begins: Sequence[int]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        """The costs of the features `heard`, shape (n, N_FEATURES), in every active state, shape (n, n_states), and as
        noise, shape (n,); and the filler's distance beyond that to the nearest frame of the cohort, shape (n,). `rows`:
        the states' frames in the bank, those of hypothesis r from `begins[r]` on."""
        states = self._states(rows, begins)
        to_cohort = np.sqrt(squared_distances(heard, self._codebook_features, self._codebook_norms).min(axis=1))
        to_noise = np.sqrt(((heard - self._noise_features) ** 2).sum(axis=1))
        filler = np.minimum(to_noise, to_cohort + np.float32(FILLER_COST))
        return distances(heard, states, norms_of(states)) - filler[:, None], to_noise - filler, filler - to_cohort

    def _states(self, rows: NDArray[np.intp], begins: Sequence[int]) -> Features:
        """Features of the active states; templates are composed when first needed."""
        features = np.empty((len(rows), N_FEATURES), np.float32)
        for factor, composed, is_composed, (begin, end) in zip(
            self._gain_factors, self._composed, self._is_composed, pairwise(begins), strict=True
        ):
            missing = rows[begin:end][~is_composed[rows[begin:end]]]
            if len(missing):
                new = unique(missing)
                composed[new] = self._bank.compose(new, self._noise, self._gain * factor)
                is_composed[new] = True
            np.take(composed, rows[begin:end], axis=0, out=features[begin:end])
        return features


def norms_of(features: Features) -> NDArray[np.float32]:
    """Squared norm of each row, shape (n,)."""
    return np.asarray(np.einsum("uf,uf->u", features, features), np.float32)


def squared_distances(features: Features, others: Features, norms: NDArray[np.float32]) -> NDArray[np.float32]:
    """Squared distances, shape (len(features), len(others)), of `features` to `others`, whose squared norms are
    `norms`; 0 or more."""
    d: NDArray[np.float32] = features @ others.T
    d *= -2.0
    d += norms
    d += norms_of(features)[:, None]
    return np.maximum(d, 0.0, out=d)


def distances(features: Features, others: Features, norms: NDArray[np.float32]) -> NDArray[np.float32]:
    """Euclidean distances, likewise."""
    squares = squared_distances(features, others, norms)
    return np.sqrt(squares, out=squares)
