"""The recogniser's events, and the interfaces of its stages. Positions are numbers of samples since the recogniser was
made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol, Self

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.stream import Chunk, History


class Source(StrEnum):
    """The stage that found a sentence: see docs/recognition.md."""

    TEMPLATES = "templates"
    """Templates of robots' words, composed with the noise (`decoder_session`)."""
    CHANNEL = "channel"
    """Robots' words through a channel that was estimated with them (`channel`)."""
    PEOPLE = "people"
    """Anybody's words (`hvcpd.people`)."""
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


@dataclass(frozen=True)
class Span:
    """Samples `start_sample` up to `end_sample`."""

    start_sample: int
    end_sample: int


@dataclass(frozen=True)
class Garbled(Span):
    """Somebody spoke, but no sentence of the network fits: it began late, was cut off, overlapped, or is other speech.

    `robot`: in the voice of a robot.
    """

    robot: bool = False


class Held(Span):
    """The keyword may have been said: stand still until `Released` or `Urgent`."""


class Released(Span):
    """It was not: the detection was part of a sentence, or too uncertain."""


class Urgent(Span):
    """The keyword was said; it ended at `end_sample`."""


Event = Recognised | Garbled | Held | Released | Urgent
"""The recogniser's events. After a `Held` comes one `Released` or `Urgent`, also for several `Held` in a row."""


class FirstPass(Protocol):
    """The first pass, a streaming recogniser, as the stages around it see it."""

    @property
    def speaking(self) -> bool:
        """Whether somebody else is speaking right now, or paused a moment ago."""

    @property
    def possible_speech(self) -> bool:
        """Whether the most recent sound may be speech, however faint."""

    @property
    def chunks(self) -> Sequence[Chunk]:
        """The frames of the last push."""

    @property
    def history(self) -> History:
        """What was heard in the last seconds, up to the last push."""

    @property
    def ending_word(self) -> str:
        """The last word of a robot's sentence that may have ended just now, and may be reported soon; "" if there is
        none."""

    @property
    def sentence_since(self) -> int | None:
        """The sample at which a robot's sentence that is surely in progress was first seen, 0.1 to 0.3 s after its
        beginning; None if none is."""

    @property
    def sentence_gain(self) -> float:
        """How much better a robot's sentence explains the last half second than other sound would, in units of the
        templates' distance; 0 if none is in progress."""

    def snr_db(self, start_sample: int, end_sample: int) -> float:
        """Mean level of what was heard between two samples, without the noise, over the tracked noise, dB."""


class SpeechRecogniser(Protocol):
    """A speech recogniser, as the robot uses it: the first pass, alone or with stages around it."""

    @property
    def first_pass(self) -> FirstPass:
        """The innermost stage."""

    @property
    def busy(self) -> bool:
        """Whether somebody else is speaking, or has spoken and may still be understood."""

    def flush(self) -> list[Event]:
        """The events that the end of a recording completes."""

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        """The events that the next samples complete, shape (n,), any n; `masked` while the robot itself speaks."""

    def lost(self, n_samples: int) -> list[Event]:
        """The events of advancing time by lost samples, 0 if their number is unknown."""

    def adopt(self, others: Self) -> None:
        """Take over, between two sentences, the vocabulary of another recogniser with the same stages, which has heard
        nothing."""

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make the slow first-time preparations while `go_on` holds, in any thread."""


class RecogniserStage:
    """A stage around another recogniser; what it does not change passes through."""

    def __init__(self, inner: SpeechRecogniser) -> None:
        self._inner = inner
        self.first_pass = inner.first_pass

    @property
    def busy(self) -> bool:
        """As `SpeechRecogniser.busy`."""
        return self._inner.busy

    def adopt(self, others: Self) -> None:
        """As `SpeechRecogniser.adopt`."""
        self._inner.adopt(others._inner)

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """As `SpeechRecogniser.prepare`."""
        self._inner.prepare(go_on)
