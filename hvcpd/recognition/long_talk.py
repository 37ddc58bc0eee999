"""Segments talk that lasts longer than any sentence at its pauses, as soon as each pause is heard."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hvcpd.recognition.activity import WAIT_FRAMES
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.stream import Chunk

PAUSE_FRAMES = 24
"""0.24 s: the closures of stop consonants are shorter, the pauses between two sentences longer."""
PAUSE_SHARE = 0.35
"""Share of the range from the noise to the voice, in dB; fainter sound belongs to a pause."""
LEAST_RANGE_DB = 8.0
"""With a smaller range between the faintest and the loudest level, pauses cannot be told from speech."""
FALL_DB, RISE_DB = 0.03, 0.03
"""Decay per frame: the loudest level falls at 3 dB/s, and the faintest rises as fast."""
LEAST_FRAMES, MOST_FRAMES = 30, 800
"""0.3 to 8 s: how long a sentence takes."""
MOST_PAUSES = 2
"""Maximum number of pauses within a sentence: after the greeting and after the name."""


@dataclass(frozen=True)
class Stretch:
    """Speech from one pause to another, in samples; `starts`, the earliest first: possible beginnings of a sentence
    that ends with it."""

    starts: tuple[int, ...]
    end: int


class LongTalk:
    """Tracks levels while somebody speaks."""

    def __init__(self, longest_samples: int) -> None:
        """`longest_samples`: shorter talk is left to listeners that search it as a whole."""
        self._longest = longest_samples // HOP_SAMPLES
        self._at = 0
        self._end_talk()

    def _end_talk(self) -> None:
        """Start again: nobody speaks any more, or sound was lost."""
        self._since: int | None = None
        self._loud_db, self._faint_db = -120.0, 0.0
        self._silent = 0
        self._faint = PAUSE_FRAMES
        self._began: int | None = None
        self._starts: deque[int] = deque(maxlen=MOST_PAUSES + 1)

    def push(self, chunks: Sequence[Chunk], busy: bool) -> list[Stretch]:
        """Take the next frames, and whether somebody speaks."""
        found: list[Stretch] = []
        for chunk in chunks if busy or self._since is not None else ():
            if chunk.first_frame != self._at:
                self._end_talk()
            self._at = chunk.first_frame
            for level_db in (10.0 * np.log10(chunk.energies.sum(axis=1))).tolist():
                found += self._hear(level_db, busy)
                self._at += 1
        return found

    def _hear(self, level_db: float, busy: bool) -> list[Stretch]:
        self._loud_db = max(level_db, self._loud_db - FALL_DB)
        self._faint_db = min(level_db, self._faint_db + RISE_DB)
        self._silent = 0 if busy else self._silent + 1
        if self._silent >= WAIT_FRAMES:  # it ends the talk, whose speech is reported as a whole then
            self._end_talk()
        elif busy and self._since is None:
            self._since = self._at
        if self._since is None:
            return []
        range_db = self._loud_db - self._faint_db
        pauses = range_db >= LEAST_RANGE_DB and level_db < self._faint_db + PAUSE_SHARE * range_db
        self._faint = self._faint + 1 if pauses else 0
        if not pauses and self._began is None:
            self._began = self._at
        return self._paused() if self._faint == PAUSE_FRAMES else []

    def _paused(self) -> list[Stretch]:
        """Handle a pause that has lasted long enough."""
        began, self._began = self._began, None
        end = self._at - (PAUSE_FRAMES - 1)
        if began is None or self._since is None:
            return []
        self._starts.append(began)
        starts = tuple(s * HOP_SAMPLES for s in self._starts if LEAST_FRAMES <= end - s <= MOST_FRAMES)
        return [Stretch(starts, end * HOP_SAMPLES)] if starts and end - self._since > self._longest else []
