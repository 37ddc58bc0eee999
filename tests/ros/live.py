"""A daemon that is only its control socket, and the real `hvcpctl ros` as a process beside it."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from hil_fakes.sound_server import wait_until
from tests.e2e.ros_robot import END_WITH_PARENT
from tests.ros.talk import STATUS

END_S = 30.0
BRIDGE = (sys.executable, "-m", "hvcpd.control.cli", "ros")


class SocketDaemon:
    """Answers as a daemon with wheels of this `driver`. `tell` sends a line to all, and `first` has those that each
    client is sent at once; `asked` has what they wanted."""

    def __init__(self, path: Path, mode: str, driver: str) -> None:
        self.path = path
        self.asked: list[dict[str, Any]] = []
        self.first: list[object] = []
        self.settings: list[dict[str, Any]] = [
            {"key": "wheels.driver", "value": driver},
            {"key": "wheels.ros_mode", "value": mode},
        ]
        self._replies: dict[str, Any] = {
            "config": {"settings": self.settings},
            "status": STATUS,
            "tasks": {"now_s": 0.0, "tasks": [{"number": 1, "state": "open"}]},
        }
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(str(path))
        self._listener.listen()
        self._clients: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def tell(self, line: object) -> None:
        """Send an event, or any other line, to everybody."""
        for client in self._clients:
            with suppress(OSError):
                client.sendall(_line(line))

    def hang_up(self) -> None:
        """Let go of everybody."""
        for client in self._clients:
            client.shutdown(socket.SHUT_RDWR)
        self._clients.clear()

    def arguments(self, command: str) -> list[dict[str, Any]]:
        """What was asked with this command."""
        return [each for each in list(self.asked) if each["command"] == command]

    def close(self) -> None:
        self._listener.close()
        for client in self._clients:
            client.close()

    def _accept(self) -> None:
        with suppress(OSError):  # closed
            while True:
                client, _ = self._listener.accept()
                self._clients.append(client)
                threading.Thread(target=self._serve, args=(client,), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        with suppress(OSError, ValueError), client.makefile("r") as lines:
            for line in ({"event": "hello", "protocol": 1, "name": "Rob", "version": "1"}, *self.first):
                client.sendall(_line(line))
            for line in lines:
                request = json.loads(line)
                self.asked.append(request)
                reply = {"id": request.get("id"), "ok": True, "result": self._replies.get(request["command"], {})}
                client.sendall(_line(reply))


def _line(value: object) -> bytes:
    """A value in JSON; text as it is."""
    return (value if isinstance(value, str) else json.dumps(value)).encode() + b"\n"


@contextmanager
def daemon_at(path: Path, mode: str, driver: str = "ros") -> Iterator[SocketDaemon]:
    """Such a daemon, for a while."""
    daemon = SocketDaemon(path, mode, driver)
    try:
        yield daemon
    finally:
        daemon.close()


@contextmanager
def bridge_to(
    daemon: SocketDaemon, environment: Mapping[str, str], command: Sequence[str]
) -> Iterator[subprocess.Popen[bytes]]:
    """The bridge beside that daemon, started by this command; it has subscribed when the context begins."""
    with daemon.path.with_suffix(".log").open("ab") as log:
        process = subprocess.Popen(
            [*END_WITH_PARENT, *command], env={**os.environ, **environment}, stdout=log, stderr=log
        )
    try:
        wait_until(lambda: bool(daemon.arguments("subscribe")), END_S, "the bridge follows the daemon")
        yield process
    finally:
        process.terminate()
        process.wait(END_S)


@contextmanager
def running(command: Sequence[str], environment: Mapping[str, str], log: Path) -> Iterator[subprocess.Popen[str]]:
    """A process that is spoken to by its standard input, and ends with it."""
    with log.open("ab") as errors:
        process = subprocess.Popen(
            command, env={**os.environ, **environment}, stdin=subprocess.PIPE, stderr=errors, text=True
        )
    try:
        yield process
    finally:
        process.communicate(timeout=END_S)
