"""A robot's memory: its own copy of the tasks, the transcript, its peers and its counters, in one SQLite file.

One robot, one file, one writer; nothing is shared. All times are seconds of the robot's sample clock.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any, Literal, cast

import structlog

from hvcpd.errors import StoreError

TaskState = Literal["open", "claimed", "done", "failed"]
TranscriptKind = Literal["said", "heard", "garbled"]

SCHEMA_VERSION = 2
"""Kept in SQLite's `user_version`; raised with every change of the tables."""

_UPGRADES = {
    1: "ALTER TABLE transcript ADD COLUMN wall_s REAL; " + "CREATE TABLE flags (name TEXT PRIMARY KEY) STRICT;"
}
"""What leads from a version to the next one; a store is upgraded when it is opened."""

MAX_SET_ASIDE = 100
"""Damaged files kept beside the store; beyond, something is wrong that a new file does not mend."""

IN_MEMORY = Path(":memory:")
"""A store that is gone when it is closed, for simulations."""

_SCHEMA = """
CREATE TABLE tasks (
    number INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    state TEXT NOT NULL CHECK (state IN ('open', 'claimed', 'done', 'failed')),
    owner TEXT,
    changed_at_s REAL NOT NULL
) STRICT;
CREATE TABLE transcript (
    id INTEGER PRIMARY KEY,
    at_s REAL NOT NULL,
    kind TEXT NOT NULL CHECK (kind IN ('said', 'heard', 'garbled')),
    speaker TEXT,
    text TEXT NOT NULL,
    confidence REAL,
    wall_s REAL
) STRICT;
CREATE INDEX transcript_at ON transcript (at_s);
CREATE TABLE peers (
    name TEXT PRIMARY KEY COLLATE NOCASE,
    team TEXT,
    last_heard_s REAL NOT NULL
) STRICT;
CREATE TABLE counters (
    name TEXT PRIMARY KEY,
    value INTEGER NOT NULL
) STRICT;
CREATE TABLE flags (name TEXT PRIMARY KEY) STRICT;
"""

_WALL_CLOCK_S = "(julianday('now') - 2440587.5) * 86400.0"
"""SQLite's clock in seconds since 1970: for people who ask what was said this morning; the robot itself never does."""

Connect = Callable[[Path], sqlite3.Connection]
"""How SQLite opens a file; a test hands in one with limits of its own."""

_log = structlog.get_logger(__name__)


def connect(path: Path) -> sqlite3.Connection:
    """A connection that commits each statement and waits 1 s for another process."""
    return sqlite3.connect(path, timeout=1.0, isolation_level=None)


@dataclass(frozen=True)
class TaskRecord:
    """What this robot knows of a task; `owner` is the name of the robot that claimed, did or failed it."""

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


@dataclass(frozen=True)
class PeerRecord:
    """Another robot that was heard, and when last."""

    name: str
    team: str | None
    last_heard_s: float


