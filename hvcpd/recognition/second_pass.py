"""The stages around the first pass. Those of the second pass have a worker search a segment of sound, at once or in a
thread, and report its result with a later block. Nothing here blocks.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Protocol, Self, TypeVar

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Recognised
from hvcpd.recognition.template_recogniser import TemplateRecogniser


class SpeechRecogniser(Protocol):
    """A speech recogniser, as the robot uses it: the first pass, alone or with stages around it."""

    @property
    def first_pass(self) -> TemplateRecogniser:
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


BEFORE_S, AFTER_S = 0.5, 0.4
"""Margins around the noticed speech, for its faint beginning and end; AFTER_S has been heard when the event is
reported."""
PAUSES_S = 0.2
"""Margin around the speech between two pauses of talk."""


@dataclass(frozen=True, eq=False)
class Segment:
    """Speech that was not understood, with the sound around it.

    `sound`, shape (n,), begins with `lead` samples from before the speech. `start` and `end` are where the speech was
    noticed and `origin` is where the sound begins, in samples of the stream. The robot's own speech is left
    out of the sound. `within_talk`: somebody speaks before it and after it; a sentence that ends with it may also begin
    at one of the samples `later`.
    """

    sound: Samples
    lead: int
    start: int
    end: int
    origin: int
    within_talk: bool = False
    later: tuple[int, ...] = ()

    @property
    def speech(self) -> Samples:
        """The speech, with the sound around it."""
        end = self.lead + self.end - self.start + round((PAUSES_S if self.within_talk else AFTER_S) * SAMPLE_RATE_HZ)
        return self.sound[max(self.lead - self.before, 0) : end]

    @property
    def before(self) -> int:
        """Number of samples before the noticed speech: room for a faint beginning, or up to the talk's last pause."""
        return round((PAUSES_S if self.within_talk else BEFORE_S) * SAMPLE_RATE_HZ)

    @property
    def beginnings(self) -> list[Segment]:
        """This segment, and its shorter versions from each later beginning on."""
        return [self, *(replace(self, lead=self.lead + at - self.start, start=at, later=()) for at in self.later)]


Job = TypeVar("Job")
Result = TypeVar("Result")
JobIn = TypeVar("JobIn", contravariant=True)
ResultOut = TypeVar("ResultOut", covariant=True)


class SegmentSearcher(Protocol[JobIn, ResultOut]):
    """A recogniser of segments, which need not keep up with real time."""

    def search(self, job: JobIn, /) -> ResultOut:
        """Return the recognition result for a segment."""

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make the slow first-time preparations while `go_on` holds, in any thread."""


class Worker(Protocol[Job, Result]):
    """Processes segments of sound, one job after the other."""

    def submit(self, job: Job, searcher: SegmentSearcher[Job, Result]) -> bool:
        """Submit a job; false if the queue is full."""

    def results(self) -> Sequence[tuple[Job, Result]]:
        """The results since the last call."""


class SynchronousWorker(Generic[Job, Result]):
    """A worker that finishes each job before `submit` returns: for recordings, and for simulated time."""

    def __init__(self) -> None:
        self._found: list[tuple[Job, Result]] = []

    def submit(self, job: Job, searcher: SegmentSearcher[Job, Result]) -> bool:
        """As `Worker.submit`."""
        self._found.append((job, searcher.search(job)))
        return True

    def results(self) -> Sequence[tuple[Job, Result]]:
        """As `Worker.results`."""
        found, self._found = self._found, []
        return found


class SecondPassStage(RecogniserStage, ABC, Generic[Job, Result]):
    """A stage that submits segments of the last seconds to a second pass."""

    def __init__(
        self, recogniser: SpeechRecogniser, searcher: SegmentSearcher[Job, Result], worker: Worker[Job, Result]
    ) -> None:
        super().__init__(recogniser)
        self._searcher = searcher
        self._worker = worker
        self._began = self._now = 0

    def flush(self) -> list[Event]:
        """As `TemplateRecogniser.flush`."""
        return self.take(self._inner.flush())

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """As `RecogniserStage.prepare`, and of the second pass."""
        super().prepare(go_on)
        self._searcher.prepare(go_on)

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        """As `TemplateRecogniser.push`; the result of a second pass comes with a later push."""
        events = self._inner.push(samples, masked)
        self._began, self._now = self._now, self._now + len(samples)
        if not masked:
            self._follow()
        else:
            self._mask()
        return self.take(events)

    def lost(self, n_samples: int) -> list[Event]:
        """As `TemplateRecogniser.lost`."""
        events = self._inner.lost(n_samples)
        self._break_off(n_samples)
        self._now += n_samples
        return self.take(events)

    def adopt(self, others: Self) -> None:
        """As `RecogniserStage.adopt`, and with their second pass."""
        super().adopt(others)
        self._searcher = others._searcher

    def _with_level(self, found: Recognised) -> Recognised:
        """A sentence of the second pass, with its signal-to-noise ratio."""
        return replace(found, snr_db=self.first_pass.snr_db(found.start_sample, found.end_sample))

    @abstractmethod
    def take(self, events: Sequence[Event]) -> list[Event]:
        """The events that follow from those of the stage within, and from finished second passes."""

    @abstractmethod
    def _follow(self) -> None:
        """Process the block that was heard from sample `_began` on."""

    @abstractmethod
    def _break_off(self, n_samples: int) -> None:
        """Start again: this number of samples was lost, from `_now` on."""

    def _mask(self) -> None:
        """The robot itself speaks."""
