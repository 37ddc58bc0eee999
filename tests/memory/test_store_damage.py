"""A robot's memory whose file is damaged, changed or refused: never a reason to stop."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from hvcpd.errors import EX_CONFIG, NewerStoreError, StoreError
from hvcpd.memory.store import Store, TranscriptRecord
from hvcpd.memory.store_file import SCHEMA_VERSION, connect
from tests.memory.test_store import GREEN, HEARD


def small_disk(path: Path) -> sqlite3.Connection:
    """A file that cannot grow beyond 16 pages."""
    db = connect(path)
    db.execute("PRAGMA max_page_count = 16")
    return db


def fill(store: Store) -> None:
    for _ in range(10_000):
        store.append_transcript(TranscriptRecord(1.0, "said", "Rob", "x" * 1000))


def write_protected(path: Path) -> sqlite3.Connection:
    """A file that can only be read (the superuser, as whom tests may run, ignores the file's own mode)."""
    db = connect(path)
    db.execute("PRAGMA query_only = ON")
    return db


def _break_header(path: Path) -> None:
    path.write_bytes(b"no database at all, but long enough to be taken for one" * 100)


def _break_page(path: Path) -> None:
    data = bytearray(path.read_bytes())
    for page in range(1, len(data) // 4096):
        data[page * 4096 : page * 4096 + 200] = b"\xff" * 200
    path.write_bytes(bytes(data))


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:5000])


def _from_the_future(path: Path) -> None:
    with closing(sqlite3.connect(path)) as db:
        db.execute(f"PRAGMA user_version = {SCHEMA_VERSION + 1}")


def _drop_a_table(path: Path) -> None:
    with closing(sqlite3.connect(path)) as db:
        db.execute("DROP TABLE peers")


def _somebody_elses(path: Path) -> None:
    path.unlink()
    with closing(sqlite3.connect(path)) as db:
        db.execute("CREATE TABLE recipes (name TEXT)")


def _rename_a_column(path: Path) -> None:
    with closing(sqlite3.connect(path)) as db:
        db.execute("ALTER TABLE peers RENAME COLUMN team TO colour")


def _unknown_format(path: Path) -> None:
    """The schema's format number (sqlite.org/fileformat.html, 1.3.12) is one that SQLite does not know."""
    data = bytearray(path.read_bytes())
    data[44:48] = (9).to_bytes(4, "big")
    path.write_bytes(bytes(data))


DAMAGES = [
    *(_break_header, _break_page, _cut, _drop_a_table, _somebody_elses),
    *(_rename_a_column, _unknown_format),
]


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_set_aside_whole_and_a_new_one_begun(damage: object, path: Path) -> None:
    with closing(Store(path)) as store:
        store.save_task(GREEN)
    assert callable(damage)
    damage(path)
    damaged = path.read_bytes()
    neighbour = path.with_name("bot.sqlite3")
    neighbour.write_bytes(b"not to be touched")
    with capture_logs() as logs, closing(Store(path)) as store:
        assert store.tasks() == ()
        store.save_task(GREEN)
        assert store.tasks() == (GREEN,)
    aside = path.with_name("rob.sqlite3.corrupt-1")
    assert aside.read_bytes() == damaged
    assert neighbour.read_bytes() == b"not to be touched"
    (line,) = logs
    assert (line["log_level"], line["event"], line["aside"]) == ("warning", "file set aside", str(aside))
    assert line["reason"]


def test_what_a_crash_left_in_the_journal_is_set_aside_too(path: Path, tmp_path: Path) -> None:
    crashed = tmp_path / "crashed" / "rob.sqlite3"
    with closing(Store(path)) as store, closing(sqlite3.connect(path)) as db:
        store.save_task(GREEN)
        db.execute("DROP TABLE peers")
        shutil.copytree(path.parent, crashed.parent)  # both the file and its journal, as a power cut leaves them
        assert crashed.with_name("rob.sqlite3-wal").stat().st_size > 0
    with capture_logs(), closing(Store(crashed)) as anew:
        assert anew.tasks() == ()
    with closing(sqlite3.connect(crashed.with_name("rob.sqlite3.corrupt-1"))) as db:
        assert db.execute("SELECT name, state FROM tasks").fetchall() == [(GREEN.name, GREEN.state)]


def test_a_newer_memory_is_left_as_it_is(path: Path) -> None:
    with closing(Store(path)) as store:
        store.save_task(GREEN)
    _from_the_future(path)
    newer = path.read_bytes()
    for _ in range(2):
        with pytest.raises(NewerStoreError, match="install that hvcpd again") as error:
            Store(path)
        assert error.value.exit_status == EX_CONFIG, "systemd does not try it again"
    assert path.read_bytes() == newer
    assert not list(path.parent.glob("*.corrupt-*"))


def _gone(path: Path) -> None:
    path.unlink()


def _emptied(path: Path) -> None:
    os.truncate(path, 0)


def _replaced(path: Path) -> None:
    path.rename(path.with_name("before"))
    shutil.copy(path.with_name("before"), path)


@pytest.mark.parametrize(("harm", "told"), [(_gone, "gone"), (_emptied, "cut short"), (_replaced, "another file")])
def test_a_file_that_changes_under_the_robot_is_noticed_with_the_next_write(
    harm: Callable[[Path], None], told: str, path: Path, store: Store
) -> None:
    store.mark(7)
    store.save_task(GREEN)
    harm(path)
    for _ in range(2):
        with pytest.raises(StoreError, match=told):
            store.append_transcript(HEARD)


def test_each_damaged_file_is_kept(path: Path) -> None:
    for _ in range(3):
        Store(path).close()
        _break_header(path)
    with capture_logs(), closing(Store(path)):
        pass
    assert sorted(file.name for file in path.parent.glob("*.corrupt-*")) == [
        f"rob.sqlite3.corrupt-{number}" for number in (1, 2, 3)
    ]


def test_a_full_disk_is_told_and_what_was_kept_stays(path: Path) -> None:
    with closing(Store(path, small_disk)) as store:
        store.save_task(GREEN)
        with pytest.raises(StoreError, match="free some space on its disk") as error:
            fill(store)
        assert str(path) in str(error.value)
        assert store.tasks() == (GREEN,)
        kept = len(store.transcript())
        assert kept > 0
    with closing(Store(path)) as again:
        assert len(again.transcript()) == kept


def test_a_file_that_may_not_be_written(path: Path) -> None:
    with closing(Store(path)) as store:
        store.save_task(GREEN)
    with closing(Store(path, write_protected)) as store:
        assert store.tasks() == (GREEN,)
        with pytest.raises(StoreError, match="writable for the daemon's user"):
            store.save_task(GREEN)


def test_a_directory_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="state_dir"):
        Store(tmp_path / "file" / "rob.sqlite3")


def test_a_directory_in_the_files_place(tmp_path: Path) -> None:
    (tmp_path / "rob.sqlite3").mkdir()
    with pytest.raises(StoreError, match="set `state_dir` to another"):
        Store(tmp_path / "rob.sqlite3")
