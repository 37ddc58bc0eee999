"""A stop outlives everything but the whole folder; who has lost its memory starts stopped."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.errors import NewerStoreError
from hvcpd.memory.latch import Latched, Permit, StopLatch, latched_of
from hvcpd.memory.store import Store
from hvcpd.memory.store_file import SCHEMA_VERSION
from tests.daemon.lives import TASK, Robot


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return Robot(tmp_path / "state")


def test_a_first_start_and_all_that_follow_without_a_stop_are_free(robot: Robot) -> None:
    for ends in (False, True, False, False):
        assert not robot.starts().stopped
        robot.lives(ends=ends, has_key=True)
    with robot.life(has_key=True) as (memory, _):
        assert (memory.stopped, memory.loss, memory.store.tasks()) == (False, None, (TASK,))
        assert memory.seals is not None
        assert memory.seals.counters() == {"k/bot": 7}


def test_a_first_start_that_was_cut_short_is_one_again(robot: Robot) -> None:
    robot.files.tasks.parent.mkdir()
    with closing(StopLatch(robot.files.latch)) as latch:
        latch.write(Latched(Permit.NEW, 5))
    assert not robot.starts().stopped
    assert not robot.starts().stopped


@pytest.mark.parametrize("ends", [False, True])
def test_a_stop_lasts_until_it_is_ended(robot: Robot, ends: bool) -> None:
    robot.lives(stops=True, ends=ends)
    for _ in range(3):
        memory = robot.starts()
        assert (memory.stopped, memory.loss) == (True, None)
    with robot.life(ends=ends) as (memory, latch):
        latch.write(Latched(Permit.FREE, memory.latched.memory))
    assert not robot.starts().stopped


def gone(path: Path) -> None:
    path.unlink()


def emptied(path: Path) -> None:
    os.truncate(path, 0)


def garbled(path: Path) -> None:
    path.write_bytes(b"no database at all, but long enough to be taken for one" * 100)


def a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def another_robots(path: Path) -> None:
    other = Robot(path.parent.parent / "other")
    other.lives()
    shutil.copy(other.files.tasks, path)


@pytest.mark.parametrize("harm", [gone, emptied, garbled, a_folder, another_robots])
@pytest.mark.parametrize("ends", [False, True])
def test_who_has_lost_its_memory_starts_stopped_until_it_is_released(
    robot: Robot, harm: Callable[[Path], None], ends: bool
) -> None:
    robot.lives(ends=ends)
    for journal in robot.files.tasks.parent.glob("*-wal"):
        journal.unlink()
    harm(robot.files.tasks)
    memory = robot.starts()
    assert memory.stopped
    assert memory.loss is not None
    assert str(robot.files.tasks) in memory.loss
    assert robot.starts().stopped, "nobody has said resume"


@pytest.mark.parametrize("harm", [gone, emptied, garbled, a_folder])
def test_who_has_lost_its_latch_starts_stopped(robot: Robot, harm: Callable[[Path], None]) -> None:
    robot.lives()
    harm(robot.files.latch)
    memory = robot.starts()
    assert memory.stopped
    assert memory.loss is not None
    assert str(robot.files.latch) in memory.loss


def test_where_all_is_wiped_the_robot_is_new_and_where_anything_is_left_it_is_not(robot: Robot) -> None:
    robot.lives(stops=True)
    shutil.rmtree(robot.files.tasks.parent)
    assert not robot.starts().stopped
    robot.files.latch.unlink()
    robot.files.tasks.rename(robot.files.tasks.with_name("rob.sqlite3.corrupt-1"))
    assert robot.starts().stopped


def test_a_memory_from_before_there_were_latches_is_taken_over(robot: Robot) -> None:
    robot.files.tasks.parent.mkdir()
    with closing(Store(robot.files.tasks)) as store:
        store.save_task(TASK)
    assert not robot.starts().stopped
    robot.files.latch.unlink()
    with closing(sqlite3.connect(robot.files.tasks)) as db, db:
        db.execute("DELETE FROM counters")
        db.execute("INSERT INTO flags VALUES ('stopped')")
    memory = robot.starts()
    assert (memory.stopped, memory.loss) == (True, None)


def test_a_newer_memory_is_not_touched_and_nothing_starts(robot: Robot) -> None:
    robot.lives(stops=True, ends=True)
    with closing(sqlite3.connect(robot.files.tasks)) as db:
        db.execute(f"PRAGMA user_version = {SCHEMA_VERSION + 1}")
    before = {file: file.read_bytes() for file in robot.files.tasks.parent.iterdir()}
    with pytest.raises(NewerStoreError):
        robot.starts()
    assert {file: file.read_bytes() for file in robot.files.tasks.parent.iterdir()} == before


Harm = tuple[str, float | bytes | None]
HARMS = st.dictionaries(
    st.sampled_from(["rob.sqlite3", "rob.sqlite3-wal", "rob.sqlite3-shm", "rob.latch", "rob.seals.sqlite3"]),
    st.none() | st.floats(0.0, 1.0) | st.binary(max_size=60),
    max_size=4,
)
"""What becomes of each file: it goes, or it is cut to a share of its bytes, or other bytes are in its place."""


@pytest.fixture(scope="module")
def stopped_robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    robot = Robot(tmp_path_factory.mktemp("stopped") / "state")
    robot.lives(has_key=True)
    robot.lives(stops=True, has_key=True)
    return robot


@given(harms=HARMS, has_key=st.booleans())
def test_a_stop_outlives_whatever_becomes_of_the_files(
    stopped_robot: Robot, harms: dict[str, float | bytes | None], has_key: bool
) -> None:
    kept = stopped_robot.files.tasks.parent
    folder = kept.with_name("harmed")
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(kept, folder)
    for name, harm in harms.items():
        path = folder / name
        if harm is None:
            path.unlink(missing_ok=True)
        elif isinstance(harm, bytes):
            path.write_bytes(harm)
        elif path.exists():
            os.truncate(path, int(harm * path.stat().st_size))
    again = Robot(folder)
    assert again.starts(has_key).stopped
    assert again.starts(has_key).stopped


@given(st.binary(max_size=60) | st.builds(lambda cut: Latched(Permit.FREE, 1 << 40, 3).line[:cut], st.integers(0, 60)))
def test_only_a_whole_line_says_that_the_robot_is_free(line: bytes) -> None:
    found = latched_of(line)
    assert found.permit is not Permit.FREE or found.line == line


@given(st.sampled_from(Permit), st.none() | st.integers(1, 2**62), st.none() | st.integers(1, 2**62))
def test_a_line_says_what_was_written(permit: Permit, memory: int | None, seals: int | None) -> None:
    assert latched_of(Latched(permit, memory, seals).line) == Latched(permit, memory, seals)
