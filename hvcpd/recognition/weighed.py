"""The last seconds of what was heard, weighed by its noise, for matched filters."""

from __future__ import annotations

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.matched import REACH, Weighing

KEPT = 3 * SAMPLE_RATE_HZ
"""Samples that are kept; a word is compared soon after it ended, and the one before a short sentence then."""
AGAIN = 3 * SAMPLE_RATE_HZ // 4
"""Samples that are weighed again when the weights have changed: most words are shorter, for another one it is done once
more."""


class WeighedSound:
    """Takes what is heard and gives it back, weighed, each sample once for each version of the weights."""

    def __init__(self) -> None:
        self.weighing = Weighing()
        self.end = 0
        """The number of the sample that comes next."""
        self._buffer = np.zeros(2 * KEPT, np.float32)
        self._filled = 0
        self._version = -1
        self._from = self._to = 0
        self._weighed: Samples = np.zeros(0, np.float32)

    def push(self, samples: Samples) -> None:
        """The next samples, shape (n,)."""
        if self._filled + len(samples) > len(self._buffer):
            self._buffer[:KEPT] = self._buffer[self._filled - KEPT : self._filled]
            self._filled = KEPT
        self._buffer[self._filled : self._filled + len(samples)] = samples
        self._filled += len(samples)
        self.end += len(samples)
        self.weighing.push(samples)

    def break_off(self, at: int) -> None:
        """What comes next, sample number `at`, does not follow on what was heard last."""
        self.weighing.interrupt()
        self._filled = 0
        self.end = at
        self._version = -1

    def between(self, start: int, end: int, more: bool = True) -> Samples:
        """Samples `start` up to `end`, weighed; silence where none are kept. `more`: earlier ones will be asked for."""
        if self._version != self.weighing.version or start < self._from:
            self._version = self.weighing.version
            self._from = self._to = min(start, self.end - AGAIN) if more else start
            self._weighed = np.zeros(0, np.float32)
        if self._to < self.end:
            heard = self.heard(self._to - REACH, self.end + REACH)
            self._weighed = np.concatenate([self._weighed, self.weighing.weigh(heard)])
            self._to = self.end
        found = self._weighed[start - self._from : end - self._from]
        return np.pad(found, (0, end - start - len(found))) if len(found) < end - start else found

    def heard(self, start: int, end: int) -> Samples:
        """Samples `start` up to `end` as they were heard; silence where none are kept."""
        oldest = self.end - self._filled
        kept = self._buffer[max(start - oldest, 0) : max(min(end, self.end) - oldest, 0)]
        return np.pad(kept, (max(oldest - start, 0), max(end - self.end, 0)))
