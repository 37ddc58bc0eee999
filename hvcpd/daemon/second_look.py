"""Has pieces of sound looked at again in one thread, which gives way to everything else."""

from __future__ import annotations

import asyncio
import os
import threading
from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor

import structlog

from hvcpd.people.ears import Finding, LooksAgain, Piece
from hvcpd.recognition.events import Recognised

MOST_WAITING = 2
"""Pieces that are looked at or wait for it: a third would be told too late."""
NICENESS = 10
"""Of the thread: hearing and driving go first."""

_log = structlog.get_logger(__name__)


class SecondLook:
    """A `people.ears.Worker`."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "second-look", initializer=_give_way)
        self._under_way: set[Future[Recognised | None]] = set()
        self._found: deque[Finding] = deque()
        self._sentences: list[tuple[Piece, Recognised]] = []

    def submit(self, piece: Piece, listener: LooksAgain) -> bool:
        """As `Worker.submit`."""
        if len(self._under_way) >= MOST_WAITING:
            return False
        future = self._thread.submit(listener.look, piece)
        self._under_way.add(future)
        future.add_done_callback(lambda done: self._found.append((piece, _result(done))))
        return True

    def findings(self) -> Sequence[Finding]:
        """As `Worker.findings`."""
        self._under_way = {future for future in self._under_way if not future.done()}
        found = [self._found.popleft() for _ in range(len(self._found))]
        self._sentences += [(piece, sentence) for piece, sentence in found if sentence is not None]
        del self._sentences[:-MOST_WAITING]
        return found

    def take_sentences(self) -> list[tuple[Piece, Recognised]]:
        """The sentences among the findings, each told once; the newest if nobody asked for long."""
        sentences, self._sentences = self._sentences, []
        return sentences

    async def settled(self) -> None:
        """Wait until nothing is being looked at."""
        for future in tuple(self._under_way):
            await asyncio.wait([asyncio.wrap_future(future)])

    async def close(self) -> None:
        """Look no more."""
        self._thread.shutdown(wait=False, cancel_futures=True)
        await self.settled()


def _give_way() -> None:
    """On Linux a thread has a priority of its own (sched(7))."""
    os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)


def _result(future: Future[Recognised | None]) -> Recognised | None:
    if future.cancelled():
        return None
    error = future.exception()
    if error is not None:
        _log.error("second look failed", reason=f"{type(error).__name__}: {error}")
        return None
    return future.result()
