"""A robot's memory: its own, and never a reason to stop."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from structlog.testing import capture_logs

from hvcpd.errors import EX_CONFIG, NewerStoreError, StoreError
from hvcpd.memory.store import FORGET_EVERY, PeerRecord, Store, TaskRecord, TranscriptReader, TranscriptRecord
from hvcpd.memory.store_file import SCHEMA_VERSION, connect

GREEN = TaskRecord(1, "water the green rose", "claimed", "Rob", 12.5)
HEARD = TranscriptRecord(3.0, "heard", "Bot", "Hi all, I am Bot", 0.97)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "state" / "rob.sqlite3"


@pytest.fixture
def store(path: Path) -> Iterator[Store]:
    with closing(Store(path)) as opened:
        yield opened


def test_what_was_kept_is_there_after_a_restart(path: Path) -> None:
    with closing(Store(path)) as store:
        store.save_task(GREEN)
        store.append_transcript(HEARD)
        store.save_peer(PeerRecord("Bot", "plant", 3.0))
        store.count("garbled")
        store.count("garbled", 4)
    with closing(Store(path)) as again:
        assert again.tasks() == (GREEN,)
        assert again.transcript() == (HEARD,)
        assert again.peers() == (PeerRecord("Bot", "plant", 3.0),)
        assert again.counters() == {"garbled": 5}


def test_what_was_kept_is_there_after_a_crash(path: Path) -> None:
    store = Store(path)
    store.save_task(GREEN)
    with closing(Store(path)) as after:  # the first was never closed
        assert after.tasks() == (GREEN,)
    store.close()


def test_two_robots_share_nothing(tmp_path: Path) -> None:
    with closing(Store(tmp_path / "rob.sqlite3")) as rob, closing(Store(tmp_path / "bot.sqlite3")) as bot:
        rob.save_task(GREEN)
        assert bot.tasks() == ()
    with closing(Store()) as one, closing(Store()) as other:
        one.save_task(GREEN)
        assert other.tasks() == ()


def test_a_task_has_one_row_and_peers_one_name(store: Store) -> None:
    store.save_task(GREEN)
    done = TaskRecord(1, "water the green rose", "done", "Rob", 90.0)
    store.save_task(done)
    assert store.tasks() == (done,)
    store.save_peer(PeerRecord("Bot", None, 1.0))
    store.save_peer(PeerRecord("bot", "plant", 2.0))
    assert store.peers() == (PeerRecord("bot", "plant", 2.0),)


def test_the_transcript_since_a_time(store: Store) -> None:
    for second in (5.0, 1.0, 3.0):
        store.append_transcript(TranscriptRecord(second, "garbled", None, ""))
    assert [record.at_s for record in store.transcript()] == [1.0, 3.0, 5.0]
    assert [record.at_s for record in store.transcript(3.0)] == [3.0, 5.0]


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


texts = st.text(alphabet=st.characters(codec="utf-8"), max_size=40)
times = st.floats(allow_nan=False, allow_infinity=False)


@given(
    st.lists(
        st.builds(
            TranscriptRecord,
            times,
            st.sampled_from(["said", "heard", "garbled"]),
            st.none() | texts,
            texts,
            st.none() | st.floats(0, 1),
        ),
        max_size=10,
    )
)
def test_any_transcript_is_given_back_in_the_order_of_its_times(records: list[TranscriptRecord]) -> None:
    with closing(Store()) as store:
        for record in records:
            store.append_transcript(record)
        assert list(store.transcript()) == sorted(records, key=lambda record: record.at_s)


def test_wrong_states_are_our_own_mistake(store: Store) -> None:
    with pytest.raises(sqlite3.IntegrityError):
        store.save_task(TaskRecord(1, "x", "lost", None, 0.0))  # type: ignore[arg-type]


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
    assert (line["log_level"], line["event"], line["aside"]) == ("warning", "store set aside", str(aside))
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


def test_a_memory_has_a_number_of_its_own_that_is_no_counter(path: Path) -> None:
    with closing(Store(path)) as store:
        assert (store.is_new, store.identity) == (True, None)
        store.mark(2**62 - 1)
        assert path.stat().st_size > 4096, "it is in the file itself, and not in its journal alone"
    with closing(Store(path, durable=True)) as again:
        assert (again.is_new, again.identity, again.counters()) == (False, 2**62 - 1, {})


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


def test_another_process_that_holds_the_file(path: Path, store: Store) -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(StoreError, match="another process uses it"):
            store.save_task(GREEN)
        other.execute("ROLLBACK")
    store.save_task(GREEN)


def test_the_version_is_in_the_file(path: Path, store: Store) -> None:
    with closing(sqlite3.connect(path)) as db:
        assert db.execute("PRAGMA user_version").fetchone() == (SCHEMA_VERSION,)


def test_closing_twice_is_harmless(path: Path) -> None:
    store = Store(path)
    store.close()
    store.close()


@pytest.mark.parametrize(
    ("script", "is_dated"),
    [
        ("ALTER TABLE transcript DROP COLUMN seal; PRAGMA user_version = 2;", True),
        (
            "ALTER TABLE transcript DROP COLUMN seal; ALTER TABLE transcript DROP COLUMN wall_s; DROP TABLE flags; "
            "PRAGMA user_version = 1;",
            False,
        ),
    ],
)
def test_an_older_store_is_upgraded_with_all_that_is_in_it(path: Path, script: str, is_dated: bool) -> None:
    with closing(Store(path)) as store:
        store.save_task(GREEN)
        store.append_transcript(HEARD)
    with closing(sqlite3.connect(path)) as db:
        db.executescript(script)
    with closing(Store(path)) as again:
        assert again.tasks() == (GREEN,)
        assert again.transcript() == (HEARD,)
        again.append_transcript(HEARD)
    assert not list(path.parent.glob("*.corrupt-*"))
    with closing(TranscriptReader(path)) as reader:
        assert [row.wall_s is None for row in reader.rows()] == [not is_dated, False]


def test_a_transcript_is_read_while_it_is_written(path: Path, store: Store) -> None:
    store.append_transcript(HEARD)
    with closing(TranscriptReader(path)) as reader:
        (first,) = reader.rows()
        assert first.record == HEARD
        store.append_transcript(TranscriptRecord(4.0, "said", "Rob", "Hi Bot, I am Rob, confirmed"))
        assert [row.record.at_s for row in reader.rows(after=first.number)] == [4.0]
        assert reader.rows(since_wall_s=1e12) == ()


def test_no_transcript_where_there_is_no_memory(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="--memory"):
        TranscriptReader(tmp_path / "nobody.sqlite3")
    (tmp_path / "other").write_text("no database at all, but long enough to be taken for one")
    with pytest.raises(StoreError, match="this is no robot's memory"):
        TranscriptReader(tmp_path / "other").rows()


KILLED = """
import sys
from pathlib import Path
from hvcpd.memory.store import Store, TaskRecord
store = Store(Path(sys.argv[1]))
for number in range(1, 100_000):
    store.save_task(TaskRecord(number, f"task {number}", "done", "Rob", float(number)))
    sys.stdout.write(f"{number}\\n")
    sys.stdout.flush()
