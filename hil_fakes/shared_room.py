"""One room for several daemons: each has a stream of its own, and time passes when all wait for their next block.

What carries the sound is a medium: simulated air, as fast as the processor can or in real time, or a real sound card
that all robots share.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from hil_fakes.body import Body
from hil_fakes.room import Air, Point, Room
from hvcpd.errors import HvcpdError
from hvcpd.hardware.audio_exchange import StreamCounters
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

BLOCK = 400
"""Samples, 25 ms."""


class Medium(Protocol):
    """Carries sound from all loudspeakers to all microphones. Sound has the shape (n,), float32, at 16 kHz."""

    @property
    def latency_s(self) -> float:
        """From the end of a block that was heard until the sound played next is heard."""
        ...

    @property
    def counters(self) -> StreamCounters:
        """The sound that was lost."""
        ...

    async def open(self) -> None:
        """Begin; called once for each stream. Raises DeviceError."""
        ...

    async def exchange(self, played: Sequence[Samples], places: Sequence[Point]) -> list[Samples]:
        """Let a block pass: returns each microphone's next sound. Raises DeviceError."""
        ...


class SimulatedAir:
    """Air between robots; `pace(now_s)` waits until a block may pass, and by default does not."""

    latency_s = 0.0

    def __init__(self, room: Room, pace: Callable[[float], Awaitable[None]] | None = None) -> None:
        self.counters = StreamCounters()
        self._room = room
        self._pace = pace
        self._now_s = 0.0
        self.visitor = Voice()
        """1 m from every robot."""

    async def open(self) -> None:
        """Air is always there."""

    async def exchange(self, played: Sequence[Samples], places: Sequence[Point]) -> list[Samples]:
        """Let a block pass at once, or when its time has come."""
        heard = self._room.advance(played, places)[:-1]
        said = self.visitor.take(played) * np.float32(self._room.air.source_gain)
        self._now_s += len(heard[0]) / SAMPLE_RATE_HZ
        if self._pace is not None:
            await self._pace(self._now_s)
        return [(each + said).astype(np.float32) for each in heard]


PAUSE_S = 0.2
"""Quiet that a visitor waits for: within a sentence robots pause for less, between two of them for 0.3 s or more."""
OWN_PAUSE_S = 0.5
"""Quiet between two sentences of the visitor's: robots understood few of those that followed each other at once."""
PATIENCE_S = 6.0
"""A visitor interrupts after this time; a robot's longest sentence takes about 5 s."""


class Voice:
    """A visitor's sentences: each is said as a whole in the next pause of the robots, a call at once."""

    def __init__(self) -> None:
        self._waiting: deque[Samples] = deque()
        self._begun = False
        self._quiet = self._waited = 0  # samples
        self._said = 0

    def say(self, sound: Samples, at_once: bool = False) -> Callable[[], bool]:
        """Say it after the sentences that wait; or `at_once`, over the robots' voices, in place of all that she was
        saying or was to say. Shape (n,), float32. Returns what tells whether it is over."""
        if at_once:
            if self._begun:
                sound = np.concatenate((np.zeros(round(PAUSE_S * SAMPLE_RATE_HZ), np.float32), sound))
            self._said += len(self._waiting)
            self._waiting.clear()
            self._begun = True
        self._waiting.append(sound)
        last = len(self._waiting) + self._said
        return lambda: self._said >= last

    def take(self, played: Sequence[Samples]) -> Samples:
        """The next block, as long as those that the robots play; silence while there is nothing to say, or no pause."""
        n = len(played[0])
        taken = np.zeros(n, np.float32)
        self._quiet = 0 if any(np.any(each) for each in played) else self._quiet + n
        if not self._waiting:
            return taken
        self._waited += n
        if self._begun or self._quiet >= PAUSE_S * SAMPLE_RATE_HZ or self._waited >= PATIENCE_S * SAMPLE_RATE_HZ:
            self._begun = True
            sound = self._waiting[0]
            taken[: len(sound)] = sound[:n]
            self._waiting[0] = sound[n:]
            if len(sound) <= n:
                self._waiting.popleft()
                self._said += 1
                self._begun, self._waited = False, 0
                self._quiet = round((PAUSE_S - OWN_PAUSE_S) * SAMPLE_RATE_HZ)
        return taken


