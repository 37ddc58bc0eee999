"""There is always room for a stop, whatever other programs do to the control socket."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from hvcpd.control.cli import main
from hvcpd.control.live import daemon_client
from hvcpd.control.live.daemon_client import DaemonClient
from hvcpd.daemon.control_lobby import MAX_WAITING
from hvcpd.daemon.control_server import MAX_CLIENTS, STOP_PLACES
from hvcpd.errors import EX_NOT_RUNNING
from tests.daemon.running import RunningRobot

STORM = """
import socket, sys, threading
path, kind = sys.argv[1:]

def connected():
    client = socket.socket(socket.AF_UNIX)
    client.setblocking(kind != "impatient")
    client.connect(path)
    return client

def never_ending(client, line):
    client.setblocking(False)
    while True:
        client.send(line)

def storm():
    held = []
    while True:
        try:
            client = connected()
            if kind != "leave":
                held = [*held[-99:], client]
            if kind == "half":
                client.send(b'{"command": "st')
            elif kind == "endless":
                never_ending(client, b"x" * 4096)
            elif kind == "deaf":
                never_ending(client, b'{"command": "status"}\\n')
            elif kind == "ask":
                client.sendall(b'{"command": "status"}\\n')
        except OSError:
            continue

for _ in range(8):
    threading.Thread(target=storm, daemon=True).start()
print("on", flush=True)
sys.stdin.read()
"""
KINDS = ("hold", "leave", "half", "endless", "deaf", "ask", "impatient")
STOPS, OF_EACH = 12, 4
"""In a storm of all kinds, and of one kind alone."""


@contextmanager
def storm(path: Path, *kinds: str) -> Iterator[None]:
    """One process of eight threads for each kind."""
    command = [sys.executable, "-c", STORM, str(path)]
    pipe = subprocess.PIPE
    processes = [subprocess.Popen([*command, kind], stdin=pipe, stdout=pipe, text=True) for kind in kinds]
    try:
        for process in processes:
            assert process.stdout is not None
            assert process.stdout.readline() == "on\n"
        yield
    finally:
        for process in processes:
            process.kill()
            process.communicate()


@pytest.mark.slow
@pytest.mark.parametrize("kinds", [*((kind,) for kind in KINDS), KINDS], ids=" and ".join)
def test_every_stop_in_a_storm_is_answered(kinds: tuple[str, ...], tmp_path: Path) -> None:
    with RunningRobot(tmp_path) as robot, storm(robot.bench.path, *kinds):
        before = len([*Path("/proc/self/fd").iterdir()])
        for number in range(STOPS if len(kinds) > 1 else OF_EACH):
            with closing(DaemonClient(robot.bench.path)) as client:
                result = client.ask("stop")
                assert (result["stopped"], result["kept"]) == (True, True)
                assert result["before"] is (number > 0)
            assert len([*Path("/proc/self/fd").iterdir()]) <= before + MAX_WAITING + MAX_CLIENTS + STOP_PLACES + 20


def test_a_daemon_that_is_too_busy_is_told_from_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rob.sock"
    with socket.socket(socket.AF_UNIX) as listener, socket.socket(socket.AF_UNIX) as first:
        listener.bind(str(path))
        listener.listen(0)
        first.connect(str(path))
        with socket.socket(socket.AF_UNIX) as late, pytest.raises(BlockingIOError):
            daemon_client.connect_in_turn(late, str(path), patience_s=0.02)
        waiting = threading.Thread(target=lambda: listener.accept()[0].close())
        waiting.start()
        with socket.socket(socket.AF_UNIX) as patient:
            daemon_client.connect_in_turn(patient, str(path))  # as soon as there is room
        waiting.join()
    assert main(["stop", "--socket", str(path)]) == EX_NOT_RUNNING
    assert "no daemon answers" in capsys.readouterr().err