class Store:
    """The memory in the file `path`, opened or made new.

    A file that is damaged, or of a newer version, is set aside as NAME.corrupt-N with a warning in the log, and a
    new one is begun. Every method raises StoreError when the disk is full, read-only or failing.
    """

    def __init__(self, path: Path = IN_MEMORY, connect: Connect = connect) -> None:
        self._path = path
        self._db = _open(path, connect)

    def save_task(self, task: TaskRecord) -> None:
        """Keep what is known of a task, in place of what was known of that number before."""
        self._write("INSERT OR REPLACE INTO tasks VALUES (?, ?, ?, ?, ?)", astuple(task))

    def tasks(self) -> tuple[TaskRecord, ...]:
        """All tasks by number."""
        return tuple(TaskRecord(*row) for row in self._read("SELECT * FROM tasks ORDER BY number"))

    def append_transcript(self, record: TranscriptRecord) -> None:
        """Add an utterance to the transcript."""
        self._write(
            "INSERT INTO transcript (at_s, kind, speaker, text, confidence, wall_s) "
            f"VALUES (?, ?, ?, ?, ?, {_WALL_CLOCK_S})",
            astuple(record),
        )

    def transcript(self, since_s: float = float("-inf")) -> tuple[TranscriptRecord, ...]:
        """The utterances from `since_s` on, in the order of their times."""
        query = "SELECT at_s, kind, speaker, text, confidence FROM transcript WHERE at_s >= ? ORDER BY at_s, id"
        return tuple(TranscriptRecord(*row) for row in self._read(query, (since_s,)))

    def save_peer(self, peer: PeerRecord) -> None:
        """Keep what is known of a robot, in place of what was known before; names are the same in any case."""
        self._write("INSERT OR REPLACE INTO peers VALUES (?, ?, ?)", astuple(peer))

    def peers(self) -> tuple[PeerRecord, ...]:
        """All robots that were ever heard, by name."""
        return tuple(PeerRecord(*row) for row in self._read("SELECT * FROM peers ORDER BY name"))

    def names_heard(self) -> tuple[str, ...]:
        """The names of all robots that were ever heard, who was heard last at the end."""
        return tuple(name for (name,) in self._read("SELECT name FROM peers ORDER BY rowid"))

    def count(self, name: str, by: int = 1) -> None:
        """Add to a counter; one that is new begins at 0."""
        query = "INSERT INTO counters VALUES (?, ?) ON CONFLICT (name) DO UPDATE SET value = value + excluded.value"
        self._write(query, (name, by))

    def raise_counter(self, name: str, value: int) -> None:
        """Remember a counter's value, unless a higher one is remembered."""
        query = "INSERT INTO counters VALUES (?, ?) ON CONFLICT (name) DO UPDATE SET value = max(value, excluded.value)"
        self._write(query, (name, value))

    def set_flag(self, name: str, on: bool) -> None:
        """Remember that something is so, or no longer."""
        self._write("INSERT OR IGNORE INTO flags VALUES (?)" if on else "DELETE FROM flags WHERE name = ?", (name,))

    def flags(self) -> frozenset[str]:
        """All that is so."""
        return frozenset(name for (name,) in self._read("SELECT name FROM flags"))

    def counters(self) -> dict[str, int]:
        """All counters by name."""
        return dict(self._read("SELECT name, value FROM counters ORDER BY name"))

    def close(self) -> None:
        """Let go of the file; twice is harmless."""
        self._db.close()

    def _write(self, query: str, values: Sequence[Any]) -> None:
        with _failures(self._path):
            self._db.execute(query, values)

    def _read(self, query: str, values: Sequence[Any] = ()) -> list[Any]:
        with _failures(self._path):
            return self._db.execute(query, values).fetchall()


@dataclass(frozen=True)
class TranscriptRow:
    """One utterance of a transcript on file: its number, when it was written (seconds since 1970, None before that
    was noted), and the utterance."""

    number: int
    wall_s: float | None
    record: TranscriptRecord


class TranscriptReader:
    """Reads the transcript of a store that a daemon may be writing at the same time, and changes nothing.

    Raises StoreError when there is no such file, or it is no robot's memory.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        if not path.is_file():
            raise StoreError(f"{path}: there is no robot's memory here; name another with --memory FILE")
        self._db = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=1.0)

    def rows(self, after: int = 0, since_wall_s: float = float("-inf"), limit: int = -1) -> tuple[TranscriptRow, ...]:
        """The first `limit` utterances (-1: all) with numbers over `after`, written at `since_wall_s` or later, in the
        order they were kept."""
        query = (
            "SELECT id, wall_s, at_s, kind, speaker, text, confidence FROM transcript "
            "WHERE id > ? AND coalesce(wall_s, 0) >= ? ORDER BY id LIMIT ?"
        )
        try:
            found = self._db.execute(query, (after, max(since_wall_s, -1.0), limit)).fetchall()
        except sqlite3.DatabaseError as error:
            raise StoreError(
                f"{self._path}: no transcript can be read from it ({error}); start the daemon once to update it"
            ) from error
        return tuple(TranscriptRow(row[0], row[1], TranscriptRecord(*row[2:])) for row in found)

    def close(self) -> None:
        """Let go of the file."""
        self._db.close()


@contextmanager
def _failures(path: Path) -> Iterator[None]:
    """SQLite's complaints about the disk as StoreError; those about our own queries are left as they are."""
    try:
        yield
    except sqlite3.DatabaseError as error:
        remedy = _remedy(error)
        if remedy is None:
            raise
        raise StoreError(f"{path}: the robot's memory cannot be used ({error}); {remedy}") from error