async def _at_once() -> None:
    return


@dataclass
class VirtualStream:
    """One robot's microphone and loudspeaker in a shared room; its `read` lets time pass once everybody waits."""

    room: SharedRoom
    settled: Callable[[], Awaitable[None]] = _at_once
    playing: Samples = field(default_factory=lambda: np.zeros(BLOCK, np.float32))
    played: list[Samples] | None = None
    log: list[str] = field(default_factory=list)
    on_open_afresh: Callable[[], None] = lambda: None

    @property
    def latency_s(self) -> float:
        return self.room.medium.latency_s

    @property
    def counters(self) -> StreamCounters:
        return self.room.medium.counters

    async def open(self, afresh: bool = False) -> None:
        self.log.append("open afresh" if afresh else "open")
        if afresh:
            self.on_open_afresh()
        await self.room.medium.open()
        self.room.join(self)

    async def start(self) -> None:
        self.log.append("start")

    async def read(self) -> Samples:
        await self.settled()
        return await self.room.heard_by(self)

    def write(self, samples: Samples) -> None:
        self.playing = samples
        if self.played is not None:
            self.played.append(samples)

    async def close(self) -> None:
        self.log.append("close")
        await self.room.leave(self)


class SharedRoom:
    """Sound between some robots and the floor under them. Time passes when all of them wait for their next block.

    `watch` is called with the time after each block; every microphone then raises its exception, if it raises one.
    """

    def __init__(
        self, bodies: list[Body], watch: Callable[[float], None] = lambda _: None, medium: Medium | None = None
    ) -> None:
        self.bodies = bodies
        self.medium = medium or SimulatedAir(Room(len(bodies), Air(), 0))
        self.streams = [VirtualStream(self) for _ in bodies]
        self.present = set(range(len(bodies)))
        self.now_s = 0.0
        self._watch = watch
        self._waiting: dict[int, asyncio.Future[Samples]] = {}

    def join(self, stream: VirtualStream) -> None:
        """Time passes no more without this one."""
        self.present.add(self._ear(stream))

    async def heard_by(self, stream: VirtualStream) -> Samples:
        """The stream's next block, once all who are present wait for theirs."""
        ear = self._ear(stream)
        turn: asyncio.Future[Samples] = asyncio.get_running_loop().create_future()
        self._waiting[ear] = turn
        await self._pass()
        return await turn

    async def leave(self, stream: VirtualStream) -> None:
        """Go on without this one."""
        ear = self._ear(stream)
        self.present.discard(ear)
        self._waiting.pop(ear, None)
        stream.playing = np.zeros_like(stream.playing)
        await self._pass()

    def _ear(self, stream: VirtualStream) -> int:
        return next(k for k, each in enumerate(self.streams) if each is stream)

    async def _pass(self) -> None:
        if not self._waiting or self.present - self._waiting.keys():
            return
        waiting, self._waiting = self._waiting, {}
        places = [(body.pose.x_m, body.pose.y_m) for body in self.bodies]
        try:
            heard = await self.medium.exchange(self._playing(), places)
            self._move(len(heard[0]) / SAMPLE_RATE_HZ)
        except (HvcpdError, ArithmeticError) as error:
            for turn in waiting.values():
                if not turn.done():
                    turn.set_exception(type(error)(str(error)))
            return
        for ear, turn in waiting.items():
            if not turn.done():
                turn.set_result(heard[ear])

    def _playing(self) -> list[Samples]:
        """The sound that each robot plays; a robot that has left plays silence of the same length."""
        n = max((len(self.streams[ear].playing) for ear in self.present), default=BLOCK)
        silence = np.zeros(n, np.float32)
        return [stream.playing if k in self.present else silence for k, stream in enumerate(self.streams)]

    def _move(self, dt_s: float) -> None:
        for body in self.bodies:
            body.advance(dt_s)
        self.now_s += dt_s
        self._watch(self.now_s)
