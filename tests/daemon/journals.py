"""A robot's memory, from a start of the robot to its end."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager

from hvcpd.assembly.plan import MemoryPlan
from hvcpd.daemon.journal_service import JournalService
from hvcpd.daemon.wiring import Wiring


@asynccontextmanager
async def opened(wiring: Wiring) -> AsyncIterator[tuple[JournalService, MemoryPlan]]:
    """The memory, and what was in it at the start."""
    journal = JournalService(wiring)
    plan = await journal.open()
    yield journal, plan
    await journal.close()


async def kill(journal: JournalService) -> None:
    """Let go of its files as the kernel would; what is under way is written."""
    await journal._thread.settled()
    lock, journal._lock = journal._lock, None
    assert lock is not None
    os.close(lock)


@contextmanager
def taken(wiring: Wiring) -> Iterator[None]:
    """Another process has the file, so that nothing can be written."""
    other = sqlite3.connect(wiring.settings.memory_path, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    yield
    other.execute("ROLLBACK")
    other.close()
