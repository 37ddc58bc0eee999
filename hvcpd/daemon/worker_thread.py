"""A thread for work that blocks, so that the event loop need not wait for it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar, TypeVarTuple

Result = TypeVar("Result")
Arguments = TypeVarTuple("Arguments")


class WorkerThread:
    """Runs one call after the other; begins with the first."""

    def __init__(self, name: str) -> None:
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix=name)
        self._under_way: set[asyncio.Future[Any]] = set()

    @property
    def n_under_way(self) -> int:
        """Number of calls that have not ended."""
        return len(self._under_way)

    def run(self, work: Callable[[*Arguments], Result], *arguments: *Arguments) -> asyncio.Future[Result]:
        """Have the thread call `work`, after all calls before; return its result to come."""
        call = asyncio.get_running_loop().run_in_executor(self._pool, work, *arguments)
        self._under_way.add(call)
        call.add_done_callback(self._under_way.discard)
        return call

    async def settled(self) -> None:
        """Wait until no call is under way."""
        while self._under_way:
            await asyncio.wait(self._under_way)
            await asyncio.sleep(0)  # what the end of a call calls back may begin another

    async def close(self) -> None:
        """End the thread once no call is under way."""
        await self.settled()
        self._pool.shutdown(wait=False)
