"""What is left of a sound once a sentence is taken out of it whose every sample is known, and how much of the urgent
word that still shows.

Amid other talk a sentence and the talk together may sound like the word, though neither does alone; a call over the
sentence is there all the more once the sentence is gone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.frontend import HOP_SAMPLES, energies_of
from hvcpd.recognition.paths import Coherent
from hvcpd.recognition.stream import Chunk
from hvcpd.recognition.urgent import UrgentSpotter

RECENT = 8 * SAMPLE_RATE_HZ // 5
"""Samples (1.6 s) that are kept: the word, and the longest wait until it is told."""
BEFORE = (0, SAMPLE_RATE_HZ // 20)
"""How long before the word (0 and 50 ms) its level is told from: it begins with the word, which stands alone when the
sentence is gone, and whose beginning is known so well. From what is earlier, the level would be that of silence."""
AFTER = 4 * SAMPLE_RATE_HZ // 5
"""So much after the word (0.8 s) is looked into as well: of "all stop", the first word and the sentence may sound like
the word that comes only then."""
LEFT = 0.32
"""The share of the word that is left, at most, if the sentence and other talk together made it up: 0.27 in babble as
loud as the sentence, where 0.34 to 0.46 was found. Calls as loud as the sentence have 0.43 and more left."""
MOST_KEPT = 8
"""Likenesses in one sentence of which the sound is kept, 0.15 MB each."""


@dataclass
class _Kept:
    """Where the word was heard, and what was heard there from sample `first` on, in that noise, shape (N_BANDS,)."""

    start: int
    end: int
    first: int
    samples: Samples
    noise: NDArray[np.float32]


class Remainder:
    """Tell it what is heard, where the word was, and which sentences were understood by their waveform."""

    def __init__(self, spotter: UrgentSpotter) -> None:
        self._spotter = spotter
        self._recent: Samples = np.zeros(0, np.float32)
        self._end = 0
        self._kept: list[_Kept] = []
        self._understood: Sequence[Coherent] = ()

    def hear(self, chunk: Chunk) -> None:
        """The next samples."""
        first = chunk.first_frame * HOP_SAMPLES
        before = self._recent if first == self._end else self._recent[:0]
        self._recent = np.concatenate([before, chunk.samples])[-RECENT:]
        self._end = first + len(chunk.samples)
        for kept in self._kept:
            missing = kept.end + AFTER - self._end
            if first == kept.first + len(kept.samples) and missing > -len(chunk.samples):
                kept.samples = np.concatenate([kept.samples, chunk.samples])

    def keep(self, start: int, end: int, noise: NDArray[np.float32]) -> None:
        """The word was heard from sample `start` to `end`, both within RECENT; the sound there may be asked for."""
        oldest = self._end - len(self._recent)
        first = max(start - max(BEFORE), oldest)
        samples = self._recent[first - oldest :].copy()
        self._kept = [*self._kept[1 - MOST_KEPT :], _Kept(start, end, first, samples, noise.copy())]

    def understood(self, sentences: Sequence[Coherent]) -> None:
        """These may be told next."""
        self._understood = (*self._understood[-1:], *sentences)

    def explains(self, sentence: Recognised, start: int, end: int) -> bool:
        """Whether the word, heard from sample `start` to `end`, is no longer there without the sentence."""
        there = [each for each in self._kept if (each.start, each.end) == (start, end)]
        known = [each for each in self._understood if each.words[0].start == sentence.start_sample]
        if not there or not known or known[-1].words[-1].end != sentence.end_sample:
            return False
        kept = there[-1]
        left = kept.samples - known[-1].sound(kept.first, len(kept.samples))
        parts = [energies_of(left[max(start - before - kept.first, 0) :]) for before in BEFORE]
        return max(self._spotter.share_in(part, kept.noise) for part in parts) < LEFT
