"""Bodies for whole daemons in virtual time: a shared room of air, and fake motors on a pty."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field

import numpy as np

from hil_fakes.body import Body
from hil_fakes.room import Air, Room
from hvcpd.config.settings import AudioSettings, Settings
from hvcpd.daemon.devices import Button, Devices
from hvcpd.errors import HvcpdError
from hvcpd.hardware.audio_exchange import StreamCounters
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, Wheels
from tests.daemon.two_cards import BLOCK, TwoCards


async def _at_once() -> None:
    return


@dataclass
class VirtualStream:
    """One robot's microphone and loudspeaker in a shared room; its `read` lets time pass once everybody waits."""

    room: SharedRoom
    settled: Callable[[], Awaitable[None]] = _at_once
    playing: Samples = field(default_factory=lambda: np.zeros(BLOCK, np.float32))
    played: list[Samples] = field(default_factory=list)
    counters: StreamCounters = field(default_factory=StreamCounters)
    latency_s: float = 0.0
    log: list[str] = field(default_factory=list)
    on_open_afresh: Callable[[], None] = lambda: None

    async def open(self, afresh: bool = False) -> None:
        self.log.append("open afresh" if afresh else "open")
        if afresh:
            self.on_open_afresh()

    async def start(self) -> None:
        self.log.append("start")

    async def read(self) -> Samples:
        await self.settled()
        return await self.room.heard_by(self)

    def write(self, samples: Samples) -> None:
        self.playing = samples
        self.played.append(samples)

    async def close(self) -> None:
        self.log.append("close")


class SharedRoom:
    """Air between some robots and the floor under them. Time passes when all of them wait for their next block.

    `watch` is called with the time after each block; what it raises is what every microphone then raises.
    """

    def __init__(self, bodies: list[Body], watch: Callable[[float], None], seed: int = 0) -> None:
        self.bodies = bodies
        self.streams = [VirtualStream(self) for _ in bodies]
        self.now_s = 0.0
        self._watch = watch
        self._room = Room(len(bodies), Air(), seed)
        self._waiting: dict[int, asyncio.Future[Samples]] = {}

    async def heard_by(self, stream: VirtualStream) -> Samples:
        ear = self.streams.index(stream)
        turn = self._waiting[ear] = asyncio.get_running_loop().create_future()
        if len(self._waiting) == len(self.streams):
            self._pass()
        return await turn

    def _pass(self) -> None:
        waiting, self._waiting = self._waiting, {}
        places = [(body.pose.x_m, body.pose.y_m) for body in self.bodies]
        taken = self._room.advance([stream.playing for stream in self.streams], places)
        for body in self.bodies:
            body.advance(BLOCK / SAMPLE_RATE_HZ)
        self.now_s += BLOCK / SAMPLE_RATE_HZ
        try:
            self._watch(self.now_s)
        except (HvcpdError, ArithmeticError) as error:
            for turn in waiting.values():
                turn.set_exception(type(error)(str(error)))
            return
        for ear, turn in waiting.items():
            turn.set_result(taken[ear])


@contextmanager
def shared_room(settings: list[Settings], watch: Callable[[float], None]) -> Iterator[SharedRoom]:
    """A room with a body for each of the settings; motors and ptys are gone at the end."""
    with ExitStack() as stack:
        bodies = [Body(each.start.pose, seed) for seed, each in enumerate(settings)]
        for body in bodies:
            stack.push(body)
        yield SharedRoom(bodies, watch)


def devices_of(room: SharedRoom, which: int = 0, button: Button | None = None) -> Devices:
    """That robot's devices in the room."""

    def make_stream(_: AudioSettings) -> VirtualStream:
        return room.streams[which]

    def make_wheels(_: object) -> Wheels:
        return room.bodies[which].wheels

    return Devices(TwoCards, make_stream, make_wheels, lambda _: button)
