"""The robot's memory in one worker thread: a write to a memory card can take a tenth of a second."""

from __future__ import annotations

import asyncio
import math
import os
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from functools import partial

import structlog

from hvcpd.assembly.plan import MemoryPlan
from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import SaveChange, SaveDue, SavePeer, SaveStopped, SaveTask
from hvcpd.daemon.control_socket import locked, runtime_file
from hvcpd.daemon.latch_service import RETRY_S, LatchService, stop_latch
from hvcpd.daemon.wiring import Wiring
from hvcpd.daemon.worker_thread import WorkerThread
from hvcpd.errors import StoreError
from hvcpd.memory.journal import Journal
from hvcpd.memory.latch import Latched
from hvcpd.memory.opening import Memory, MemoryFiles, open_memory
from hvcpd.memory.recent import OfTask, Recent
from hvcpd.memory.store import TranscriptReader, TranscriptRow
from hvcpd.memory.store_file import make_directory, set_aside
from hvcpd.robot.records import Record, SaveCounter
from hvcpd.security.codes import LOST

MAX_WAITING = 1000
"""Records that may wait for the disk: more than a day's talk makes in ten minutes; further ones are dropped."""
LATER_S = 300.0
"""Interval (sample clock) at which records that may be lost with the process are written, mainly the transcript. A card
writes whole pages of 4 KB, and the file system its own besides: with every change of a task
written at once, a busy hour was 3.0 MB, and 1.4 with this (`python -m benchmarks.daemon.writes`)."""
MAX_LATER = 200
"""Maximum number of records that wait for LATER_S; robots that talk without a pause make 150."""
CHECK_S = 5.0
"""Interval (sample clock) at which the file is checked, so that a truncated or deleted file is noticed before the next
write: one stat() of it, in the memory's thread."""

TimedRecord = tuple[Record, float]
"""A record, and when it was passed to the service, s of the sample clock."""

_log = structlog.get_logger(__name__)


