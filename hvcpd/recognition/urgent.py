"""Hears one urgent word while somebody else speaks, where no sentence can be recognised.

The loudest voice decides what is heard in each cell of time and frequency (log-max approximation: Varga & Moore,
"Hidden Markov model decomposition of speech and noise", ICASSP 1990), so the word shows in some cells and elsewhere the
sound is louder than the word: that says nothing against it, while sound fainter than the word does (bounded
marginalisation: Cooke et al., "Robust automatic speech recognition with missing and unreliable acoustic data", Speech
Communication 34(3), 2001). A word counts as heard at its end, without rest after it, for the other voice goes on.

Steps are those of the `decoder`; a path's score is the share of the word that was found, 1 for all of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import Samples
from hvcpd.recognition.frontend import ENERGY_FLOOR, Energies
from hvcpd.recognition.templates import trimmed_energies

PAIR = 2
"""Frames are taken two by two, 20 ms: vowels and hisses last longer, and it costs a quarter."""
LEVEL_PAIRS = 40
"""The level is that of the last 0.8 s: some syllables of whoever is loudest."""
LEVEL_QUANTILE = 0.75
FIRST_PAIRS = 18
"""When somebody begins to speak, the level is not known before 0.36 s: then there was a vowel after an S and a T."""
RETUNE_NEPER = 0.35
"""The templates are moved when the level has changed by 1.5 dB."""
KEPT_EXCUSES = 60
"""1.2 s: longer than a word waits to be told."""
_NOTHING = np.float32(-1e9)


@dataclass(frozen=True)
class UrgentSettings:
    """How the word is told from other talk; measured with `benchmarks/stop.py`."""

    threshold: float = 0.34
    """The share of the word that must be found, so that the robots' own talk holds none in ten minutes. At 0.42 there
    are 2, at 0.38 7, while of 100 calls at 0 dB under another voice 88 are heard at 0.45 and 100 at 0.38."""
    drowned_threshold: float = 0.45
    """The same of a word that is drowned: of six voices' babble 0.34 to 0.39 of it is found once a minute..."""
    drowned_db: float = 5.0
    """...where nobody is so much louder than the noise, which people's babble is to the noise tracker: its level was -2
    to 4 dB above. Calls as loud as pink noise were 5 dB above it..."""
    drowned_share: float = 0.55
    """...and less of the word stands out from it: 0.46 to 0.52 of the babble's likenesses, 0.57 and more of calls as
    loud as the babble."""
    rival_lead: float = 0.12
    """A rival must have so much more than the word: under another voice its end costs nothing, so that it has up to
    0.07 more where the word was said."""
    gains_db: tuple[float, ...] = (-4.0, 0.0, 4.0)
    """The word's level may be so far from the level of all that is heard."""
    sigma_db: float = 3.0
    """The spread of a cell in which the word is the louder voice."""
    worst: float = -4.0
    """The least that a cell counts: where the sound is fainter than the word must be. Found cells count 1."""
    slack: float = 0.04
    """Cost of staying in a frame of the word or of skipping one: about a frame's share of the word."""
    band_range_db: float = 20.0
    """In each frame, bands so far below its loudest one do not count."""
    frame_range_db: float = 40.0
    """Frames so far below the word's loudest one, as in a closure, do not count..."""
    frame_full_db: float = 25.0
    """...and those no further below than this count in full."""
    hold_frames: int = 16
    """160 ms after the word a rival that goes on ("stopped") has shown."""
    hold_most_frames: int = 42
    """420 ms after the word the recogniser has told whether a whole sentence ended with it."""
    excuse_frames: tuple[int, int] = (-6, 16)
    """So much before or after the word a phrase may end that excuses it: "stopped" ends 160 ms later than "stop"."""


class Spotted(NamedTuple):
    """The word: the frame at which it ended, the share of it that was found, and that of the best excuse there."""

    end_frame: int
    score: float
    excuse: float


@dataclass(frozen=True)
class UrgentTemplates:
    """`words[voice]` and `rivals[voice]`: recordings, 16 kHz, float32, of the word and of words that begin like it."""

    words: Mapping[str, Sequence[Samples]]
    rivals: Mapping[str, Sequence[Samples]]
    texts: frozenset[str]
    """Both as they are written: a sentence with one of them accounts for what was heard."""
    excuses: Sequence[Samples] = field(default=())
    """What robots say that sounds like the word where two of them speak at once, such as "I have stopped"."""


def _pairs(energies: Energies) -> Energies:
    n = len(energies) // PAIR * PAIR
    out: Energies = energies[:n].reshape(-1, PAIR, energies.shape[1]).mean(axis=1)
    return out


