"""A robot's files, and its lives one after another."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from structlog.testing import capture_logs

from hvcpd.memory.latch import Latched, Permit, StopLatch
from hvcpd.memory.opening import Memory, MemoryFiles, open_memory
from hvcpd.memory.store import TaskRecord

TASK = TaskRecord(1, "water the green rose", "done", "Rob", 12.5)


class Robot:
    """A robot's files, with its lives one after another."""

    def __init__(self, folder: Path) -> None:
        self.files = MemoryFiles(folder / "rob.sqlite3", folder / "rob.seals.sqlite3", folder / "rob.latch")
        self.spares = (folder.with_name("run.stopped"), folder.with_name("tmp.stopped"))

    @contextmanager
    def life(self, has_key: bool = False, ends: bool = True) -> Iterator[tuple[Memory, StopLatch]]:
        """From a start to an orderly end, or to being killed; in the latter case its files are let go of later."""
        latch = StopLatch(self.files.latch, self.spares)
        with capture_logs():
            memory = open_memory(self.files, latch, has_key)
        try:
            yield memory, latch
        finally:
            if not ends:  # as kill -9 leaves them
                shutil.rmtree(self.files.tasks.parent.with_name("left"), ignore_errors=True)
                shutil.copytree(self.files.tasks.parent, self.files.tasks.parent.with_name("left"))
            memory.store.close()
            if memory.seals is not None:
                memory.seals.close()
            latch.close()
            if not ends:
                shutil.rmtree(self.files.tasks.parent)
                self.files.tasks.parent.with_name("left").rename(self.files.tasks.parent)

    def starts(self, has_key: bool = False) -> Memory:
        """What the next start finds."""
        with self.life(has_key) as (memory, _):
            return memory

    def lives(self, stops: bool = False, has_key: bool = False, ends: bool = False) -> None:
        """A life in which a task is done."""
        with self.life(has_key, ends) as (memory, latch):
            memory.store.save_task(TASK)
            if memory.seals is not None:
                memory.seals.raise_counter("k/bot", 7)
            if stops:
                stop(memory, latch)


def stop(memory: Memory, latch: StopLatch) -> None:
    latch.write(Latched(Permit.STOPPED, memory.latched.memory, memory.latched.seals))
