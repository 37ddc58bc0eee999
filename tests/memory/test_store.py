"""A robot's memory: its own, and what is kept in it."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
from contextlib import closing, suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.errors import StoreError
from hvcpd.memory.store import FORGET_EVERY, PeerRecord, Store, TaskRecord, TranscriptReader, TranscriptRecord
from hvcpd.memory.store_file import SCHEMA_VERSION, connect

GREEN = TaskRecord(1, "water the green rose", "claimed", "Rob", 12.5)
HEARD = TranscriptRecord(3.0, "heard", "Bot", "Hi all, I am Bot", 0.97)


def test_what_was_kept_is_there_after_a_restart(path: Path) -> None:
    with closing(Store(path)) as store:
        store.save_task(GREEN)
        store.append_transcript(HEARD)
        store.save_peer(PeerRecord("Bot", "plant", 3.0))
        store.raise_counter("due 1", 5)
        store.raise_counter("due 1", 4)
    with closing(Store(path)) as again:
        assert again.tasks() == (GREEN,)
        assert again.transcript() == (HEARD,)
        assert again.peers() == (PeerRecord("Bot", "plant", 3.0),)
        assert again.counters() == {"due 1": 5}


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


def test_a_memory_has_a_number_of_its_own_that_is_no_counter(path: Path) -> None:
    with closing(Store(path)) as store:
        assert (store.is_new, store.identity) == (True, None)
        store.mark(2**62 - 1)
        assert path.stat().st_size > 4096, "it is in the file itself, and not in its journal alone"
    with closing(Store(path, durable=True)) as again:
        assert (again.is_new, again.identity, again.counters()) == (False, 2**62 - 1, {})


@pytest.mark.parametrize("durable", [True, False])
def test_a_durable_memory_is_still_durable_once_it_has_its_number(path: Path, durable: bool) -> None:
    """SQLite's `synchronous` (sqlite.org/pragma.html): 2 is FULL, each write is on the disk; 1 is NORMAL."""
    opened: list[sqlite3.Connection] = []

    def note(path: Path) -> sqlite3.Connection:
        opened.append(connect(path))
        return opened[-1]

    with closing(Store(path, note, durable=durable)) as store:
        for number in (1, 2):
            assert opened[-1].execute("PRAGMA synchronous").fetchone() == (2 if durable else 1,)
            store.mark(number)
        assert opened[-1].execute("PRAGMA synchronous").fetchone() == (2 if durable else 1,)


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


def test_closing_twice_is_harmless(store: Store) -> None:
    store.close()  # and again at the end


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


def test_a_time_that_no_date_has_is_as_good_as_none(path: Path, store: Store) -> None:
    """`hvcpctl transcript` ended in a traceback."""
    for ago_s in (-1e12, 4e10, 0.0):
        store.append_transcript(HEARD, ago_s)
    with closing(TranscriptReader(path)) as reader:
        assert [row.wall_s is None for row in reader.rows()] == [True, True, False]


def test_no_transcript_where_there_is_no_memory(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="--memory"):
        TranscriptReader(tmp_path / "nobody.sqlite3")
    (tmp_path / "other").write_text("no database at all, but long enough to be taken for one")
    with pytest.raises(StoreError, match="this is no robot's memory"):
        TranscriptReader(tmp_path / "other").rows()
    with pytest.raises(StoreError, match=r"it cannot be read \(disk I/O error\); check its disk"):
        TranscriptReader(Path("/proc/self/mem"))  # whose first page is not there: a traceback


def test_a_memory_that_was_cut_short_is_told_as_damaged(path: Path) -> None:
    """The advice was to start the daemon "to update it"."""
    with closing(Store(path)) as store:
        for _ in range(20):
            store.append_transcript(HEARD)
    with path.open("r+b") as file:
        file.truncate(2000)
    with pytest.raises(StoreError, match=r"it is damaged \(.*\); when the daemon starts, it sets it aside"):
        TranscriptReader(path).rows()


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
    assert [peer.name for peer in store.peers()] == ["Bot", "Max", "rob"]


def test_a_team_that_was_once_named_is_kept(store: Store) -> None:
    """After a restart a robot has said its name, and not yet its team."""
    for name, team in (("Bot", "plant"), ("bot", None), ("Max", None)):
        store.save_peer(PeerRecord(name, team, 1.0))
    assert [(peer.name, peer.team) for peer in store.peers()] == [("bot", "plant"), ("Max", None)]


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
