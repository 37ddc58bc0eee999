"""The file of a robot's memory: opened, brought up to date, checked, and set aside when it is damaged."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import structlog

from hvcpd.errors import NewerStoreError, StoreError

SCHEMA_VERSION = 3
"""Kept in SQLite's `user_version`; raised with every change of the tables."""

_UPGRADES = {
    1: "ALTER TABLE transcript ADD COLUMN wall_s REAL; " + "CREATE TABLE flags (name TEXT PRIMARY KEY) STRICT;",
    2: "ALTER TABLE transcript ADD COLUMN seal TEXT;",
}
"""The upgrade from each version to the next one; a store is upgraded when it is opened."""

PAGE_BYTES = 1024
"""Of a file: each write puts whole pages into the journal and later into the file. In an hour of much talk 1.41 MB
reached a card whose own pages have 4,096; with 512 it was 1.50, with 2,048 1.74, with SQLite's usual 4,096 1.79."""

JOURNAL_BYTES = 1 << 20
"""Kept for SQLite's own journal, which has 1,000 pages before it begins anew: where it need not grow, the file system
writes less beside it."""

MAX_SET_ASIDE = 100
"""Number of damaged files kept beside the store; with more, the cause is one that a new file does not remove."""

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
    wall_s REAL,
    seal TEXT
) STRICT;
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

Connect = Callable[[Path], sqlite3.Connection]
"""How SQLite opens a file; a test hands in one with limits of its own."""

_log = structlog.get_logger(__name__)


def connect(path: Path) -> sqlite3.Connection:
    """A connection that commits each statement and waits 1 s for another process.

    No other process reads the file meanwhile: so SQLite's index of its journal (NAME-shm), which changes with each
    write, is in this process's memory and not on the card (sqlite.org/vfs.html#standard_unix_vfses).
    """
    name = str(path) if path == IN_MEMORY else f"{path.absolute().as_uri()}?vfs=unix-excl"
    return sqlite3.connect(name, timeout=1.0, isolation_level=None, uri=True)


@contextmanager
def failures(path: Path) -> Iterator[None]:
    """SQLite's errors about the disk as StoreError; errors in our own queries are left as they are."""
    try:
        yield
    except sqlite3.DatabaseError as error:
        remedy = _remedy(error)
        if remedy is None:
            raise
        raise StoreError(f"{path}: the robot's memory cannot be used ({error}); {remedy}") from error


def _remedy(error: sqlite3.DatabaseError) -> str | None:
    """The remedy for a failure, or None if it is our own bug. Codes: sqlite.org/rescode.html."""
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


@dataclass(frozen=True)
class Opened:
    """A store's connection; `is_new`: the file was empty; `damage`: why an earlier file was set aside."""

    db: sqlite3.Connection
    is_new: bool
    damage: str | None = None


def open_store(path: Path, connect: Connect) -> Opened:
    """The store in the file, or a new one; a damaged one is set aside.

    Raises StoreError, and NewerStoreError for a file of a newer version, which is left as it is.
    """
    if path != IN_MEMORY:
        make_directory(path.parent)
    with failures(path):
        try:
            opened = _checked(connect(path), path)
        except sqlite3.DatabaseError as error:
            # ERROR: our statements are right, so a schema or a format that SQLite cannot read is the file's fault.
            damaged = sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR
            if (getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF) not in damaged:
                raise
            set_aside(path, str(error))
            opened = replace(_checked(connect(path), path), damage=str(error))
    with suppress(OSError):  # without room for its journal nothing is lost but writes to the card
        descriptor = os.open(path.with_name(f"{path.name}-wal"), os.O_WRONLY | os.O_CLOEXEC)
        try:
            os.posix_fallocate(descriptor, 0, JOURNAL_BYTES)
        finally:
            os.close(descriptor)
    return opened


def make_directory(directory: Path) -> None:
    """Create the folder of a memory, if it does not exist. Raises StoreError."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(
            f"{directory}: the directory of the robot's memory cannot be made ({error.strerror}); "
            "make it, writable for the daemon's user, or set `state_dir` to another"
        ) from error


def _checked(db: sqlite3.Connection, path: Path) -> Opened:
    """The store with our schema in it. Raises sqlite3.DatabaseError, with the code CORRUPT or NOTADB if it is damaged,
    and NewerStoreError; the connection is closed then."""
    with ExitStack() as stack:
        stack.callback(db.close)
        (version,) = db.execute("PRAGMA user_version").fetchone()
        (tables,) = db.execute("SELECT count(*) FROM sqlite_master").fetchone()
        while version in _UPGRADES and tables:
            db.executescript(f"BEGIN; {_UPGRADES[version]} PRAGMA user_version = {version + 1}; COMMIT;")
            version += 1
        if version > SCHEMA_VERSION and db.execute("PRAGMA quick_check(1)").fetchone() == ("ok",):
            raise NewerStoreError(
                f"{path}: a newer hvcpd wrote the robot's memory (version {version}; this one knows {SCHEMA_VERSION}); "
                "install that hvcpd again, or move the file away: the robot then starts stopped, and remembers nothing"
            )
        is_new = version == 0 and tables == 0
        if not is_new and version != SCHEMA_VERSION:
            raise _damage(f"its version is {version}, ours {SCHEMA_VERSION}")
        db.execute(f"PRAGMA page_size = {PAGE_BYTES}")  # of a new file
        db.execute("PRAGMA journal_mode = WAL")
        # A power cut may lose the last writes but never the file (sqlite.org/pragma.html#pragma_synchronous).
        db.execute("PRAGMA synchronous = NORMAL")
        db.execute("DROP INDEX IF EXISTS transcript_at")  # of older versions: one more page for each write
        if is_new:
            db.executescript(f"BEGIN; {_SCHEMA} PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;")
        (verdict,) = db.execute("PRAGMA quick_check(1)").fetchone()
        if verdict != "ok":
            raise _damage(verdict)
        missing = _columns_of_ours() - _columns(db)
        if missing:
            raise _damage(f"tables or columns are missing: {', '.join(sorted(missing))}")
        stack.pop_all()
    return Opened(db, is_new)


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


def set_aside(path: Path, reason: str) -> None:
    """Rename a damaged file, with a store's journals, so that a person can inspect it and the robot can start afresh.

    Raises StoreError if that cannot be done.
    """
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
    _log.warning("file set aside", path=str(path), aside=str(aside), reason=reason)
