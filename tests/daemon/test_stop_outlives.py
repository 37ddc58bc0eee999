"""The daemon as a real process: a stop outlives kill -9, a full disk and a lost memory; plain kills stop nobody."""

from __future__ import annotations

import json
import os
import resource
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest

from hvcpd.control.cli import main
from hvcpd.errors import EX_CONFIG, EX_FAILURE, EX_OK
from hvcpd.memory.store_file import SCHEMA_VERSION
from tests.full_disk import NO_BYTECODE

pytestmark = pytest.mark.slow

LOST = "Hi all, I am Rob, I have lost my memory, I have stopped"


class Process:
    """A life of `hvcpd`: real but for the sound card, in whose place is a quiet room."""

    def __init__(self, folder: Path) -> None:
        self._config = folder / "hvcpd.yaml"
        command = [sys.executable, "-m", "tests.daemon.quiet_robot", "--config", str(self._config)]
        self._process = subprocess.Popen(
            [*command, "--log-format", "json"],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=os.environ | NO_BYTECODE,
        )
        self.log: list[dict[str, Any]] = []

    def until(self, event: str, **more: object) -> dict[str, Any]:
        """The next line of the log that tells of this event."""
        assert self._process.stdout is not None
        for line in self._process.stdout:
            told = json.loads(line) if line.startswith("{") else {"event": line}
            self.log.append(told)
            if told["event"] == event and told.items() >= more.items():
                return told
        raise AssertionError([line["event"] for line in self.log])

    def status(self, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
        capsys.readouterr()
        assert main(["status", "--json", "--config", str(self._config)]) == EX_OK
        return dict(json.loads(capsys.readouterr().out))

    def ask(self, *command: str) -> int:
        """The exit status of `hvcpctl COMMAND`."""
        return main([*command, "--config", str(self._config)])

    def limit_files(self, n_bytes: int) -> None:
        """No file of it can grow beyond that, as on a full disk."""
        resource.prlimit(self._process.pid, resource.RLIMIT_FSIZE, (n_bytes, resource.RLIM_INFINITY))

    def kill(self) -> None:
        self._process.send_signal(signal.SIGKILL)
        if self._process.stdout is not None and not self._process.stdout.closed:
            self._process.communicate()

    def exit_status(self) -> int:
        self._process.communicate()
        return self._process.returncode


@pytest.fixture
def folder(tmp_path: Path, units: Path, compared: Path) -> Path:
    (tmp_path / "state").mkdir()
    (tmp_path / "state" / "units").symlink_to(units)
    (tmp_path / "state" / "vocabulary").symlink_to(compared)
    config = f"state_dir: state\nwheels: {{driver: none}}\ncontrol: {{socket: {tmp_path / 'rob.sock'}}}\nseed: 1\n"
    (tmp_path / "hvcpd.yaml").write_text(f"name: Rob\nmode: follow\n{config}")
    return tmp_path


@contextmanager
def life(folder: Path) -> Iterator[Process]:
    """From a start until it is killed."""
    process = Process(folder)
    try:
        process.until("listening")
        yield process
    finally:
        process.kill()


def test_a_stop_outlives_kill_9_and_a_full_disk_and_is_kept_until_resume(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for _ in range(2):
        with life(folder) as first:
            assert first.status(capsys)["stopped"] is False, "a kill without a stop stops nobody"
    with life(folder) as second:
        second.limit_files(0)
        assert second.ask("stop") == EX_OK
        assert second.ask("task", "skip", "1") == EX_OK, "a change of a task is written to the memory at once"
        assert second.until("memory failed")["reason"]
        assert second.status(capsys)["memory"]["fault"] is not None
        assert second.ask("resume") == EX_FAILURE
        assert "takes on tasks, but the next start will be stopped: the memory" in capsys.readouterr().err
    with life(folder) as third:
        assert third.status(capsys)["stopped"] is True
        assert third.ask("resume") == EX_OK
        assert third.ask("stop") == EX_OK
        assert third.ask("resume") == EX_OK
        third.until("asked to", command="resume")
        third.status(capsys)
    with life(folder) as fourth:
        assert fourth.status(capsys)["stopped"] is False


def test_a_memory_that_is_cut_while_the_robot_runs_is_told_and_the_next_start_is_stopped_and_says_so(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    memory = folder / "state" / "rob.sqlite3"
    with life(folder) as first:
        os.truncate(memory, 0)
        first.until("memory failed")
        assert "cut short" in first.status(capsys)["memory"]["fault"]
    with life(folder) as second:
        assert [line["starts"] for line in second.log if line["event"] == "memory lost"] == ["stopped"]
        assert second.until("said")["text"] == LOST
        assert second.status(capsys)["stopped"] is True
    with closing(sqlite3.connect(memory)) as db:
        db.execute(f"PRAGMA user_version = {SCHEMA_VERSION + 1}")
    newer = Process(folder)
    assert "install that hvcpd again" in newer.until("failed")["reason"]
    assert newer.exit_status() == EX_CONFIG
    assert not list(memory.parent.glob("*.corrupt-*"))


@contextmanager
def immutable(*files: str) -> Iterator[None]:
    """Nobody can change these meanwhile."""
    if subprocess.run(["chattr", "+i", *files], stderr=subprocess.DEVNULL, check=False).returncode:
        subprocess.run(["chattr", "-i", *files], stderr=subprocess.DEVNULL, check=False)
        pytest.skip("only the superuser can make files immutable, and not on every file system")
    try:
        yield
    finally:
        subprocess.run(["chattr", "-i", *files], check=True)


def test_a_stop_that_cannot_be_kept_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    state = folder / "state"
    with life(folder) as first, immutable(str(state), str(state / "rob.latch"), str(state / "rob.sqlite3")):
        assert first.ask("stop") == EX_FAILURE
        assert "Rob stands still, but after a loss of power the robot may go on: " in capsys.readouterr().err
        assert first.until("stop not kept")["reason"]
        status = first.status(capsys)
        assert status["stopped"] is True
        assert status["memory"]["unkept"] is not None
        first.kill()
    with life(folder) as second:
        assert second.status(capsys)["stopped"] is True
        assert second.ask("resume") == EX_OK


def test_a_resume_that_cannot_be_kept_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It said that the robot takes on tasks again, and at the next start the robot stood still."""
    state = folder / "state"
    with life(folder) as first:
        assert first.ask("stop") == EX_OK
        with immutable(str(state), str(state / "rob.latch"), str(state / "rob.sqlite3")):
            assert first.ask("resume") == EX_FAILURE
            assert "Rob takes on tasks, but the next start will be stopped: " in capsys.readouterr().err
            first.kill()
