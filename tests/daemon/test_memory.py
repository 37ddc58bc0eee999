"""A stop outlives everything but the whole folder; who has lost its memory starts stopped."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from structlog.testing import capture_logs

from hvcpd.errors import NewerStoreError, StoreError
from hvcpd.memory.latch import Latched, Permit, StopLatch, latched_of
from hvcpd.memory.opening import Memory, MemoryFiles, open_memory
from hvcpd.memory.store import Store, TaskRecord
from hvcpd.memory.store_file import SCHEMA_VERSION
from tests.full_disk import no_new_bytes

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


def test_a_stop_on_a_full_disk_is_kept_all_the_same(robot: Robot) -> None:
    with robot.life(ends=False) as (memory, latch), no_new_bytes():
        with pytest.raises(StoreError):
            memory.store.save_task(TASK)
        stop(memory, latch)
    assert robot.starts().stopped


def a_link(latch: Path) -> None:
    latch.with_name("precious").write_text("precious")
    latch.symlink_to("precious")


@pytest.mark.parametrize("other", [os.mkfifo, a_link])
def test_a_stop_on_a_full_disk_neither_waits_for_a_pipe_in_the_place_of_the_latch_nor_cuts_what_a_link_names(
    robot: Robot, other: Callable[[Path], None]
) -> None:
    robot.lives()
    robot.files.latch.unlink()
    other(robot.files.latch)
    latch = StopLatch(robot.files.latch, robot.spares)
    writing = threading.Thread(target=latch.write, args=(Latched(Permit.STOPPED),), daemon=True)
    with no_new_bytes():
        writing.start()
        writing.join(10.0)
    assert not writing.is_alive()
    assert all(file.read_text() == "precious" for file in robot.files.latch.parent.glob("precious"))
    assert robot.starts().stopped


def test_a_start_on_a_full_disk_is_stopped_and_says_why(robot: Robot) -> None:
    robot.lives()
    with no_new_bytes():
        memory = robot.starts()
    assert memory.stopped
    assert memory.failing is not None or memory.fault is not None
    assert robot.starts().stopped


@pytest.mark.parametrize("comes_back", [False, True])
def test_a_folder_that_was_moved_away_under_the_robot(robot: Robot, comes_back: bool) -> None:
    folder = robot.files.tasks.parent
    with robot.life() as (memory, latch):
        folder.rename(folder.with_name("moved"))
        with pytest.raises(StoreError):
            memory.store.save_task(TASK)
        stop(memory, latch)
    if comes_back:
        shutil.rmtree(folder)
        folder.with_name("moved").rename(folder)
    assert robot.starts().stopped
    assert robot.starts().stopped


def test_a_folder_that_was_emptied_under_the_robot(robot: Robot) -> None:
    with robot.life(ends=False) as (memory, latch):
        for file in robot.files.tasks.parent.iterdir():
            file.unlink()
        stop(memory, latch)
    memory = robot.starts()
    assert memory.stopped
    assert memory.loss is not None


def test_a_file_in_the_place_of_the_folder(robot: Robot) -> None:
    folder = robot.files.tasks.parent
    with robot.life() as (memory, latch):
        folder.rename(folder.with_name("moved"))
        folder.write_text("in the way")
        with pytest.raises(StoreError, match=r"only in .*run\.stopped"):
            stop(memory, latch)
    folder.unlink()
    assert robot.starts().stopped


@pytest.fixture
def frozen() -> Iterator[Callable[[Path], None]]:
    """Makes a folder and all in it immutable (chattr(1)): a file system that has become read-only looks so."""
    folders: list[Path] = []

    def attribute(change: str, folder: Path) -> bool:
        command = ["chattr", change, str(folder), *map(str, folder.iterdir())]
        return subprocess.run(command, stderr=subprocess.DEVNULL, check=False).returncode == 0

    def freeze(folder: Path) -> None:
        folders.append(folder)
        if not attribute("+i", folder):
            pytest.skip("only the superuser can make files immutable, and not on every file system")

    yield freeze
    for folder in folders:
        attribute("-i", folder)


def thawed(folder: Path) -> None:
    subprocess.run(["chattr", "-i", str(folder), *map(str, folder.iterdir())], check=True)


def test_a_stop_that_its_disk_does_not_take_is_kept_elsewhere_and_told(
    robot: Robot, frozen: Callable[[Path], None]
) -> None:
    robot.lives()
    folder = robot.files.tasks.parent
    with robot.life() as (memory, latch):
        frozen(folder)
        with pytest.raises(StoreError, match=r"only in .*run\.stopped"):
            stop(memory, latch)
        robot.spares[0].unlink()
        robot.spares[0].mkdir()
        with pytest.raises(StoreError, match=r"only in .*tmp\.stopped"):
            stop(memory, latch)
        thawed(folder)
    with robot.life() as (memory, latch):
        assert memory.stopped
        latch.write(Latched(Permit.FREE, memory.latched.memory))
    assert not robot.starts().stopped
    assert not robot.spares[1].exists()


def test_a_start_whose_disk_takes_nothing_is_stopped(robot: Robot, frozen: Callable[[Path], None]) -> None:
    robot.lives(ends=True)
    folder = robot.files.tasks.parent
    frozen(folder)
    memory = robot.starts()
    assert memory.stopped
    assert memory.loss is not None
    thawed(folder)
    assert robot.starts().stopped, "it may have been stopped again meanwhile"


def test_what_others_have_put_in_the_spare_places_stops_nobody(robot: Robot) -> None:
    robot.lives()
    robot.spares[0].symlink_to(robot.files.tasks)
    robot.spares[1].mkdir()
    assert not robot.starts().stopped
