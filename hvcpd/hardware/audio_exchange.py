"""Two bounded queues of sound between the card's thread and the event loop, which stay aligned.

What is written after the block that began at microphone sample n is played a fixed time after it was recorded. So
sound that comes too late is left out, not played later, and the robot knows when it hears itself.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from hvcpd.ports import Samples

LEAD_BLOCKS = 2
"""Blocks of silence that are played before the first that is written: the robot may be this late without a gap. One is
the block that it is thinking about, one is for the delays of a busy processor."""


@dataclass(frozen=True)
class StreamCounters:
    """Samples lost since the stream was opened, and the number of blocks in which the card itself lost sound.

    `clock_dropped` and `clock_inserted` are silence left out or added because the loudspeaker's clock is slower or
    faster than the microphone's, or because the card lost sound. `card_lost` is how much the microphone's overflows
    took, by the computer's clock.
    """

    input_dropped: int = 0
    output_dropped: int = 0
    output_late: int = 0
    card_overflows: int = 0
    card_underflows: int = 0
    clock_dropped: int = 0
    clock_inserted: int = 0
    card_lost: int = 0


class SoundStream(Protocol):
    """Microphone and loudspeaker, as `AudioStream` has them; every method may raise DeviceError but `close`.

    Sound has the shape (n,), float32 at 16 kHz.

    Opened `afresh`, the cards are looked for anew: one may have gone, or come back under another number.
    """

    @property
    def latency_s(self) -> float: ...

    @property
    def counters(self) -> StreamCounters: ...

    async def open(self, afresh: bool = False) -> None: ...

    async def start(self) -> None: ...

    async def read(self) -> Samples: ...

    def write(self, samples: Samples) -> None: ...

    async def close(self) -> None: ...


class SampleQueue:
    """Sound that waits, no more than `capacity` samples of it; not locked."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._waiting: Samples = np.zeros(0, np.float32)

    def __len__(self) -> int:
        return self._waiting.size

    def put(self, block: Samples) -> int:
        """Append a block of shape (n,) and drop the oldest samples that do not fit; returns how many those are."""
        self._waiting = np.concatenate([self._waiting, block])
        excess = max(0, len(self) - self._capacity)
        self.take(excess)
        return excess

    def take(self, count: int) -> Samples:
        """Return the oldest `count` samples, shape (count,), float32, or all if there are fewer."""
        taken, self._waiting = self._waiting[:count], self._waiting[count:]
        return taken


class SoundExchange:
    """The card's thread calls `swap` and `count`, the event loop `take` and `write`; each for a moment only."""

    def __init__(self, block: int, queue: int) -> None:
        capacity = max((LEAD_BLOCKS + 2) * block, queue)
        self._block = block
        self._lock = threading.Lock()
        self._heard = SampleQueue(capacity)
        self._to_say = SampleQueue(capacity)
        self._to_say.put(np.zeros(LEAD_BLOCKS * block, np.float32))
        self._late = 0
        self.counters = StreamCounters()
        """The losses so far; the same object until more is lost, since it is read at every block."""

    def swap(self, heard: Samples) -> Samples:
        """The card has taken `heard`, shape (n,), and wants as much to play."""
        with self._lock:
            lost = self._heard.put(heard)
            self._add("input_dropped", lost)
            out = self._to_say.take(heard.size)
            missing = heard.size - out.size
            # Nothing will ever be written for samples that the robot cannot read.
            self._late = max(0, self._late + missing - lost)
            return np.concatenate([out, np.zeros(missing, np.float32)]) if missing else out

    def take(self) -> Samples:
        """Return the oldest block heard, shape (block,), float32, or less if there is less."""
        with self._lock:
            return self._heard.take(self._block)

    def write(self, samples: Samples) -> None:
        """Queue sound of shape (n,) for playing.

        What should have been played by now is left out and counted as late, what does not fit as dropped.
        """
        with self._lock:
            late = min(self._late, samples.size)
            self._late -= late
            self._add("output_late", late)
            self._add("output_dropped", self._to_say.put(np.asarray(samples[late:], np.float32)))

    def count(self, name: str, by: int) -> None:
        """Add to one of the counters."""
        with self._lock:
            self._add(name, by)

    def _add(self, name: str, by: int) -> None:
        if by:
            self.counters = replace(self.counters, **{name: getattr(self.counters, name) + by})
