"""The ear: the first pass, and the stages that its events go through, one after the other. Those of the second pass
have a worker search a segment of sound, at once or in a thread, and report its result with a later block. Nothing here
blocks.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import Generic, Protocol, Self, TypeVar

from hvcpd.ports import Samples, samples_in
from hvcpd.recognition.events import Event, Recognised
from hvcpd.recognition.stream import CHUNK_SAMPLES, NOISE_LEAD, History
from hvcpd.recognition.template_recogniser import TemplateRecogniser


class Reception(Enum):
    """What became of the newest samples."""

    HEARD = auto()
    OWN = auto()
    """The robot itself spoke."""
    LOST = auto()
    """They were lost, 0 if their number is unknown."""
    OVER = auto()
    """No more will come: the end of a recording."""


class Stage(ABC):
    """A stage: what the stages before it found comes in, and what is to be believed of it goes out."""

    def __init__(self, first_pass: TemplateRecogniser) -> None:
        self.first_pass = first_pass

    @property
    def busy(self) -> bool:
        """Whether somebody has spoken who may still be understood."""
        return False

    @abstractmethod
    def take(self, events: Sequence[Event], how: Reception, n_samples: int) -> list[Event]:
        """The events after the newest samples, which the first pass has heard already."""

    def adopt(self, other: Self) -> None:  # noqa: B027
        """Take over another one's vocabulary, if it has one."""

    def prepare(self, go_on: Callable[[], bool]) -> None:  # noqa: B027
        """Make the slow first-time preparations, if there are any, while `go_on` holds, in any thread."""


