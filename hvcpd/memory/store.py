"""A robot's memory: its view of the tasks, the transcript, its peers and its counters, in one SQLite file.

One robot, one file, one writer; nothing is shared. All times are seconds of the robot's sample clock.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any, Literal

from hvcpd.errors import StoreError
from hvcpd.memory.store_file import IN_MEMORY, Connect, connect, failures, open_store

TaskState = Literal["open", "claimed", "done"]
TranscriptKind = Literal["said", "heard", "garbled"]

MAX_TRANSCRIPT = 100_000
"""Maximum number of utterances that are kept, about 15 MB: those of a class of six robots in a month or two; the check
of the file at each start stays quick."""
FORGET_EVERY = 1000
"""Number of utterances beyond the limit that may be kept until the oldest are deleted at once."""

IDENTITY = "identity"
"""Not a counter: the number of this memory."""

_WALL_CLOCK_S = "(julianday('now') - 2440587.5) * 86400.0"
"""SQLite's clock in seconds since 1970: for people who ask about this morning's talk; the robot itself never does."""

YEAR_9999_S = 253_000_000_000
"""No Python has a date after it; such a time in a file is as good as none."""


@dataclass(frozen=True)
class TaskRecord:
    """A robot's knowledge of a task; `owner` is the name of the robot that claimed or did it."""

    number: int
    name: str
    state: TaskState
    owner: str | None
    changed_at_s: float


@dataclass(frozen=True)
class TranscriptRecord:
    """One utterance said or heard; of a garbled one `text` is the best guess and `speaker` may be unknown."""

    at_s: float
    kind: TranscriptKind
    speaker: str | None
    text: str
    confidence: float | None = None
    seal: str | None = None
    """How it was said or heard where there is a key: "sealed", "encrypted", "code", "not trusted"."""


@dataclass(frozen=True)
class PeerRecord:
    """Another robot that was heard, and when it was last heard."""

    name: str
    team: str | None
    last_heard_s: float


