"""The stop latch in a worker thread of its own, so that a stop waits for nothing else that is written."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace

import structlog

from hvcpd.daemon.control_socket import runtime_file
from hvcpd.daemon.wiring import Wiring
from hvcpd.daemon.worker_thread import WorkerThread
from hvcpd.errors import StoreError
from hvcpd.memory.latch import Latched, Permit, StopLatch, spare_places

RETRY_S = 1.0
"""Pause after a failure (sample clock): each try may wait 1 s for another process."""
LATCH_S = 5.0
"""Longest time that a client that sent "stop" waits until the stop is on the disk: half of the patience of
`hvcpctl`."""

_log = structlog.get_logger(__name__)


def stop_latch(wiring: Wiring) -> StopLatch:
    """The latch of this robot, with its spare places."""
    return StopLatch(wiring.latch_path, spare_places(wiring.latch_path, runtime_file(wiring.settings, ".stopped")))


class LatchService:
    """Writes the latch, which says whether the next start begins stopped, and tries again if that fails."""

    def __init__(self, latch: StopLatch) -> None:
        self.file = latch
        self._thread = WorkerThread("latch")
        self._began = asyncio.Event()
        self._latched: Latched | None = None
        self._is_stopped = False
        self._is_unsure = False
        self._flight: asyncio.Future[None] | None = None
        self._now = 0.0
        self._retry_s = -math.inf
        self.unkept: str | None = None
        """Why a stop or resume would not survive a restart; None if it would."""
        self.broken: BaseException | None = None
        """An unexpected exception of the thread: a bug."""

    def begin(self, latched: Latched, stopped: bool, unsure: bool) -> None:
        """Begin to write: the memory that the latch belongs to is open, and says whether the robot is stopped."""
        self._latched = latched
        self._is_stopped |= stopped
        self._is_unsure = unsure
        self._began.set()
        self._write()

    def stop(self, stopped: bool = True) -> None:
        """Save at once whether the robot is stopped."""
        self._is_stopped = stopped
        self._write()

    def doubt(self, unsure: bool) -> None:
        """Save whether some of the robot's knowledge could not be written (`unsure`)."""
        self._is_unsure = unsure
        self._write()

    def tick(self, now: float) -> None:
        """Try a failed write again, if it is time; `now`: s of the sample clock."""
        self._now = now
        if self.unkept is not None and now >= self._retry_s:
            self._write()

    async def kept(self) -> str | None:
        """Wait until the robot's state, stopped or free, is on the disk; return None, or what a restart may do instead,
        and why."""
        try:
            async with asyncio.timeout(LATCH_S):
                await self._began.wait()
                await self.settled()
        except TimeoutError:
            return f"a restart may undo that: {self.file.path}: its disk does not answer"
        if self._is_unsure and not self._is_stopped:
            return self.unkept or "the next start will be stopped: the memory cannot be written; see hvcpctl status"
        return self.unkept

    async def settled(self) -> None:
        """Wait until nothing is being written."""
        await self._thread.settled()

    async def close(self) -> None:
        """Close the file once all is written, and end the thread."""
        await self.settled()
        await self._thread.run(self.file.close)
        await self._thread.close()

    def _write(self) -> None:
        """Write the present state to the latch; the latest write wins."""
        if self._latched is None:
            return  # as soon as the memory is open
        permit = Permit.UNSURE if self._is_unsure else Permit.STOPPED if self._is_stopped else Permit.FREE
        wanted = replace(self._latched, permit=permit)
        self._flight = self._thread.run(self.file.write, wanted)
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
