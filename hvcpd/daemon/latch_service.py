"""The stop latch in a worker thread of its own, so that a stop waits for nothing else that is written."""

from __future__ import annotations

import asyncio
import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import structlog

from hvcpd.errors import StoreError
from hvcpd.memory.latch import Latched, Permit, StopLatch

RETRY_S = 1.0
"""Pause after a failure (sample clock): each try may wait 1 s for another process."""
LATCH_S = 5.0
"""Longest time that a client that sent "stop" waits until the stop is on the disk: half of the patience of
`hvcpctl`."""

_log = structlog.get_logger(__name__)


class LatchService:
    """Has the latch say whether the next start may go on by itself; what cannot be written is tried again."""

    def __init__(self, latch: StopLatch) -> None:
        self.file = latch
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="latch")
        self._began = asyncio.Event()
        self._latched: Latched | None = None
        self._is_stopped = False
        self._is_unsure = False
        self._flight: asyncio.Future[None] | None = None
        self._now = 0.0
        self._retry_s = -math.inf
        self.unkept: str | None = None
        """Why the next start will not be as it ought to: a stop that cannot be kept, or a resume."""
        self.broken: BaseException | None = None
        """Our own mistake."""

    def begin(self, latched: Latched, stopped: bool, unsure: bool) -> None:
        """The memory that the latch belongs to is open; it knows whether the robot is stopped."""
        self._latched = latched
        self._is_stopped |= stopped
        self._is_unsure = unsure
        self._began.set()
        self._write()

    def stop(self, stopped: bool) -> None:
        """Have it kept at once that the robot is stopped, or no longer."""
        self._is_stopped = stopped
        self._write()

    def doubt(self, unsure: bool) -> None:
        """Have it kept that not all that the robot knows could be written, or that all is now."""
        self._is_unsure = unsure
        self._write()

    def tick(self, now: float) -> None:
        """Try again what could not be written, if it is time; `now`: s of the sample clock."""
        self._now = now
        if self.unkept is not None and now >= self._retry_s:
            self._write()

    async def kept(self) -> str | None:
        """None once what the robot is, stopped or free, is on the disk; else why it is not."""
        try:
            async with asyncio.timeout(LATCH_S):
                await self._began.wait()
                await self.settled()
        except TimeoutError:
            return f"{self.file.path}: its disk does not answer"
        return self.unkept

    async def settled(self) -> None:
        """Wait until nothing is being written."""
        while self._flight is not None:
            await asyncio.wait([self._flight])
            await asyncio.sleep(0)

    async def close(self) -> None:
        """Let go of the file once all is written, and end the thread."""
        await self.settled()
        await asyncio.get_running_loop().run_in_executor(self._thread, self.file.close)
        self._thread.shutdown(wait=False)

    def _write(self) -> None:
        """Have the latch say what it should by now; the last one to ask has the last word."""
        if self._latched is None:
            return  # as soon as the memory is open
        permit = Permit.UNSURE if self._is_unsure else Permit.STOPPED if self._is_stopped else Permit.FREE
        wanted = replace(self._latched, permit=permit)
        self._flight = asyncio.get_running_loop().run_in_executor(self._thread, self.file.write, wanted)
        self._flight.add_done_callback(self._written)

    def _written(self, flight: asyncio.Future[None]) -> None:
        error = flight.exception()
        if flight is not self._flight:
            return
        self._flight = None
        if error is not None and not isinstance(error, StoreError):
            self.broken = error
        reason = str(error) if error is not None else None
        if reason is not None and reason != self.unkept:
            _log.error("stop not kept" if self._is_stopped else "latch not set", reason=reason)
        elif reason is None and self.unkept is not None:
            _log.info("stop saved" if self._is_stopped else "latch set again")
        self.unkept = reason
        if reason is not None:
            self._retry_s = self._now + RETRY_S
