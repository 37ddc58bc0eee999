"""Derives words from the net's curves. Each word is reported as soon as it is possible, and again while the net grows
more certain."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import NamedTuple, Protocol

from hvcpd.recognition.frontend import Energies
from hvcpd.recognition.keyword.net import Probabilities
from hvcpd.recognition.stream import CHUNK_FRAMES, Chunk

POSSIBLE = 0.3
"""Least probability for standing still. Of calls as loud as other talk, synthesizers' and robots' have it
in 93 to 97 %, people's in 73 %; of people's other words, 4 % (`benchmarks.keyword.curve --part validate`)."""
LOOKS = 4
"""Of so many columns of the curve, 160 ms, the second highest counts. A word shows for longer than other talk that has
its end by chance: where the highest has as many of people's calls, it has half as much again of their other talk, or
twice as much where it is sure."""
LENGTH_FRAMES = 45
"""The word lasts about 0.45 s."""
DELAY_FRAMES = 12
"""It is detected about 120 ms after its end."""
ONE_WORD_FRAMES = 60
"""Detections within 0.6 s are one word: nobody says it faster."""
CALL_FRAMES = 80
"""Longest time after the first detection until the net knows whether it was a call."""


class Word(NamedTuple):
    """The word's approximate position, and the highest probabilities so far that it was said, and that it was a
    call."""

    start_frame: int
    end_frame: int
    probability: float
    call: float


class Net(Protocol):
    """The interface of `KeywordNet` that is used here."""

    def hear(self, energies: Energies) -> Probabilities: ...


def second_highest(probabilities: Iterable[float]) -> float:
    """The probability that counts, from the last LOOKS outputs of the net."""
    return sorted(probabilities)[-2]


class KeywordSpotter:
    """Listens to one stream."""

    def __init__(self, net: Net) -> None:
        self._net = net
        self._probabilities = deque([Probabilities(0.0, 0.0)] * LOOKS, LOOKS)
        self._word: Word | None = None
        self._since = 0

    def hear(self, chunk: Chunk) -> Word | None:
        """The word, if the next chunk makes it possible or more likely than before."""
        if len(chunk.energies) != CHUNK_FRAMES:
            return None
        self._probabilities.append(self._net.hear(chunk.energies))
        probability, call = map(second_highest, zip(*self._probabilities, strict=True))
        now = chunk.first_frame + CHUNK_FRAMES
        since = now - self._since
        if probability >= POSSIBLE and (self._word is None or since >= ONE_WORD_FRAMES):
            self._since, end = now, now - DELAY_FRAMES
            self._word = Word(max(end - LENGTH_FRAMES, 0), end, probability, call)
            return self._word
        if self._word is None or since >= CALL_FRAMES:
            return None
        before = self._word
        highest = max(before.probability, probability) if since < ONE_WORD_FRAMES else before.probability
        self._word = before._replace(probability=highest, call=max(before.call, call))
        return self._word if self._word != before else None