class Store:
    """The memory in the file `path`, opened or made new.

    A file that is damaged is set aside as NAME.corrupt-N with a warning in the log, and a new one is begun; one of a
    newer version raises NewerStoreError. Every method raises StoreError when the disk is full, read-only or failing,
    and those that write also when the file was replaced, cut short or deleted meanwhile. A `durable` write is on the
    disk as soon as it is made; a loss of power may undo other writes.
    """

    def __init__(
        self,
        path: Path = IN_MEMORY,
        connect: Connect = connect,
        utterances: int = MAX_TRANSCRIPT,
        durable: bool = False,
    ) -> None:
        self._path = path
        self._utterances = utterances
        opened = open_store(path, connect)
        self._db = opened.db
        self.is_new = opened.is_new
        """Whether there was nothing in the file."""
        self.damage = opened.damage
        """Why the file that was there was set aside, if it was."""
        self._durable = durable
        if durable:
            self._db.execute("PRAGMA synchronous = FULL")
        self._file = _FileWatch(path)

    @property
    def identity(self) -> int | None:
        """The unique number of this memory; None before `mark`."""
        rows = self._read("SELECT value FROM counters WHERE name = ?", (IDENTITY,))
        return int(rows[0][0]) if rows else None

    def mark(self, identity: int) -> None:
        """Give the memory its number, or the same once more; it is on the disk when this returns."""
        with failures(self._path):
            self._db.execute("PRAGMA synchronous = FULL")
        try:
            self.set_counter(IDENTITY, identity)
            with failures(self._path):  # into the file itself: what follows in the journal may be lost without it
                self._db.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()
        finally:
            if not self._durable:
                self._db.execute("PRAGMA synchronous = NORMAL")

    def save_task(self, task: TaskRecord) -> None:
        """Keep a task's state, in place of the earlier one under that number."""
        self._write("INSERT OR REPLACE INTO tasks VALUES (?, ?, ?, ?, ?)", astuple(task))

    def tasks(self) -> tuple[TaskRecord, ...]:
        """All tasks by number."""
        return tuple(TaskRecord(*row) for row in self._read("SELECT * FROM tasks ORDER BY number"))

    def forget_task(self, number: int, counters: Iterable[str]) -> None:
        """Delete what is known of the task under that number, and these counters."""
        self._write("DELETE FROM tasks WHERE number = ?", (number,))
        for name in counters:
            self._write("DELETE FROM counters WHERE name = ?", (name,))

    @contextmanager
    def together(self) -> Iterator[None]:
        """Commit the writes in here at once, each page of the file once; none of them if any fails."""
        with failures(self._path):
            self._db.execute("BEGIN IMMEDIATE")
        with ExitStack() as undo:
            undo.callback(self._roll_back)
            yield
            with failures(self._path):
                self._db.execute("COMMIT")
            undo.pop_all()

    def _roll_back(self) -> None:
        with suppress(sqlite3.Error):  # SQLite itself has rolled back after some failures
            self._db.execute("ROLLBACK")

    def append_transcript(self, record: TranscriptRecord, ago_s: float = 0.0) -> None:
        """Add an utterance, of `ago_s` seconds ago by the wall clock, to the transcript; the oldest beyond `utterances`
        are forgotten now and then."""
        number = self._write(
            "INSERT INTO transcript (at_s, kind, speaker, text, confidence, seal, wall_s) "
            f"VALUES (?, ?, ?, ?, ?, ?, {_WALL_CLOCK_S} - ?)",
            (*astuple(record), ago_s),
        )
        if number % FORGET_EVERY == 0:
            self._write("DELETE FROM transcript WHERE id <= ?", (number - self._utterances,))

    def transcript(self, since_s: float = float("-inf")) -> tuple[TranscriptRecord, ...]:
        """The utterances from `since_s` on, in the order of their times."""
        query = "SELECT at_s, kind, speaker, text, confidence, seal FROM transcript WHERE at_s >= ? ORDER BY at_s, id"
        return tuple(TranscriptRecord(*row) for row in self._read(query, (since_s,)))

    def save_peer(self, peer: PeerRecord) -> None:
        """Keep the record of a robot, in place of the earlier one, but the team that it has once named; names are the
        same in any case."""
        team = "coalesce(?2, (SELECT team FROM peers WHERE name = ?1))"
        self._write(f"INSERT OR REPLACE INTO peers VALUES (?1, {team}, ?3)", astuple(peer))

    def peers(self) -> tuple[PeerRecord, ...]:
        """All robots that were ever heard, the last heard at the end."""
        return tuple(PeerRecord(*row) for row in self._read("SELECT * FROM peers ORDER BY rowid"))

    def raise_counter(self, name: str, value: int) -> None:
        """Remember a counter's value, unless a higher one is remembered."""
        query = "INSERT INTO counters VALUES (?, ?) ON CONFLICT (name) DO UPDATE SET value = max(value, excluded.value)"
        self._write(query, (name, value))

    def set_counter(self, name: str, value: int) -> None:
        """Remember a counter's value, whichever is remembered."""
        self._write("INSERT OR REPLACE INTO counters VALUES (?, ?)", (name, value))

    def flags(self) -> frozenset[str]:
        """All flags that an earlier version has set."""
        return frozenset(name for (name,) in self._read("SELECT name FROM flags"))

    def counters(self) -> dict[str, int]:
        """All counters by name."""
        return dict(self._read("SELECT name, value FROM counters WHERE name != ? ORDER BY name", (IDENTITY,)))

    def check(self) -> None:
        """Raises StoreError if the file was replaced, cut short or deleted since it was opened."""
        self._file.check()

    def close(self) -> None:
        """Close the file; may be called twice."""
        self._db.close()

    def _write(self, query: str, values: Sequence[Any]) -> int:
        """The number of the row that was inserted, if one was."""
        self._file.check()
        with failures(self._path):
            return self._db.execute(query, values).lastrowid or 0

    def _read(self, query: str, values: Sequence[Any] = ()) -> list[Any]:
        with failures(self._path):
            return self._db.execute(query, values).fetchall()