def _remedy(error: sqlite3.DatabaseError) -> str | None:
    """What a person can do about a failure, or None if it is our own mistake. Codes: sqlite.org/rescode.html."""
    match cast(int, getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR)) & 0xFF:
        case sqlite3.SQLITE_FULL:
            return "free some space on its disk"
        case sqlite3.SQLITE_READONLY | sqlite3.SQLITE_PERM | sqlite3.SQLITE_AUTH:
            return "make the file and its directory writable for the daemon's user"
        case sqlite3.SQLITE_CANTOPEN:
            return "make its directory, writable for the daemon's user, or set `state_dir` to another"
        case sqlite3.SQLITE_BUSY | sqlite3.SQLITE_LOCKED:
            return "another process uses it; stop that one, or set `state_dir` to another directory"
        case sqlite3.SQLITE_IOERR | sqlite3.SQLITE_CORRUPT | sqlite3.SQLITE_NOTADB:
            return "check the disk and start again; a damaged file is then set aside"
        case _:
            return None


def _open(path: Path, connect: Connect) -> sqlite3.Connection:
    if path != IN_MEMORY:
        _make_directory(path.parent)
    with _failures(path):
        try:
            return _checked(connect(path))
        except sqlite3.DatabaseError as error:
            # ERROR: our statements are right, so a schema or a format that SQLite cannot read is the file's fault.
            damaged = sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR
            if (getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF) not in damaged:
                raise
            _set_aside(path, str(error))
        return _checked(connect(path))


def _make_directory(directory: Path) -> None:
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(
            f"{directory}: the directory of the robot's memory cannot be made ({error.strerror}); "
            "make it, writable for the daemon's user, or set `state_dir` to another"
        ) from error


def _checked(db: sqlite3.Connection) -> sqlite3.Connection:
    """The store with our schema in it. Raises sqlite3.DatabaseError, with the code CORRUPT or NOTADB if it is damaged;
    the connection is closed then."""
    with ExitStack() as stack:
        stack.callback(db.close)
        (version,) = db.execute("PRAGMA user_version").fetchone()
        (tables,) = db.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if version in _UPGRADES and tables:
            db.executescript(f"BEGIN; {_UPGRADES[version]} PRAGMA user_version = {version + 1}; COMMIT;")
            version += 1
        if not (version == 0 and tables == 0) and version != SCHEMA_VERSION:
            raise _damage(f"its version is {version}, ours {SCHEMA_VERSION}")
        db.execute("PRAGMA journal_mode = WAL")
        # A power cut may lose the last writes but never the file (sqlite.org/pragma.html#pragma_synchronous).
        db.execute("PRAGMA synchronous = NORMAL")
        if version == 0:
            db.executescript(f"BEGIN; {_SCHEMA} PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;")
        (verdict,) = db.execute("PRAGMA quick_check(1)").fetchone()
        if verdict != "ok":
            raise _damage(verdict)
        missing = _columns_of_ours() - _columns(db)
        if missing:
            raise _damage(f"tables or columns are missing: {', '.join(sorted(missing))}")
        stack.pop_all()
    return db


def _columns(db: sqlite3.Connection) -> set[str]:
    """Every column of every table, with its place: "peers.1 team"."""
    query = (
        "SELECT m.name || '.' || p.cid || ' ' || p.name FROM sqlite_master m, pragma_table_info(m.name) p "
        "WHERE m.type = 'table'"
    )
    return {name for (name,) in db.execute(query)}


def _columns_of_ours() -> set[str]:
    with closing(sqlite3.connect(":memory:")) as db:
        db.executescript(_SCHEMA)
        return _columns(db)


def _damage(text: str) -> sqlite3.DatabaseError:
    error = sqlite3.DatabaseError(text)
    error.sqlite_errorcode = sqlite3.SQLITE_CORRUPT
    return error


def _set_aside(path: Path, reason: str) -> None:
    """Rename a damaged store, with its journals, so that a person can look at it and the robot can begin anew."""
    for number in range(1, MAX_SET_ASIDE + 1):
        aside = path.with_name(f"{path.name}.corrupt-{number}")
        if not aside.exists():
            break
    else:
        raise StoreError(f"{path}: {MAX_SET_ASIDE} damaged files lie beside it; check the disk and delete them")
    try:
        for suffix in ("", "-wal", "-shm"):
            part = path.with_name(path.name + suffix)
            if part.exists():
                part.rename(aside.with_name(aside.name + suffix))
    except OSError as error:
        raise StoreError(f"{path}: damaged, and cannot be set aside ({error.strerror}); move it away") from error
    _log.warning("store set aside", path=str(path), aside=str(aside), reason=reason)
