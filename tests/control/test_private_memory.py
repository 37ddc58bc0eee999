"""Commands of a user who may not look into the robot's memory, as most users of a robot's computer may not."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from hvcpd.errors import EX_OK, EX_USER
from hvcpd.memory.store import Store
from tests.control.obliging import obliging_robot
from tests.permissions import bound, needs_permissions

pytestmark = [pytest.mark.slow, needs_permissions]


@pytest.fixture
def config(tmp_path: Path) -> Iterator[Path]:
    """Settings whose memory is another user's."""
    path, state = tmp_path / "hvcpd.yaml", tmp_path / "state"
    path.write_text(f"name: Rob\nstate_dir: {state}\nwheels: {{driver: none}}\n")
    (state / "people").mkdir(parents=True)
    state.chmod(0)
    yield path
    state.chmod(0o700)


@pytest.mark.parametrize("command", ["phrases", "say stop -o x.wav", "check-vocabulary"])
def test_what_needs_no_memory_works_without(command: str, config: Path) -> None:
    """Each said that the folder of enrolled people "cannot be written; send it elsewhere"."""
    words = [str(config.parent / word) if word == "x.wav" else word for word in command.split()]
    ended = bound("-m", "hvcpd.control.cli", *words, "--config", config)
    assert (ended.returncode, ended.stderr) == (EX_OK, "")


@pytest.mark.parametrize("command", ["transcript", "report", "audit", "enrol --list", "enrol Anna --remove"])
def test_what_needs_it_says_that_it_is_not_allowed(command: str, config: Path) -> None:
    ended = bound("-m", "hvcpd.control.cli", *command.split(), "--config", config)
    assert (ended.returncode, ended.stdout) == (EX_USER, "")
    assert "Permission denied" in ended.stderr
    assert "with sudo" in ended.stderr or "use sudo" in ended.stderr or "daemon's user" in ended.stderr
    assert "written" not in ended.stderr


@pytest.mark.parametrize("closed", ["rob.sqlite3", "."])
def test_a_memory_or_a_folder_that_may_not_be_used_is_told(closed: str, tmp_path: Path) -> None:
    """A private file in an open folder ended in a traceback; of a card that is mounted read-only the advice was to
    start the daemon "to update it"."""
    memory = tmp_path / "rob.sqlite3"
    Store(memory).close()
    (tmp_path / closed).chmod(0o555 if closed == "." else 0)
    ended = bound("-m", "hvcpd.control.cli", "transcript", "--memory", memory)
    (tmp_path / closed).chmod(0o700)
    assert (ended.returncode, ended.stdout) == (EX_USER, "")
    assert f"hvcpctl: {memory}: you may not read it, or not write in its folder, as SQLite has to; use" in ended.stderr


@pytest.mark.parametrize("command", ["stop", "status"])
def test_who_may_not_look_for_a_robot_is_not_told_that_none_runs(command: str, config: Path) -> None:
    """Who had not yet joined the group was told to start the robot that was to be stopped."""
    config.write_text(f"state_dir: {config.parent / 'state'}\n")
    ended = bound("-m", "hvcpd.control.cli", command, "--config", config)
    assert (ended.returncode, ended.stdout) == (4, "")
    assert f"no permission to ask the daemon at {config.parent}/state/*.sock; `sudo usermod -aG " in ended.stderr


def test_a_robot_that_may_not_be_asked_keeps_no_other_from_stopping(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody was stopped: "bot.sock: Permission denied; check its name"."""
    (tmp_path / "of others").mkdir()
    settings = tmp_path / "system.yaml"
    settings.write_text("name: Bot\nstate_dir: .\ncontrol: {socket: of others/bot.sock}\n")
    (tmp_path / "of others").chmod(0)
    with obliging_robot(tmp_path) as environment:
        for name, value in (environment | {"HVCPD_CONFIG": str(settings)}).items():
            monkeypatch.setenv(name, value)
        ended = bound("-m", "hvcpd.control.cli", "stop")
    (tmp_path / "of others").chmod(0o700)
    assert (ended.returncode, ended.stdout.startswith("Rob stands still")) == (1, True)
    assert f"no permission to ask the daemon at {tmp_path}/of others/bot.sock" in ended.stderr


def test_the_check_of_a_robot_says_so_too(config: Path) -> None:
    """It ended with a traceback."""
    ended = bound("-m", "hvcpd.cli", "--check", "--config", config)
    assert "Traceback" not in ended.stderr
    assert f"hvcpd: state_dir: {config.parent}/state cannot be written; make it, writable" in ended.stderr
    assert f"hvcpd: warning: {config.parent}/state/people: cannot be read (Permission denied)" in ended.stderr


def test_settings_that_may_not_be_read_are_told(tmp_path: Path) -> None:
    """The folder of the settings may be private, for the key is in it."""
    (tmp_path / "etc").mkdir()
    (tmp_path / "etc").chmod(0)
    code = f"from hvcpd.config.settings_file import *; load_settings(system_path=Path('{tmp_path}/etc/hvcpd.yaml'))"
    ended = bound("-c", code)
    (tmp_path / "etc").chmod(0o700)
    assert "ConfigError" in ended.stderr
    assert "no permission to read it" in ended.stderr