class JournalService:
    """Writes records in order. If the disk fails, records are lost and counted, and the mission goes on.

    Records that the robot needs after a restart are written at once, and tried again until the disk works. Until then
    the latch has the next start begin stopped. All others are written every LATER_S.
    """

    def __init__(self, wiring: Wiring) -> None:
        self._wiring = wiring
        self._thread = WorkerThread("memory")
        self.latch = LatchService(stop_latch(wiring))
        """Says whether the next start begins stopped."""
        self._lock: int | None = None
        """Lock on the memory, whatever the socket: another daemon's latch must not release a stopped robot."""
        self._memory: Memory | None = None
        self._journal: Journal
        """Known once the memory is open."""
        self._unwritten: dict[tuple[object, ...], Record] = {}
        self._later: list[TimedRecord] = []
        """Records that wait for LATER_S."""
        self._peers: set[str] = set()
        """Names in the memory: a new name is written at once."""
        self._waiting = 0
        self._retry_s = -math.inf
        self._checked_s = 0.0
        self._now = 0.0
        self._broken: BaseException | None = None
        self.stopped = False
        """Whether the robot begins stopped: it was stopped when it was switched off, or has lost its memory, which is
        known once it is open, or it was told so while it starts."""
        self.loss: str | None = None
        """Why the knowledge from before this start is lost; known once the memory is open."""
        self.fault: str | None = None
        """Why nothing can be saved at present."""
        self.names: tuple[str, ...] = ()
        """The robots that were heard before, the latest last; known once the memory is open."""
        self.robots: tuple[str, ...] = ()
        """Those of them that have named a team."""
        self.lost = 0
        """Number of records that were not saved."""

    def use_tasks(self, tasks: TaskRepository) -> None:
        """Use these tasks from now on."""
        self._journal.use_tasks(tasks)

    async def open(self) -> MemoryPlan:
        """Open the memory and return its content. Raises NewerStoreError, or RunningError if another daemon has it."""
        latched, memory = await self._thread.run(self._open)
        if self.loss is not None:
            remedy = 'look at the files named, then say "resume", or: hvcpctl resume'
            _log.error("memory lost", reason=self.loss, starts="stopped", remedy=remedy)
        elif self.fault is not None:
            _log.error("memory failed", reason=self.fault, starts="stopped" if self.stopped else "free")
        elif self.stopped:
            _log.warning("starts stopped", reason="it was stopped", remedy='say "resume", or: hvcpctl resume')
        ring = self._wiring.ring()
        if ring is not None and f"{LOST}{ring.spoken.fingerprint}" in memory.counters:
            _log.error(
                "counters of seals lost",
                reason="an old recording could pass as new: the robot believes nobody without a challenge, takes no "
                "code of the sheet, and nobody believes it",
                remedy="hvcpctl key rotate --after 0 --keep 0, and hand the new key to all robots",
            )
        self.latch.begin(latched, self.stopped, self.fault is not None)
        return memory

    def write(self, records: Sequence[Record], now: float) -> None:
        """Save the records of one step."""
        self._now = now
        if (broken := self._broken or self.latch.broken) is not None:
            raise broken
        stops = [record.stopped for record in records if isinstance(record, SaveStopped)]
        if stops:
            self.latch.stop(stops[-1])  # the last alone: "resume, stop" must not be "free" for a moment
        records = [record for record in records if not isinstance(record, SaveStopped)]
        for record in records:
            key = _key(record)
            if key is not None:
                self._unwritten.pop(key, None)
                self._unwritten[key] = record
        news = tuple(record for record in records if isinstance(record, OfTask))
        if news:
            self._have_done(partial(self._journal.hold, news, now))
        at_once = False
        if self.fault is not None and not self._is_only_in_memory:
            self._send([(record, now) for record in self._again(records)])
        else:
            self._send([(record, now) for record in records if isinstance(record, SaveCounter)])  # a file of their own
            records = [record for record in records if not isinstance(record, SaveCounter)]
            at_once = any(map(self._must_not_wait, records))
            self._later += [(record, now) for record in records]
            self._peers.update(record.name.casefold() for record in records if isinstance(record, SavePeer))
        self.latch.tick(now)
        if at_once or (self._later and (now - self._later[0][1] >= LATER_S or len(self._later) >= MAX_LATER)):
            self._send_later()
        elif self.fault is None and now - self._checked_s >= CHECK_S:
            self._checked_s = now
            self._have_done(self._journal.check)

    def _must_not_wait(self, record: Record) -> bool:
        """What nobody else could tell the robot after a loss of power: a new name, a person's change of a task, and its
        own tasks, but not other robots', which those know."""
        match record:
            case SavePeer(name):
                return name.casefold() not in self._peers
            case SaveTask(owner=owner):
                return owner is None or owner.casefold() == self._wiring.settings.name.casefold()
            case SaveChange():
                return True
            case _:
                return False

    def _send_later(self) -> None:
        """Have all that waits written. What must not wait takes the rest along: the file system's own pages, most of
        what reaches a card, are written once for all."""
        newest = [(record, at_s) for record, at_s in self._later if self._is_newest(record)]
        self._later = []
        self._send(newest)

    def _is_newest(self, record: Record) -> bool:
        """What it says was not replaced by a later record."""
        key = _key(record)
        return key is None or self._unwritten.get(key) is record

    def _send(self, timed: Sequence[TimedRecord]) -> None:
        """Have the thread write the records, if there are any."""
        records = tuple(record for record, _ in timed)
        if self._waiting + len(records) > MAX_WAITING:
            self._lose(records, "the disk is too slow")
        elif records:
            self._have_done(partial(self._journal.write_together, tuple(timed), self._now), records)

    def _have_done(self, work: Callable[[], None], records: Sequence[Record] = ()) -> None:
        """Run `work`, which writes these records, in the thread."""
        self._waiting += len(records)
        self._thread.run(work).add_done_callback(lambda done: self._landed(done, records))

    async def transcript(self, after: int, since_wall_s: float, limit: int) -> tuple[TranscriptRow, ...]:
        """The transcript, as by `TranscriptReader.rows`, after all pending writes. Raises StoreError."""
        self._send_later()
        return await self._thread.run(self._transcript, after, since_wall_s, limit)

    async def settled(self) -> None:
        """Wait until all is written."""
        self._send_later()
        await self._thread.settled()
        await self.latch.settled()

    async def close(self) -> None:
        """Write all waiting records, close the file, end the thread."""
        await self.settled()
        if self._memory is not None:
            for store in (self._memory.store, self._memory.seals):
                if store is not None:
                    await self._thread.run(store.close)
        await self.latch.close()
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None
        await self._thread.close()

    @property
    def _is_only_in_memory(self) -> bool:
        """A file could not be used at all: only a restart helps."""
        return self._memory is not None and self._memory.fault is not None

    def _open(self) -> tuple[Latched, MemoryPlan]:
        wiring = self._wiring
        files = MemoryFiles(wiring.settings.memory_path, wiring.seals_path, wiring.latch_path)
        make_directory(files.tasks.parent)
        with suppress(OSError):  # a disk that takes no lock takes no latch either, and the robot starts stopped
            self._lock = locked(files.latch.with_name(f"{files.latch.name}.lock"), files.tasks)
        lost = self._set_changes_aside()
        memory = self._memory = open_memory(files, self.latch.file, wiring.keys is not None, lost)
        recent = Recent(runtime_file(wiring.settings, ".recent"), memory.latched.memory)
        journal = self._journal = Journal(memory.store, wiring.tasks, wiring.settings.name, memory.seals, recent)
        self.fault = memory.fault or memory.failing
        try:
            journal.recall()
        except StoreError as error:
            self.fault = self.fault or str(error)
        ring = wiring.ring()
        if ring is not None and (memory.seals_lost or memory.seals_stale):
            try:
                journal.doubt_counters([key.fingerprint for key in ring.accepted], memory.seals_lost)
            except StoreError as error:
                self.fault = self.fault or str(error)
        self.stopped |= memory.stopped
        self.loss = memory.loss
        self.names, self.robots = journal.names, journal.robots
        self._peers = {name.casefold() for name in self.names}
        return memory.latched, MemoryPlan(
            journal.remembered(), self.stopped, journal.counters, journal.dues, journal.changes
        )

    def _set_changes_aside(self) -> tuple[str, ...]:
        """Why it is not known which tasks were added or removed by commands; nothing if it is."""
        damage, path = self._wiring.damage, self._wiring.settings.task_changes_path
        if damage is None:
            return ()
        try:
            set_aside(path, damage)
        except StoreError as error:
            return damage, str(error)
        return (f"{path} cannot be read, and is set aside",)

    def _transcript(self, after: int, since_wall_s: float, limit: int) -> tuple[TranscriptRow, ...]:
        with closing(TranscriptReader(self._wiring.settings.memory_path)) as reader:
            return reader.rows(after, since_wall_s, limit)

    def _again(self, records: Sequence[Record]) -> Sequence[Record]:
        """The records to try to write while the disk fails: none yet, or all that are due. Without any, the memory's
        number is written again, which shows whether the disk works: the robot may have nothing to say for long."""
        others = [record for record in records if _key(record) is None]
        if self._thread.n_under_way or self._now < self._retry_s:
            self.lost += len(others)
            return ()
        self._retry_s = self._now + RETRY_S
        found = (*self._unwritten.values(), *others)
        memory = self._memory
        if not found and memory is not None and memory.latched.memory is not None:
            self._have_done(partial(memory.store.mark, memory.latched.memory))
        return found

    def _landed(self, flight: asyncio.Future[None], records: Sequence[Record]) -> None:
        self._waiting -= len(records)
        error = flight.exception()
        if error is None and self._is_only_in_memory:
            self.lost += sum(_key(record) is None for record in records)
        elif error is None:
            for record in records:
                key = _key(record)
                if key is not None and self._unwritten.get(key) is record:
                    del self._unwritten[key]
            if self.fault is not None and not self._unwritten:
                self.fault = None
                _log.info("memory works again", lost=self.lost)
                self.latch.doubt(False)
        elif isinstance(error, StoreError):
            self._lose(records, str(error))
        else:
            self._broken = error  # our own mistake: raised at the next write

    def _lose(self, records: Sequence[Record], reason: str) -> None:
        self.lost += sum(_key(record) is None for record in records)
        self._retry_s = self._now + RETRY_S
        if self.fault is None:
            _log.error("memory failed", reason=reason)
            self.fault = reason
            self.latch.doubt(True)


def _key(record: Record) -> tuple[object, ...] | None:
    """The subject of a record that must not be lost and of which only the newest matters."""
    match record:
        case SaveTask() | SaveDue() | SaveChange():
            return type(record), record.number
        case SavePeer():
            return "peer", record.name.casefold()
        case SaveCounter():
            return "counter", record.name
        case _:
            return None
