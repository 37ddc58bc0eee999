"""The bridge's connection to the daemon: lines both ways, and nothing that waits."""

from __future__ import annotations

import json
import socket
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hvcpd.config.json_objects import json_object
from hvcpd.daemon.control_socket import no_answer, short_address
from hvcpd.errors import NotRunningError

CHUNK = 1 << 16
"""Bytes read at a time; a board of tasks has about 2000."""
PATIENCE_S = 1.0
"""Longest time for the kernel to take a line; a daemon that reads nothing for longer hangs."""


class DaemonLink:
    """A client of the control socket at `path`. Every method raises NotRunningError once the daemon has ended."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._unread = b""
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(PATIENCE_S)
        try:
            with short_address(path) as address:
                self._socket.connect(address)
        except OSError as error:
            self._socket.close()
            raise no_answer(self.path, error) from None

    def fileno(self) -> int:
        """For `select`."""
        return self._socket.fileno()

    def ask(self, mark: int, command: str, arguments: Mapping[str, Any]) -> None:
        """Send a request; the reply comes with this `id`."""
        line = json.dumps({"id": mark, "command": command, **arguments}) + "\n"
        try:
            self._socket.sendall(line.encode())
        except OSError as error:
            raise no_answer(self.path, error) from None

    def lines(self) -> list[dict[str, Any]]:
        """The lines received since the last call; waits for nothing that `select` did not announce."""
        try:
            chunk = self._socket.recv(CHUNK)
        except OSError as error:
            raise no_answer(self.path, error) from None
        if not chunk:
            raise NotRunningError(f"the daemon at {self.path} has ended")
        *whole, self._unread = (self._unread + chunk).split(b"\n")
        return [value for line in whole if (value := json_object(line)) is not None]

    def close(self) -> None:
        """Let go of the connection."""
        self._socket.close()