class SpeechRecogniser:
    """A speech recogniser, as the robot uses it: the first pass, and stages after it."""

    def __init__(self, first_pass: TemplateRecogniser, stages: Sequence[Stage] = ()) -> None:
        self.first_pass = first_pass
        self._stages = stages

    @property
    def busy(self) -> bool:
        """Whether somebody else is speaking, or has spoken and may still be understood."""
        return self.first_pass.busy or any(stage.busy for stage in self._stages)

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        """The events that the next samples complete, shape (n,), any n; `masked` while the robot itself speaks. Chunk
        by chunk, so that a long block gives the same events as short ones."""
        parts = [samples[at : at + CHUNK_SAMPLES] for at in range(0, max(len(samples), 1), CHUNK_SAMPLES)]
        how = Reception.OWN if masked else Reception.HEARD
        return [e for part in parts for e in self._followed_up(self.first_pass.push(part, masked), how, len(part))]

    def lost(self, n_samples: int) -> list[Event]:
        """The events of advancing time by lost samples, 0 if their number is unknown."""
        return self._followed_up(self.first_pass.lost(n_samples), Reception.LOST, n_samples)

    def flush(self) -> list[Event]:
        """The events that the end of a recording completes."""
        return self._followed_up(self.first_pass.flush(), Reception.OVER, 0)

    def _followed_up(self, events: list[Event], how: Reception, n_samples: int) -> list[Event]:
        for stage in self._stages:
            events = stage.take(events, how, n_samples)
        return events

    def adopt(self, others: SpeechRecogniser) -> None:
        """Take over, between two sentences, the vocabulary of one with the same stages, which has heard nothing."""
        self.first_pass.adopt(others.first_pass)
        for stage, other in zip(self._stages, others._stages, strict=True):
            stage.adopt(other)

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make the slow first-time preparations while `go_on` holds, in any thread; spelled names come last."""
        for stage in self._stages:
            stage.prepare(go_on)
        self.first_pass.prepare(go_on)


MARGIN_BEFORE, MARGIN_AFTER = samples_in(0.5), samples_in(0.4)
"""Margins around the noticed speech, for its faint beginning and end; MARGIN_AFTER has been heard when the event is
reported."""
QUIET = samples_in(0.5)
"""Time without a sign of speech that ends a segment: more than a pause at a comma in a room without echoes."""
GOES_ON_WITHIN = samples_in(1.0)
"""Time within which what is said after a possible part of a sentence may be the rest of it."""


@dataclass(frozen=True, eq=False)
class Segment:
    """Speech that was not understood, with the sound around it.

    `sound`, shape (n,), begins with `lead` samples from before the speech, without the robot's own. `start` and `end`
    are where the speech was noticed, in samples of the stream. A sentence that ends with it may also begin at one of
    the samples `later`.
    """

    sound: Samples
    lead: int
    start: int
    end: int
    later: tuple[int, ...] = ()

    @classmethod
    def of(cls, history: History, starts: Sequence[int], end: int) -> Segment | None:
        """Speech that begins at the first of `starts`, or later, with what comes before it; None if that is no longer
        kept."""
        start, *later = starts
        sound, lead = history.unmasked(start - NOISE_LEAD, start, end + MARGIN_AFTER)
        if len(sound) - lead < end - start:
            return None
        return cls(sound, lead, start, end, tuple(later))

    @property
    def origin(self) -> int:
        """The sample of the stream at which the sound begins."""
        return self.start - self.lead

    @property
    def speech_start(self) -> int:
        """The sample of the stream at which `speech` begins."""
        return max(self.start - MARGIN_BEFORE, self.origin)

    @property
    def speech(self) -> Samples:
        """The speech, with its margins."""
        return self.sound[self.speech_start - self.origin : self.end + MARGIN_AFTER - self.origin]

    @property
    def beginnings(self) -> list[Segment]:
        """This segment, and its shorter versions from each later beginning on."""
        return [self, *(replace(self, lead=self.lead + at - self.start, start=at, later=()) for at in self.later)]


Job = TypeVar("Job")
Result = TypeVar("Result")


class Worker(Protocol[Job, Result]):
    """Searches segments of sound, one after the other, and need not keep up with real time."""

    def submit(self, job: Job, search: Callable[[Job], Result]) -> bool:
        """Submit a segment and how to search it; false if the queue is full."""

    def results(self) -> Sequence[tuple[Job, Result]]:
        """The results since the last call."""


class SynchronousWorker(Generic[Job, Result]):
    """A worker that finishes each search before `submit` returns: for recordings, and for simulated time."""

    def __init__(self) -> None:
        self._found: list[tuple[Job, Result]] = []

    def submit(self, job: Job, search: Callable[[Job], Result]) -> bool:
        """As `Worker.submit`."""
        self._found.append((job, search(job)))
        return True

    def results(self) -> Sequence[tuple[Job, Result]]:
        """As `Worker.results`."""
        found, self._found = self._found, []
        return found


class Preparable(Protocol):
    """What is slow at first."""

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """As `Stage.prepare`."""


class SecondPassStage(Stage, Generic[Job, Result]):
    """A stage that submits segments of the last seconds to a second pass, whose result comes with later samples."""

    def __init__(self, first_pass: TemplateRecogniser, searcher: Preparable, worker: Worker[Job, Result]) -> None:
        super().__init__(first_pass)
        self._searcher = searcher
        self._worker = worker
        self._began = self._now = 0

    def take(self, events: Sequence[Event], how: Reception, n_samples: int) -> list[Event]:
        """As `Stage.take`."""
        if how is Reception.LOST:
            self._break_off(n_samples)
        self._began, self._now = self._now, self._now + n_samples
        if how is Reception.OWN:
            self._mask()
        elif how is Reception.HEARD:
            self._follow()
        return self._events_after(events) + (self._end() if how is Reception.OVER else [])

    def adopt(self, other: Self) -> None:
        """As `Stage.adopt`."""
        self._searcher = other._searcher

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """As `Stage.prepare`."""
        self._searcher.prepare(go_on)

    def _with_level(self, found: Recognised) -> Recognised:
        """A sentence of the second pass, with its signal-to-noise ratio."""
        return replace(found, snr_db=self.first_pass.front_end.snr_db(found.start_sample, found.end_sample))

    @abstractmethod
    def _events_after(self, events: Sequence[Event]) -> list[Event]:
        """The events that follow from those of the stages before, and from finished second passes."""

    @abstractmethod
    def _follow(self) -> None:
        """Process the block that was heard from sample `_began` on."""

    @abstractmethod
    def _break_off(self, n_samples: int) -> None:
        """Start again: this number of samples was lost, from `_now` on."""

    @abstractmethod
    def _end(self) -> list[Event]:
        """The events for all that was held."""

    def _mask(self) -> None:
        """The robot itself speaks."""
