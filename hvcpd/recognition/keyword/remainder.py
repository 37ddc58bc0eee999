"""The probability of the keyword once a sentence with known samples is removed from the sound.

A robot's sentence may partly mask a call, and a sentence and other talk together may sound like a call that nobody
made. Without the sentence the call stands alone (as radio receivers cancel the stronger signal: P. Patel & J. Holtzman,
"Analysis of a simple successive interference cancellation scheme", IEEE JSAC 12(5), 1994).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, energies_of
from hvcpd.recognition.keyword.net import KeywordNet, Probabilities
from hvcpd.recognition.keyword.words import LOOKS, second_highest
from hvcpd.recognition.stream import CHUNK_FRAMES, CHUNK_SAMPLES, Chunk

KEPT_CHUNKS = 300
"""12 s of sound are kept, 0.8 MB: a long sentence, the rest after it, and the sound before it."""
BEFORE = 3 * SAMPLE_RATE_HZ // 2
"""The net starts this long (1.5 s) before the word: its receptive field."""
AFTER = 3 * SAMPLE_RATE_HZ // 10
"""The net detects a word within 0.3 s,"""
AFTER_CALL = 3 * SAMPLE_RATE_HZ // 4
"""and knows within 0.75 s whether it was a call."""


class Remainder:
    """Push the sound into it."""

    def __init__(self, net: KeywordNet) -> None:
        """`net`: its own instance, because it starts again each time."""
        self._net = net
        self._kept = deque[Samples](maxlen=KEPT_CHUNKS)
        self._end = 0

    def hear(self, chunk: Chunk) -> None:
        """Push the next samples."""
        first = chunk.first_frame * HOP_SAMPLES
        if first != self._end:
            self._kept.clear()
        self._kept.append(chunk.samples)
        self._end = first + len(chunk.samples)

    def probabilities(self, sentence: Recognised, start: int, end: int) -> Probabilities | None:
        """The highest probabilities of the word, and of a call, between samples `start` and `end` without that
        sentence; None if the sentence's samples are unknown, or no longer kept."""
        oldest = self._end - sum(map(len, self._kept))
        first = max(start - BEFORE, oldest)
        if sentence.received is None or first > start:
            return None
        heard = np.concatenate(self._kept)[first - oldest : end + AFTER_CALL - oldest]
        energies = energies_of(heard - sentence.received.between(first, len(heard)))
        chunks = energies[: len(energies) // CHUNK_FRAMES * CHUNK_FRAMES].reshape(-1, CHUNK_FRAMES, N_BANDS)
        self._net.reset()
        probabilities = [self._net.hear(chunk) for chunk in chunks][(start - first) // CHUNK_SAMPLES :]
        in_word = (end + AFTER - start) // CHUNK_SAMPLES
        word = _highest([each.word for each in probabilities[:in_word]])
        call = _highest([each.call for each in probabilities])
        return Probabilities(word, call) if word is not None and call is not None else None


def _highest(probabilities: Sequence[float]) -> float | None:
    """The highest probability that counts; None if there are too few."""
    windows = (probabilities[k : k + LOOKS] for k in range(len(probabilities) - LOOKS + 1))
    return max(map(second_highest, windows), default=None)
