"""Segments talk that lasts longer than any sentence at its pauses, as soon as each pause is heard."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.activity import WAIT_FRAMES
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.stream import cleaned

FRAME_SAMPLES = 320
"""20 ms, on the grid of the sample clock, so that the size of blocks changes nothing."""
ENDED_FRAMES = WAIT_FRAMES * HOP_SAMPLES // FRAME_SAMPLES
"""In which nobody speaks: they end the talk, whose speech is reported as a whole then."""
PAUSE_FRAMES = 12
"""0.24 s: the closures of stop consonants are shorter, the pauses between two sentences longer."""
PAUSE_SHARE = 0.35
"""Share of the range from the noise to the voice, in dB; fainter sound belongs to a pause."""
LEAST_RANGE_DB = 8.0
"""With a smaller range between the faintest and the loudest level, pauses cannot be told from speech."""
FALL_DB, RISE_DB = 0.06, 0.06
"""Decay per frame: the loudest level falls at 3 dB/s, and the faintest rises as fast."""
LEAST_FRAMES, MOST_FRAMES = 15, 400
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
        self._longest = longest_samples
        self._rest = np.zeros(0, np.float32)
        self._at = 0
        self.end_talk()

    def end_talk(self) -> None:
        """Start again: nobody speaks any more, or sound was lost."""
        self._since: int | None = None
        self._loud_db, self._faint_db = -120.0, 0.0
        self._silent = 0
        self._faint = PAUSE_FRAMES
        self._began: int | None = None
        self._starts: deque[int] = deque(maxlen=MOST_PAUSES + 1)

    def push(self, at: int, block: Samples, busy: bool) -> list[Stretch]:
        """Take a block, shape (n,), that begins at sample `at`, and whether somebody speaks."""
        if self._since is None and not busy:
            return []
        if at != self._at + len(self._rest):
            self.end_talk()
            skip = min(-at % FRAME_SAMPLES, len(block))
            self._rest, self._at, block = block[:0], at + skip, block[skip:]
        sound = np.concatenate([self._rest, cleaned(block)])
        n = len(sound) // FRAME_SAMPLES
        frames = sound[: n * FRAME_SAMPLES].reshape(n, FRAME_SAMPLES).astype(np.float64)
        levels_db = 10.0 * np.log10(np.mean(frames**2, axis=1) + 1e-12)
        found = []
        for level_db in levels_db:
            found += self._hear(float(level_db), busy)
            self._at += FRAME_SAMPLES
        self._rest = sound[n * FRAME_SAMPLES :]
        return found

    def _hear(self, level_db: float, busy: bool) -> list[Stretch]:
        self._loud_db = max(level_db, self._loud_db - FALL_DB)
        self._faint_db = min(level_db, self._faint_db + RISE_DB)
        self._silent = 0 if busy else self._silent + 1
        if self._silent >= ENDED_FRAMES:
            self.end_talk()
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
        end = self._at - (PAUSE_FRAMES - 1) * FRAME_SAMPLES
        if began is None or self._since is None:
            return []
        self._starts.append(began)
        starts = tuple(s for s in self._starts if LEAST_FRAMES <= (end - s) // FRAME_SAMPLES <= MOST_FRAMES)
        return [Stretch(starts, end)] if starts and end - self._since > self._longest else []