class _FileWatch:
    """Detects that the file under an open database is no longer the one that was opened: SQLite itself goes on."""

    def __init__(self, path: Path) -> None:
        self._path = path if path != IN_MEMORY else None
        self._first: os.stat_result | None = None
        self._size = 0
        self.check()

    def check(self) -> None:
        """Raises StoreError if the file is gone, another one, or shorter than it was."""
        if self._path is None:
            return
        try:
            status = self._path.stat()
        except OSError as error:
            raise StoreError(
                f"{self._path}: the robot's memory is gone ({error.strerror}); put it back, or restart the daemon"
            ) from error
        first = self._first = self._first or status
        if (status.st_dev, status.st_ino) != (first.st_dev, first.st_ino):
            raise StoreError(f"{self._path}: another file has replaced the robot's memory; restart the daemon")
        if status.st_size < self._size:
            raise StoreError(f"{self._path}: the robot's memory was cut short; check the disk and restart the daemon")
        self._size = status.st_size


@dataclass(frozen=True)
class TranscriptRow:
    """One utterance of a transcript on file: its number, when it was written (seconds since 1970, None before that
    was noted), and the utterance."""

    number: int
    wall_s: float | None
    record: TranscriptRecord


class TranscriptReader:
    """Reads the transcript of a store, which another object of this process may be writing, and changes nothing.

    Raises StoreError when there is no such file, it is no robot's memory, it cannot be read, or another process has it
    open.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            is_there = path.is_file()
        except OSError as error:
            raise StoreError(f"{path}: {error.strerror}; use sudo, or name another with --memory FILE") from error
        if not is_there:
            raise StoreError(f"{path}: there is no robot's memory here; name another with --memory FILE")
        with self._reading():
            self._db = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=1.0)

    def rows(self, after: int = 0, since_wall_s: float = float("-inf"), limit: int = -1) -> tuple[TranscriptRow, ...]:
        """The first `limit` utterances (-1: all) with numbers over `after`, written at `since_wall_s` or later, in the
        order they were kept."""
        query = (
            f"SELECT id, CASE WHEN wall_s BETWEEN 0 AND {YEAR_9999_S} THEN wall_s END, "
            "at_s, kind, speaker, text, confidence, seal FROM transcript "
            "WHERE id > ? AND coalesce(max(wall_s, 0), 0) >= ? ORDER BY id LIMIT ?"
        )
        with self._reading():
            found = self._db.execute(query, (after, max(since_wall_s, -1.0), limit)).fetchall()
        return tuple(TranscriptRow(row[0], row[1], TranscriptRecord(*row[2:])) for row in found)

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    @contextmanager
    def _reading(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.DatabaseError as error:
            raise StoreError(f"{self.path}: {_unread(error)}") from error


def _unread(error: sqlite3.DatabaseError) -> str:
    """Why no transcript can be read from a file, and what to do. Codes: sqlite.org/rescode.html."""
    match getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF:
        case sqlite3.SQLITE_BUSY:
            return "the robot's daemon has it open; ask that, by `hvcpctl transcript` without --memory, or end it"
        case sqlite3.SQLITE_CANTOPEN | sqlite3.SQLITE_READONLY:
            copied = "copy all files whose names begin so to a folder of yours"
            return f"you may not read it, or not write in its folder, as SQLite has to; use sudo, or {copied}"
        case sqlite3.SQLITE_IOERR:
            return f"it cannot be read ({error}); check its disk"
        case sqlite3.SQLITE_CORRUPT:
            return f"it is damaged ({error}); when the daemon starts, it sets it aside and begins a new one"
        case code if code == sqlite3.SQLITE_NOTADB or "no such table" in str(error):
            return "this is no robot's memory; name another with --memory FILE"
        case _:
            return f"no transcript can be read from it ({error}); start the daemon once to update it"