"""


@pytest.mark.parametrize("lines", [1, 7, 60])
def test_what_was_told_as_kept_survives_kill_9(lines: int, tmp_path: Path) -> None:
    path = tmp_path / "rob.sqlite3"
    with subprocess.Popen([sys.executable, "-c", KILLED, str(path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        told = [int(next(process.stdout)) for _ in range(lines)][-1]
        process.kill()
        told = max([told, *(int(line) for line in process.stdout if line.endswith("\n"))])
    with closing(Store(path)) as store:
        kept = [task.number for task in store.tasks()]
    assert kept == list(range(1, len(kept) + 1))
    assert len(kept) >= told
    assert not list(tmp_path.glob("*.corrupt-*"))


def test_who_was_heard_last_is_the_last_name(store: Store) -> None:
    for name, at_s in (("Rob", 1.0), ("Bot", 2.0), ("Max", 3.0), ("rob", 4.0)):
        store.save_peer(PeerRecord(name, None, at_s))
    assert store.names_heard() == ("Bot", "Max", "rob")


def test_the_oldest_utterances_are_forgotten_and_the_newest_never(path: Path) -> None:
    with closing(Store(path, utterances=500)) as store:
        for number in range(3 * FORGET_EVERY + 10):
            store.append_transcript(TranscriptRecord(float(number), "said", "Rob", "Hi all, I am Rob"))
            if number % 100 == 0:
                assert len(store.transcript()) <= 500 + FORGET_EVERY
        kept = [record.at_s for record in store.transcript()]
    assert kept == [float(number) for number in range(3 * FORGET_EVERY - 500, 3 * FORGET_EVERY + 10)]


def test_what_is_written_together_is_there_as_a_whole_or_not_at_all(path: Path) -> None:
    with closing(Store(path)) as store:
        with suppress(KeyboardInterrupt), store.together():
            store.append_transcript(HEARD)
            raise KeyboardInterrupt
        assert store.transcript() == ()
        with store.together():
            store.append_transcript(HEARD)
        assert store.transcript() == (HEARD,)
