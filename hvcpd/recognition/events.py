"""The recogniser's events. Positions are numbers of samples since the recogniser was made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from hvcpd.ports import Samples


class Source(StrEnum):
    """The stage that found a sentence: see docs/recognition.md."""

    TEMPLATES = "templates"
    """Templates of robots' words, composed with the noise (`decoder_session`)."""
    CHANNEL = "channel"
    """Robots' words through a channel that was estimated with them (`channel`)."""
    PEOPLE = "people"
    """A person's words (`hvcpd.people`)."""
    SPELLED = "spelled"
    """An unknown name that a robot spells."""


@dataclass(frozen=True)
class WordSpan:
    """One word of a recognised sentence, its position, and the probability that it alone is right (0 to 1)."""

    word: str
    start_sample: int
    end_sample: int
    confidence: float


@dataclass(frozen=True, eq=False)
class Received:
    """Sound as received, shape (n,), from sample `start` on."""

    start: int
    samples: Samples

    def between(self, first: int, n: int) -> Samples:
        """Its samples `first` up to `first + n`, zero where there are none."""
        out = np.zeros(n, np.float32)
        begin, end = max(self.start, first), min(self.start + len(self.samples), first + n)
        if begin < end:
            out[begin - first : end - first] = self.samples[begin - self.start : end - self.start]
        return out


@dataclass(frozen=True)
class Recognised:
    """A whole sentence of the word network.

    `voice` is the name of the template voice that fitted best, `confidence` the probability that every word is
    right (0 to 1), `snr_db` the mean power of the sentence over that of the tracked noise (NaN where only a second pass
    knows of it), `source` the stage that found it.
    """

    words: tuple[str, ...]
    voice: str
    start_sample: int
    end_sample: int
    confidence: float
    snr_db: float
    spans: tuple[WordSpan, ...]
    source: Source = Source.TEMPLATES
    received: Received | None = field(default=None, compare=False, repr=False)
    """Its sound as it was received, if that is known to the sample."""

    @classmethod
    def of(cls, spans: Sequence[WordSpan], voice: str, confidence: float, source: Source) -> Recognised:
        """A sentence of these words, one or more, from the beginning of the first to the end of the last."""
        words, start, end = tuple(span.word for span in spans), spans[0].start_sample, spans[-1].end_sample
        return cls(words, voice, start, end, confidence, math.nan, tuple(spans), source)


@dataclass(frozen=True)
class Span:
    """Samples `start_sample` up to `end_sample`."""

    start_sample: int
    end_sample: int


@dataclass(frozen=True)
class Garbled(Span):
    """Somebody spoke, but no sentence of the network fits: it began late, was cut off, overlapped, or is other speech.

    `robot`: in the voice of a robot; `addressed`: in another one, but surely enough a sentence for this robot by name.
    """

    robot: bool = False
    addressed: bool = False


class Held(Span):
    """The keyword may have been said: stand still until `Released` or `Urgent`."""


class Released(Span):
    """It was not: the detection was part of a sentence, or too uncertain."""


class Urgent(Span):
    """The keyword was said; it ended at `end_sample`."""


KeywordEvent = Held | Released | Urgent
"""What a detector of the keyword reports."""
Event = Recognised | Garbled | KeywordEvent
"""The recogniser's events. After a `Held` comes one `Released` or `Urgent`, also for several `Held` in a row."""
