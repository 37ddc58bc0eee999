"""A robot that lives in a thread of its own, with its control socket, for programs that ask it."""

from __future__ import annotations

import asyncio
import threading
from contextlib import suppress
from pathlib import Path

from hvcpd.coordination.states import State
from hvcpd.robot.sealing import Sealing
from tests.daemon.control_bench import ControlBench

TICK_S = 0.01
"""Real time between two looks: a tenth of a second of the robot's own time."""


class RunningRobot:
    """A robot that lives in a thread of its own, faster than in real time."""

    def __init__(self, directory: Path, sealing: Sealing | None = None) -> None:
        self.directory, self._sealing = directory, sealing
        self._ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._live()))

    def __enter__(self) -> RunningRobot:
        self._thread.start()
        assert self._ready.wait(30.0)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._ending.set)
        self._thread.join()

    async def _live(self) -> None:
        self._loop, self._ending = asyncio.get_running_loop(), asyncio.Event()
        self.bench = ControlBench(self.directory, sealing=self._sealing)
        await self.bench.open()
        await self.bench.live(blocks=12)  # until the meter has read its first level
        self._ready.set()
        while not self._ending.is_set():
            await self.bench.live(blocks=4)
            with suppress(TimeoutError):
                await asyncio.wait_for(self._ending.wait(), TICK_S)
        await self.bench.close()

    @property
    def state(self) -> State:
        return self.bench.bench.robot.coordination.state
