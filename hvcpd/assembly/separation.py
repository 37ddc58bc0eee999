"""Acoustic distance of phrases in noise, and the resulting confusion rates.

The distance is the decoder's own: the cost of its asymmetric DTW for one phrase against the templates of another,
both composed with the noise (see `templates`); hearing a phrase with its own templates costs 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.competition import Phrase
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.decoder import UNREACHABLE, StepCosts, dtw_column
from hvcpd.recognition.fitted import fitted
from hvcpd.recognition.frontend import (
    ENERGY_FLOOR,
    FFT_SIZE,
    N_BANDS,
    N_FEATURES,
    RUMBLE_HZ,
    Features,
    mel_filterbank,
    power_weights,
)
from hvcpd.recognition.network import PADDING
from hvcpd.recognition.templates import MASK_DB, Noise, TemplateBank


@dataclass(frozen=True)
class Condition:
    """A background: its colour and the SNR of the speech's mean power; None is a quiet room."""

    colour: str = "white"
    snr_db: float | None = None

    def __str__(self) -> str:
        return "quiet" if self.snr_db is None else f"{self.colour} noise at {self.snr_db:g} dB"


QUIET = Condition()
CONDITIONS = (QUIET, *(Condition(colour, snr_db) for snr_db in (0.0, -5.0) for colour in ("white", "pink")))
"""Quiet, and the two noises that are worst for vowels and for consonants, at the levels that robots must still hear."""


@dataclass(frozen=True)
class ConfusionCurve:
    """Rate at which a phrase is taken for another at distance D: Φ(-scale · D^power), one half at D = 0.

    Of two phrases that sound the same either is heard as often. Fitted by `benchmarks/vocabulary.py` to words of other
    pitch and rate than the templates', one curve for all backgrounds, since D itself shrinks as noise grows.
    """

    scale: float = field(default_factory=lambda: float(fitted("confusion")["weights"]["scale"]))
    power: float = field(default_factory=lambda: float(fitted("confusion")["weights"]["power"]))

    def rate(self, distance: float) -> float:
        """The predicted rate, 0 to 0.5, at a distance of 0 or more."""
        return 0.5 * math.erfc(self.scale * max(distance, 0.0) ** self.power / math.sqrt(2.0))


def band_noise(colour: str) -> Noise:
    """Mean mel energies of noise of that colour ("white" or "pink"), shape (N_BANDS,), of power 1 as the bands see it.

    Raises ValueError for any other colour.
    """
    hz = np.maximum(np.fft.rfftfreq(FFT_SIZE, 1.0 / SAMPLE_RATE_HZ), RUMBLE_HZ)
    if colour not in ("white", "pink"):
        raise ValueError(f"no noise is called {colour!r}")
    spectrum = np.ones_like(hz) if colour == "white" else 1.0 / hz
    bands = np.asarray(spectrum @ mel_filterbank(), np.float32)
    return np.asarray(bands / (bands @ power_weights()), np.float32)


class VoiceSounds:
    """One voice's words in every condition of `conditions`."""

    def __init__(
        self, words: Mapping[str, Sequence[Samples]], conditions: Sequence[Condition] = CONDITIONS, every: int = 1
    ) -> None:
        """`words[word]`: its templates, the one before a pause last. Raises ValueError if there are none.

        Only one frame in `every` is used. This divides the cost by the square of `every`, and distances by `every`.
        """
        self.conditions = tuple(conditions)
        self.bank = TemplateBank({"": words})
        power = float(self.bank.energies.mean(axis=0, dtype=np.float32) @ power_weights())
        self.mask = 10.0 ** (-MASK_DB / 10.0) * float(self.bank.loud_spectrum.mean())
        """Energy that the scorer adds to every band, so that faint sounds do not count."""
        self.noises = np.stack([_noise_of(condition, power) + np.float32(self.mask) for condition in self.conditions])
        """Shape (n_conditions, N_BANDS), relative to the bank's energies, with the mask."""
        rows = np.arange(self.bank.n_frames)
        features = np.stack([self.bank.compose(rows, noise, 1.0) for noise in self.noises])
        self._words: dict[str, list[Features]] = {}
        for t in self.bank.templates:
            self._words.setdefault(t.word, []).append(features[:, t.first : t.first + t.length : every])

    def takes(self, phrase: Phrase) -> list[Features]:
        """The phrase as it is said in the middle and at the end, each of shape (n_conditions, frames, N_FEATURES)."""
        begin = [self._words[word][0] for word in phrase[:-1]]
        return [np.concatenate([*begin, last], axis=1) for last in self._words[phrase[-1]]]

    def distances(self, phrase: Phrase, others: Sequence[Phrase]) -> NDArray[np.float32]:
        """DTW cost of `phrase` against each of `others`, shape (n_conditions, n_others): the least over its takes."""
        references = References([self.takes(other) for other in others])
        return np.asarray(np.min([references.costs(take) for take in self.takes(phrase)], axis=0), np.float32)


def _noise_of(condition: Condition, speech_power: float) -> Noise:
    if condition.snr_db is None:
        return np.full(N_BANDS, ENERGY_FLOOR, np.float32)
    return band_noise(condition.colour) * np.float32(speech_power * 10.0 ** (-condition.snr_db / 10.0))


class References:
    """Phrases to compare a sound with, laid out as the decoder lays out its instances: side by side in one vector."""

    def __init__(self, phrases: Iterable[Sequence[Features]], condition: int | None = None) -> None:
        """`phrases`: of each, its takes, of shape (n_conditions, frames, N_FEATURES), 1 frame or more.

        With `condition`, only that one of the conditions.
        """
        part = slice(None) if condition is None else slice(condition, condition + 1)
        takes = [[take[part] for take in t] for t in phrases]
        flat = [take for t in takes for take in t]
        self._phrase_begins = np.cumsum([0, *(len(t) for t in takes)])[:-1]
        sizes = np.array([take.shape[1] + PADDING for take in flat])
        self._begin = np.cumsum(sizes) - sizes
        self._last = self._begin + sizes - 1
        self._features = np.zeros((len(flat[0]), int(sizes.sum()), N_FEATURES), np.float32)
        for begin, last, take in zip(self._begin, self._last, flat, strict=True):
            self._features[:, begin + PADDING : last + 1] = take
        self._norms = (self._features**2).sum(axis=2)

    def costs(self, heard: Features) -> NDArray[np.float32]:
        """DTW cost of `heard`, shape (n_conditions, frames, N_FEATURES), as each phrase: (n_conditions, n_phrases).

        UNREACHABLE for a phrase that is more than twice as long.
        """
        steps = StepCosts()
        ahead = (self._begin[:, None] + np.arange(PADDING)).ravel()
        cost = np.full(self._norms.shape, UNREACHABLE, np.float32)
        cost[:, self._begin + PADDING - 1] = 0.0
        following = np.full_like(cost, UNREACHABLE)
        squares = heard @ self._features.transpose(0, 2, 1) * -2.0
        squares += self._norms[:, None] + (heard**2).sum(axis=2)[:, :, None]
        distances = np.sqrt(np.maximum(squares, 0.0, out=squares), out=squares)
        for frame in range(heard.shape[1]):
            dtw_column(cost, distances[:, frame], steps, following)
            following[:, ahead] = UNREACHABLE
            cost, following = following, cost
        ends = np.minimum(cost[:, self._last], UNREACHABLE)
        return np.asarray(np.minimum.reduceat(ends, self._phrase_begins, axis=1), np.float32)
