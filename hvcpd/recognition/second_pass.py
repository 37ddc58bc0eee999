"""Second-pass recognition: a worker searches a segment of sound, at once or in a thread, and its result is reported
with a later block. Nothing here blocks.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Protocol, Self, TypeVar

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Ears, EarsAround, Event, Recognised

BEFORE_S, AFTER_S = 0.5, 0.4
"""Margins around the noticed speech, for its faint beginning and end; AFTER_S has been heard when the event is
reported."""
PAUSES_S = 0.2
"""Margin around the speech between two pauses of talk."""


@dataclass(frozen=True, eq=False)
class Segment:
    """Speech that was not understood, with the sound around it.

    `sound`, shape (n,), begins with `lead` samples from before the speech. `start` and `end` are where the speech was
    noticed and `origin` is where the sound begins, in samples since the ears were made. The robot's own speech is left
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
Found = TypeVar("Found")
JobIn = TypeVar("JobIn", contravariant=True)
FoundOut = TypeVar("FoundOut", covariant=True)


class SegmentListener(Protocol[JobIn, FoundOut]):
    """A listener that need not keep up with real time."""

    def search(self, job: JobIn, /) -> FoundOut:
        """Return the recognition result for a segment."""

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make the slow first-time preparations while `go_on` holds, in any thread."""


class Worker(Protocol[Job, Found]):
    """Processes segments of sound, one job after the other."""

    def submit(self, job: Job, listener: SegmentListener[Job, Found]) -> bool:
        """Submit a job; false if the queue is full."""

    def findings(self) -> Sequence[tuple[Job, Found]]:
        """The results since the last call."""


class AtOnce(Generic[Job, Found]):
    """A worker that finishes each job before `submit` returns: for recordings, and for simulated time."""

    def __init__(self) -> None:
        self._found: list[tuple[Job, Found]] = []

    def submit(self, job: Job, listener: SegmentListener[Job, Found]) -> bool:
        """As `Worker.submit`."""
        self._found.append((job, listener.search(job)))
        return True

    def findings(self) -> Sequence[tuple[Job, Found]]:
        """As `Worker.findings`."""
        found, self._found = self._found, []
        return found


class LaterEars(EarsAround, ABC, Generic[Job, Found]):
    """`Ears` around others that submit sound of the last seconds for a second pass."""

    def __init__(self, ears: Ears, listener: SegmentListener[Job, Found], worker: Worker[Job, Found]) -> None:
        super().__init__(ears)
        self._listener = listener
        self._worker = worker
        self._began = self._now = 0

    def flush(self) -> list[Event]:
        """As `Recogniser.flush`."""
        return self.take(self._ears.flush())

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """As `EarsAround.prepare`, and of the listener."""
        super().prepare(go_on)
        self._listener.prepare(go_on)

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        """As `Recogniser.push`; the result of a second pass comes with a later push."""
        events = self._ears.push(samples, masked)
        self._began, self._now = self._now, self._now + len(samples)
        if not masked:
            self._follow()
        else:
            self._mask()
        return self.take(events)

    def lost(self, n_samples: int) -> list[Event]:
        """As `Recogniser.lost`."""
        events = self._ears.lost(n_samples)
        self._break_off(n_samples)
        self._now += n_samples
        return self.take(events)

    def adopt(self, others: Self) -> None:
        """As `EarsAround.adopt`, and with their listener."""
        super().adopt(others)
        self._listener = others._listener

    def _with_level(self, found: Recognised) -> Recognised:
        """A sentence of the second pass, with its signal-to-noise ratio."""
        return replace(found, snr_db=self.first.snr_db(found.start_sample, found.end_sample))

    @abstractmethod
    def take(self, events: Sequence[Event]) -> list[Event]:
        """The results of the first ears' events, and of finished second passes."""

    @abstractmethod
    def _follow(self) -> None:
        """Process the block that was heard from sample `_began` on."""

    @abstractmethod
    def _break_off(self, n_samples: int) -> None:
        """Start again: this number of samples was lost, from `_now` on."""

    def _mask(self) -> None:
        """The robot itself speaks."""
