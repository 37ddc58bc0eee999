"""A stop outlives a disk that is full, read-only, emptied or moved away."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from hvcpd.errors import StoreError
from hvcpd.memory.latch import Latched, Permit, StopLatch, spare_places
from tests.daemon.lives import TASK, Robot, stop
from tests.full_disk import no_new_bytes


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return Robot(tmp_path / "state")


def test_a_stop_on_a_full_disk_is_kept_all_the_same(robot: Robot) -> None:
    with robot.life(ends=False) as (memory, latch), no_new_bytes():
        with pytest.raises(StoreError):
            memory.store.save_task(TASK)
        stop(memory, latch)
    assert robot.starts().stopped


def test_what_is_on_a_full_disk_already_needs_no_room(robot: Robot) -> None:
    """A "resume" was kept, and then reported as one that is not."""
    with robot.life() as (memory, latch):
        latch.write(Latched(Permit.FREE, memory.latched.memory))
        with no_new_bytes():
            latch.write(Latched(Permit.FREE, memory.latched.memory))


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


@pytest.mark.parametrize("lives", [0, 1])
def test_a_start_on_a_full_disk_is_stopped_and_says_why_though_nothing_is_lost(robot: Robot, lives: int) -> None:
    """Its log, its status and its voice said that it had lost what it still knew, or had never known."""
    for _ in range(lives):
        robot.lives()
    with no_new_bytes(), robot.life() as (memory, _):
        assert memory.stopped
        assert memory.failing is not None or memory.fault is not None
        assert memory.loss is None
        assert memory.store.tasks() == (TASK,) * lives
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


def test_a_pipe_in_a_spare_place_holds_no_stop_up(robot: Robot) -> None:
    """It waited for a reader, for ever, and so did every later stop."""
    folder = robot.files.tasks.parent
    os.mkfifo(robot.spares[0])
    with robot.life() as (memory, latch):
        folder.rename(folder.with_name("moved"))
        folder.write_text("in the way")
        with pytest.raises(StoreError, match=r"only in .*tmp\.stopped"):
            stop(memory, latch)


def test_a_full_disk_moves_no_place_for_a_stop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where /tmp was on the full disk, too, the robot did not even start."""
    monkeypatch.setattr(tempfile, "tempdir", None)  # Python looks for it once, by writing to it
    monkeypatch.chdir(tmp_path)
    before = spare_places(tmp_path / "rob.latch", tmp_path / "rob.stopped")
    tempfile.tempdir = None
    with no_new_bytes():
        assert spare_places(tmp_path / "rob.latch", tmp_path / "rob.stopped") == before


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
    assert memory.fault is not None or memory.failing is not None
    thawed(folder)
    assert robot.starts().stopped, "it may have been stopped again meanwhile"


def test_what_others_have_put_in_the_spare_places_stops_nobody(robot: Robot) -> None:
    robot.lives()
    robot.spares[0].symlink_to(robot.files.tasks)
    robot.spares[1].mkdir()
    assert not robot.starts().stopped
