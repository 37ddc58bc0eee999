"""The file of the control socket: permissions, what is left of dead daemons, and two of one name."""

from __future__ import annotations

import os
import socket
import stat
import sys
from pathlib import Path
from subprocess import PIPE, Popen

import pytest

from hvcpd.config.settings import ControlSettings, Settings
from hvcpd.daemon.control_socket import SYSTEM_FOLDER, SocketFile, caller_of, runtime_file, short_address, socket_path
from hvcpd.errors import EX_UNAVAILABLE, RunningError


def connected(path: Path) -> socket.socket:
    client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    with short_address(path) as address:
        client.connect(address)
    return client


def test_owner_and_group_may_connect_and_nobody_else(tmp_path: Path) -> None:
    file = SocketFile(tmp_path / "rob.sock", "Rob")
    listener = file.listen()
    assert stat.S_IMODE((tmp_path / "rob.sock").stat().st_mode) == 0o660
    client = connected(tmp_path / "rob.sock")
    served, _ = listener.accept()
    assert caller_of(served).pid == os.getpid()
    assert (caller_of(served).uid, caller_of(served).gid) == (os.getuid(), os.getgid())
    for each in (client, served, listener):
        each.close()
    file.remove()
    assert not (tmp_path / "rob.sock").exists()


def test_a_second_daemon_of_the_name_is_refused_until_the_first_has_ended(tmp_path: Path) -> None:
    first, second = SocketFile(tmp_path / "rob.sock", "Rob"), SocketFile(tmp_path / "rob.sock", "Rob")
    listener = first.listen()
    with pytest.raises(RunningError, match="already runs on this computer") as error:
        second.listen()
    assert error.value.exit_status == EX_UNAVAILABLE
    second.remove()
    connected(tmp_path / "rob.sock").close()
    listener.close()
    first.remove()
    second.listen().close()
    second.remove()


def test_another_robot_with_the_same_socket_is_named(tmp_path: Path) -> None:
    """It was "a robot of this name"."""
    first, second = SocketFile(tmp_path / "team.sock", "Rob"), SocketFile(tmp_path / "team.sock", "Bot")
    listener = first.listen()
    with pytest.raises(RunningError) as error:
        second.listen()
    path = tmp_path / "team.sock"
    assert str(error.value) == (
        f"Rob already has the control socket {path}; give each robot its own `control.socket`, or none"
    )
    listener.close()
    first.remove()
    second.listen().close()
    with pytest.raises(RunningError, match="Bot already has"):
        first.listen()
    second.remove()


def test_what_a_killed_daemon_left_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "rob.sock"
    listens = f"SocketFile(Path({str(path)!r}), 'Rob').listen()"
    code = f"from hvcpd.daemon.control_socket import *; {listens}; print(1, flush=True)"
    with Popen(
        [sys.executable, "-c", code + "; import sys; sys.stdin.read()"], stdin=PIPE, stdout=PIPE, text=True
    ) as first:
        assert first.stdout is not None
        first.stdout.readline()
        first.kill()
    assert path.exists()
    with pytest.raises(ConnectionRefusedError):
        connected(path)
    file = SocketFile(path, "Rob")
    listener = file.listen()
    connected(path).close()
    listener.close()
    file.remove()


def test_something_else_of_that_name_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "rob.sock"
    path.write_text("precious")
    file = SocketFile(path, "Rob")
    with pytest.raises(OSError, match="not a socket is in its place"):
        file.listen()
    file.remove()
    assert path.read_text() == "precious"


def test_a_lock_that_leads_elsewhere_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "rob.sock.lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OSError, match=r"rob\.sock\.lock"):
        SocketFile(tmp_path / "rob.sock", "Rob").listen()
    assert not (tmp_path / "elsewhere").exists()


def test_a_long_path_is_no_trouble(tmp_path: Path) -> None:
    path = tmp_path / ("d" * 100) / ("e" * 100) / "rob.sock"
    file = SocketFile(path, "Rob")
    listener = file.listen()
    connected(path).close()
    listener.close()
    file.remove()


def test_each_robot_has_its_own_files_beside_its_socket(tmp_path: Path) -> None:
    """Rob began where Bot stood, for both kept their pose in team.pose."""
    sockets = [tmp_path / name for name in ("team.rob", "team.bot", "rob.sock", "bot.sock", "plain")]
    found = [runtime_file(Settings(name="Rob", control=ControlSettings(socket=each)), ".pose").name for each in sockets]
    assert found == ["team.rob.pose", "team.bot.pose", "rob.pose", "bot.pose", "plain.pose"]


def test_the_usual_places(tmp_path: Path) -> None:
    state, run = tmp_path / "state", tmp_path / "run"
    settings = Settings(name="Rob", state_dir=state)
    run.mkdir()
    assert socket_path(settings, {"RUNTIME_DIRECTORY": f"{run}:/other"}) == run / "rob.sock"
    usable = SYSTEM_FOLDER.is_dir() and os.access(SYSTEM_FOLDER, os.W_OK)
    assert socket_path(settings, {}) == (SYSTEM_FOLDER if usable else state) / "rob.sock"
    own = Settings(name="Rob", control=ControlSettings(socket=tmp_path / "own"))
    assert socket_path(own, {"RUNTIME_DIRECTORY": str(run)}) == tmp_path / "own"
