"""Notifications to a service manager: when the robot is ready, what it is doing, that it is still alive, that it ends.

The protocol is systemd's sd_notify(3): lines `KEY=value` in one datagram to the AF_UNIX socket that NOTIFY_SOCKET
names; with an `@` in front the name is an abstract one. WATCHDOG_USEC says after how many microseconds without
`WATCHDOG=1` the manager takes the service for dead, and WATCHDOG_PID for which process that holds.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Mapping

BEATS_A_PERIOD = 4
"""Signs of life within one watchdog period: sd_watchdog_enabled(3) advises two; twice that outlives a lost one."""


class ServiceManager:
    """The service manager that started the daemon; without a NOTIFY_SOCKET there is none, and every call does nothing.

    No method blocks, and none raises: a manager that is gone or busy must not harm the robot.
    """

    def __init__(
        self, environment: Mapping[str, str] = os.environ, clock: Callable[[], float] = time.monotonic
    ) -> None:
        name = environment.get("NOTIFY_SOCKET", "")
        self._address = "\0" + name[1:] if name.startswith("@") else name
        self._clock = clock
        self._beat_every_s = _watchdog_s(environment) / BEATS_A_PERIOD
        self._beaten_s: float | None = None
        self._status = ""
        self._socket: socket.socket | None = None
        if self._address:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)

    def ready(self, status: str) -> None:
        """The robot is ready: it hears and speaks."""
        self._status = status
        self._send(f"READY=1\nSTATUS={status}")

    def status(self, text: str) -> None:
        """Set the line that `systemctl status` shows; sent if it differs from the last."""
        if text != self._status:
            self._status = text
            self._send(f"STATUS={text}")

    def beat(self) -> None:
        """A heartbeat: call it whenever work has succeeded; it is sent as often as the watchdog needs it."""
        now_s = self._clock()
        if self._beat_every_s > 0 and (self._beaten_s is None or now_s - self._beaten_s >= self._beat_every_s):
            self._beaten_s = now_s
            self._send("WATCHDOG=1")

    def stopping(self, status: str) -> None:
        """The robot begins to shut down."""
        self._send(f"STOPPING=1\nSTATUS={status}")

    def close(self) -> None:
        """Send nothing more."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _send(self, text: str) -> None:
        if self._socket is None:
            return
        try:
            self._socket.sendto(text.encode(), self._address)
        except OSError:
            return  # the manager restarts or its queue is full; it asks by its watchdog


def _watchdog_s(environment: Mapping[str, str]) -> float:
    """The watchdog's period, s; 0 without one, or if it is meant for another process."""
    period, process = environment.get("WATCHDOG_USEC", ""), environment.get("WATCHDOG_PID", "")
    if not period.isdecimal() or process not in ("", str(os.getpid())):
        return 0.0
    return int(period) / 1e6
