"""Runs second passes over segments of sound in one thread."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Generic

import structlog

from hvcpd.recognition.stages import Job, Result

MOST_WAITING = 2
"""Pieces that are looked at or wait for it: a third would be told too late."""

_log = structlog.get_logger(__name__)


def one_thread(name: str = "second-pass") -> Executor:
    """A thread with this name and the process's own priority.

    With a lower one it is kept from running by other programs while it holds Python's global lock, for which hearing
    then waits: at nice 10 beside a process at nice -10, with four busy programs on two processors, a block of 25 ms was
    answered 330 to 520 ms late one time in a hundred; at the same priority, 40 to 90 ms.
    """
    return ThreadPoolExecutor(1, name)


class SecondPass(Generic[Job, Result]):
    """A `recognition.stages.Worker` with a thread of its own."""

    def __init__(self, failed: Result, make_pool: Callable[[], Executor] = one_thread) -> None:
        """`failed` is the result of a pass that fails. `make_pool` makes what runs one call after the other; one that
        fails is replaced."""
        self._failed = failed
        self._make_pool = make_pool
        self._pool = make_pool()
        self._under_way: set[Future[Result]] = set()
        self._found: deque[tuple[Job, Result]] = deque()
        self._sentences: list[tuple[Job, Result]] = []

    def submit(self, job: Job, search: Callable[[Job], Result]) -> bool:
        """As `Worker.submit`."""
        if len(self._under_way) >= MOST_WAITING:
            return False
        try:
            future = self._pool.submit(search, job)
        except RuntimeError as error:  # no thread can be started: without a new pool this one would search for it later
            _log.warning("second pass restarted", reason=f"{type(error).__name__}: {error}")
            self._pool = self._make_pool()
            return False
        self._under_way.add(future)
        future.add_done_callback(lambda done: self._found.append((job, self._result(done))))
        return True

    def results(self) -> Sequence[tuple[Job, Result]]:
        """As `Worker.results`."""
        self._under_way = {future for future in self._under_way if not future.done()}
        found = [self._found.popleft() for _ in range(len(self._found))]
        self._sentences += [each for each in found if each[1] is not self._failed]
        del self._sentences[:-MOST_WAITING]
        return found

    def take_sentences(self) -> list[tuple[Job, Result]]:
        """The sentences among the findings, each once; only the newest ones if this was not called for long."""
        sentences, self._sentences = self._sentences, []
        return sentences

    async def settled(self) -> None:
        """Wait until no search is under way."""
        for future in tuple(self._under_way):
            await asyncio.wait([asyncio.wrap_future(future)])

    async def close(self) -> None:
        """Stop searching."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        await self.settled()

    def _result(self, future: Future[Result]) -> Result:
        if future.cancelled():
            return self._failed
        error = future.exception()
        if error is not None:
            _log.error("second pass failed", reason=f"{type(error).__name__}: {error}")
            return self._failed
        return future.result()