class UrgentSpotter:
    """Feed it consecutive frames while somebody speaks, an even number at a time; `reset` in silence."""

    def __init__(self, templates: UrgentTemplates, settings: UrgentSettings | None = None) -> None:
        self.settings = s = settings or UrgentSettings()
        self.texts = templates.texts
        takes = [(t, "word") for ts in templates.words.values() for t in ts]
        takes += [(t, "rival") for ts in templates.rivals.values() for t in ts]
        takes += [(t, "excuse") for t in templates.excuses]
        rows = [self._normalised(take) for take, _ in takes]
        lengths = np.array([len(row) for row in rows])
        # Band by band, so that the vector operations of `_step` have long rows: shape (N_BANDS, 1, frames).
        self._energies = np.concatenate(rows).T[:, None].copy()
        self._weights = np.concatenate([self._weight(row) for row in rows]).T[:, None].copy()
        self._last = np.cumsum(lengths) - 1
        self._first = self._last - lengths + 1
        kinds = np.array([kind for _, kind in takes])
        self._word, self._rival, self._excuse = (kinds == kind for kind in ("word", "rival", "excuse"))
        self._gains = (10.0 ** (np.array(s.gains_db) / 10.0)).astype(np.float32)
        self.reset()

    @property
    def pending(self) -> bool:
        """Whether the word was heard and not told yet."""
        return self._pending is not None

    @property
    def length(self) -> int:
        """How long the word is, frames."""
        return PAIR * int((self._last - self._first + 1)[self._word].mean())

    def reset(self) -> None:
        """Forget what was heard."""
        shape = (len(self._gains), self._energies.shape[-1])
        self._score = np.full(shape, _NOTHING, np.float32)
        self._advance_to, self._skip_to = np.empty_like(self._score), np.empty_like(self._score)
        self._powers = np.zeros(0)
        self._early = np.zeros((0, len(self._energies)), np.float32)
        self._frame = 0
        self._level = 0.0
        self._least_level = 1e-9
        self._pending: tuple[int, float] | None = None
        self._excuses: dict[int, float] = {}

    @staticmethod
    def _normalised(take: Samples) -> Energies:
        energies = _pairs(trimmed_energies(take))
        energies = np.maximum(energies - ENERGY_FLOOR, 0.0)
        return np.asarray(energies / energies.sum(axis=1).mean(), np.float32)

    def _weight(self, energies: Energies) -> NDArray[np.float32]:
        """What each cell counts, 1 in all: frames alike, so that vowels alone are not the word."""
        s = self.settings
        level_db = 10.0 * np.log10(energies + 1e-9)
        top_db = level_db.max(axis=1, keepdims=True)
        weight = np.clip((level_db - top_db) / s.band_range_db + 1.0, 0.0, 1.0)
        weight /= weight.sum(axis=1, keepdims=True)
        weight *= np.clip((top_db - top_db.max() + s.frame_range_db) / (s.frame_range_db - s.frame_full_db), 0.0, 1.0)
        return np.asarray(weight / weight.sum(), np.float32)

    def again(self, gains_db: Sequence[float]) -> UrgentSpotter:
        """Another one with the same templates, which may be so far from the level of all that is heard."""
        other = copy(self)
        other._gains = (10.0 ** (np.array(gains_db) / 10.0)).astype(np.float32)
        other.reset()
        return other

    def feed(self, first_frame: int, energies: Energies, noise: NDArray[np.float32], least_level: float = 0.0) -> None:
        """Take frames from `first_frame` on, shape (n, N_BANDS), and the noise's energies, shape (N_BANDS,).

        `least_level`: of the word, as the sum of a frame's energies.
        """
        self._least_level = max(least_level, 1e-9)
        if not (len(self._early) or len(self._powers)):
            self._frame = first_frame
        for _ in self._advance(energies, noise):
            self._frame += PAIR
            self._look(self._frame)

    def share_in(self, energies: Energies, noise: NDArray[np.float32] | None = None) -> float:
        """How much of the word this sound alone would show, in that noise or without any; what was fed stays as it
        is."""
        other = copy(self)
        other.reset()
        noise = np.full(energies.shape[1], ENERGY_FLOOR, np.float32) if noise is None else noise
        missing = max(PAIR * FIRST_PAIRS - len(energies), 0)
        steps = other._advance(np.pad(np.maximum(energies, ENERGY_FLOOR), ((0, missing), (0, 0)), mode="edge"), noise)
        return max((float(other._score[:, self._last[self._word]].max()) for _ in steps), default=0.0)

    def _advance(self, energies: Energies, noise: NDArray[np.float32]) -> Iterator[None]:
        """Take the frames two by two."""
        pairs = _pairs(energies)
        if not len(self._powers):
            pairs = np.concatenate([self._early, pairs])
            self._early = pairs if len(pairs) < FIRST_PAIRS else pairs[:0]
            pairs = pairs[len(self._early) :]
        powers = np.maximum(pairs - noise, 0.0).sum(axis=1)
        known = 0
        for i, pair in enumerate(np.log(pairs)):
            if i >= known:
                known = FIRST_PAIRS if not len(self._powers) else i + 1
                self._powers = np.append(self._powers, powers[i:known])[-LEVEL_PAIRS:]
                self._tune(noise)
            self._step(pair)
            yield

    def _tune(self, noise: NDArray[np.float32]) -> None:
        rank = int(LEVEL_QUANTILE * (len(self._powers) - 1))
        level = max(float(np.partition(self._powers, rank)[rank]), self._least_level)
        if self._level and abs(np.log(level / self._level)) <= RETUNE_NEPER:
            return
        self._level = level
        word = self._energies * (np.float32(level) * self._gains)[:, None]
        composed = word + noise[:, None, None]
        self._logs = np.log(composed)
        audible = np.clip(1.5 * word / composed - 0.5, 0.0, 1.0)  # a cell below the noise tells nothing
        self._cells = audible * self._weights
        s = self.settings
        self._all_found = np.add.reduce(self._cells, axis=0)
        self._off = np.empty_like(self._logs)
        shares = np.add.reduceat(self._all_found, self._first, axis=1)[:, self._word]
        drowned = (shares < s.drowned_share) & (level < 10.0 ** (s.drowned_db / 10.0) * float(noise.sum()))
        self._least = np.where(drowned, s.drowned_threshold, s.threshold).astype(np.float32)

    def _step(self, sound: NDArray[np.float32]) -> None:
        s = self.settings
        # A cell counts 1 - off² / 2 for a spread of 1, no less than 0 where the sound is louder than the word, and than
        # `worst` where it is fainter.
        unit = s.sigma_db * np.log(10.0) / 10.0
        off = np.subtract(sound[:, None, None], self._logs, out=self._off)
        np.clip(off, np.float32(-unit * (2.0 - 2.0 * s.worst) ** 0.5), np.float32(unit * 2.0**0.5), out=off)
        np.multiply(off, off, out=off)
        np.multiply(off, self._cells, out=off)
        gained = self._all_found - np.float32(0.5 / unit**2) * np.add.reduce(off, axis=0)
        score, advance, skip, slack = self._score, self._advance_to, self._skip_to, np.float32(s.slack)
        advance[:, 1:] = score[:, :-1]
        advance[:, self._first] = 0.0
        np.subtract(score[:, :-2], slack, out=skip[:, 2:])
        skip[:, self._first] = _NOTHING
        skip[:, self._first + 1] = -slack
        np.maximum(advance, skip, out=advance)
        advance += gained
        stay = score - slack
        stay += np.minimum(gained, 0.0)  # or a vowel held on would count for the word
        self._score = np.maximum(stay, advance, out=stay)

    def _look(self, end_frame: int) -> None:
        """Note the word where it fits best; forget it when a rival fits much better."""
        scores = self._score[:, self._last]
        words = scores[:, self._word]
        word = float(words.max(initial=_NOTHING, where=words >= self._least))
        ends = scores.max(axis=0)
        rival = float(ends[self._rival].max(initial=_NOTHING))
        self._excuses[self._frame] = float(ends[self._excuse].max(initial=_NOTHING))
        self._excuses.pop(self._frame - PAIR * KEPT_EXCUSES, None)
        if self._pending is not None and rival > self._pending[1] + self.settings.rival_lead:
            self._pending = None
        elif word > (_NOTHING if self._pending is None else self._pending[1]):
            self._pending = (end_frame, word)

    def ended(self, frame: int, sentence_ends: bool) -> Spotted | None:
        """The word, told once.

        `sentence_ends`: the recogniser may soon account for it.
        """
        if self._pending is None:
            return None
        s = self.settings
        if frame - self._pending[0] < (s.hold_most_frames if sentence_ends else s.hold_frames):
            return None
        return self.take()

    def take(self) -> Spotted | None:
        """The same without waiting for what comes after it; everything else is forgotten."""
        told = None
        if self._pending is not None:
            end, score = self._pending
            least, most = self.settings.excuse_frames
            near = (e for frame, e in self._excuses.items() if least <= frame - end <= most)
            told = Spotted(end, score, max(near, default=float(_NOTHING)))
        self.reset()
        return told

    def accounted(self, words: Sequence[str]) -> None:
        """The recogniser understood a sentence: with the word in it, nothing more is to be told."""
        if self._pending is not None and not self.texts.isdisjoint(words):
            self.reset()
