"""The robot's memory in one worker thread: a write to a memory card can take a tenth of a second."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import structlog

from hvcpd.daemon.outfit import Outfit
from hvcpd.errors import StoreError
from hvcpd.journal import Journal
from hvcpd.records import Record
from hvcpd.store import Store, TranscriptReader, TranscriptRow

MAX_WAITING = 1000
"""Records that may wait for the disk: more than a day's talk makes in ten minutes; beyond, new ones are not kept."""

Remembered = dict[int, tuple[str, str | None]]

_log = structlog.get_logger(__name__)


class JournalService:
    """Writes records in order. A failing disk costs memory, not the mission: it is told once and counted."""

    def __init__(self, outfit: Outfit) -> None:
        self._outfit = outfit
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="memory")
        self._stores: list[Store] = []
        self._journal: Journal | None = None
        self._flights: set[asyncio.Future[None]] = set()
        self._waiting = 0
        self._failing = False
        self._broken: BaseException | None = None
        self.stopped = False
        """Whether the robot was stopped when it was switched off; known once the memory is open."""
        self.names: tuple[str, ...] = ()
        """The robots that were heard before, who was heard last at the end; known once the memory is open."""
        self.counters: dict[str, int] = {}
        """Of seals and codes; known once the memory is open."""
        self.lost = 0
        """Records that were not kept."""

    async def open(self) -> Remembered:
        """Open the memory; what it knows of the tasks. Raises StoreError."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, self._open)

    def write(self, records: Sequence[Record], now: float) -> None:
        """Have the records of one step kept."""
        if self._broken is not None:
            raise self._broken
        if not records:
            return
        if self._waiting + len(records) > MAX_WAITING:
            self._lose(len(records), "the disk is too slow")
            return
        self._waiting += len(records)
        flight = asyncio.get_running_loop().run_in_executor(self._thread, self._write, tuple(records), now)
        self._flights.add(flight)
        flight.add_done_callback(lambda done: self._landed(done, len(records)))

    async def transcript(self, after: int, since_wall_s: float, limit: int) -> tuple[TranscriptRow, ...]:
        """What was kept, as `TranscriptReader.rows` has it, after what waits to be written. Raises StoreError."""
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._thread, self._transcript, after, since_wall_s, limit)

    async def settled(self) -> None:
        """Wait until all is written."""
        while self._flights:
            await asyncio.wait(self._flights)
            await asyncio.sleep(0)

    async def close(self) -> None:
        """Write what waits, close the file, end the thread."""
        await self.settled()
        for store in self._stores:
            await asyncio.get_running_loop().run_in_executor(self._thread, store.close)
        self._thread.shutdown(wait=False)

    def _open(self) -> Remembered:
        outfit = self._outfit
        store = Store(outfit.settings.memory_path)  # SQLite wants one thread from the opening on
        self._stores.append(store)
        seals = Store(outfit.seals_path) if outfit.keys is not None else None
        self._stores += [seals] if seals is not None else []
        self._journal = Journal(store, outfit.tasks, outfit.settings.name, seals)
        self.counters = self._journal.counters
        self.stopped = self._journal.stopped
        self.names = self._journal.names
        return self._journal.remembered()

    def _transcript(self, after: int, since_wall_s: float, limit: int) -> tuple[TranscriptRow, ...]:
        with closing(TranscriptReader(self._outfit.settings.memory_path)) as reader:
            return reader.rows(after, since_wall_s, limit)

    def _write(self, records: Sequence[Record], now: float) -> None:
        if self._journal is None:
            raise RuntimeError("the memory is not open")
        self._journal.write(records, now)

    def _landed(self, flight: asyncio.Future[None], count: int) -> None:
        self._flights.discard(flight)
        self._waiting -= count
        error = flight.exception()
        if error is None:
            if self._failing:
                _log.info("memory works again", lost=self.lost)
            self._failing = False
        elif isinstance(error, StoreError):
            self._lose(count, str(error))
        else:
            self._broken = error  # our own mistake: raised at the next write

    def _lose(self, count: int, reason: str) -> None:
        self.lost += count
        if not self._failing:
            _log.error("memory failed", reason=reason)
        self._failing = True
