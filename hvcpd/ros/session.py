"""The bridge's loop: one thread takes what comes from the daemon and from ROS, and lets time pass."""

from __future__ import annotations

import select
import socket
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from hvcpd.errors import NotRunningError
from hvcpd.ros.bridge import Ask, Bridge, Log, Publish
from hvcpd.ros.driving import Cancel, Go
from hvcpd.ros.link import DaemonLink
from hvcpd.ros.port import Happening, RosPort
from hvcpd.ros.skills import Act, Leave

TICK_S = 0.02
"""Longest wait; twice as often as commands are due."""
RETRY_S = 1.0
"""Between two tries to reach a daemon that has ended."""
MAX_WAITING = 1000
"""Happenings that wait for their turn; beyond, the oldest go: 10 s of odometry at 100 Hz."""
FAREWELL_S = 0.2
"""For what was published last to leave the process."""


class Inbox:
    """Events from other threads, for the loop's thread."""

    def __init__(self) -> None:
        self._waiting: deque[Happening] = deque(maxlen=MAX_WAITING)
        self._ours, self._theirs = socket.socketpair()
        self._ours.setblocking(False)
        self._theirs.setblocking(False)

    def put(self, happening: Happening) -> None:
        """From any thread."""
        self._waiting.append(happening)
        with suppress(OSError):  # full: the loop wakes anyway; closed: nobody waits any more
            self._theirs.send(b"!")

    def fileno(self) -> int:
        """For `select`: readable when something waits."""
        return self._ours.fileno()

    def take(self) -> list[Happening]:
        """All that waits."""
        with suppress(BlockingIOError):
            self._ours.recv(MAX_WAITING)
        return [self._waiting.popleft() for _ in range(len(self._waiting))]

    def close(self) -> None:
        """Nothing is taken any more."""
        self._ours.close()
        self._theirs.close()


class Session:
    """Holds the bridge between a daemon's socket at `path` and the ROS of `port`."""

    def __init__(self, bridge: Bridge, port: RosPort, inbox: Inbox, path: Path) -> None:
        self._bridge = bridge
        self._port = port
        self._inbox = inbox
        self._path = path
        self._link: DaemonLink | None = None
        self._tried_s: float | None = None

    def run(self, is_over: Callable[[], bool] = lambda: False) -> str | None:
        """Live until `is_over`, or until this ROS is no more: then why."""
        try:
            while not is_over():
                if self._port.fault is not None:
                    self._bridge.master_lost(self._port.fault, time.monotonic())
                    self._pass_on()
                    return self._port.fault
                self._step()
            return None
        finally:
            self._farewell()

    def _step(self) -> None:
        if self._link is None:
            self._connect()
        waits: list[Inbox | DaemonLink] = [self._inbox]
        if self._link is not None:
            waits.append(self._link)
        ready, _, _ = select.select(waits, [], [], TICK_S)
        now_s = time.monotonic()
        if self._link is not None and self._link in ready:
            self._read(self._link, now_s)
        for happening in self._inbox.take():
            happening(self._bridge, now_s)
        self._port.tick(now_s)
        self._bridge.tick(now_s, self._port.stamp_s())
        self._pass_on()

    def _connect(self) -> None:
        now_s = time.monotonic()
        if self._tried_s is not None and now_s - self._tried_s < RETRY_S:
            return
        self._tried_s = now_s
        with suppress(NotRunningError):
            self._link = DaemonLink(self._path)
            self._bridge.begin(now_s)
            self._pass_on()

    def _read(self, link: DaemonLink, now_s: float) -> None:
        try:
            lines = link.lines()
        except NotRunningError as error:
            self._lose(error)
            return
        for line in lines:
            self._bridge.from_daemon(line, now_s, self._port.stamp_s())

    def _lose(self, error: NotRunningError) -> None:
        if self._link is not None:
            self._link.close()
            self._link = None
            self._port.log(f"{error}; trying again")
            self._bridge.lost(time.monotonic())

    def _pass_on(self) -> None:
        for output in self._bridge.outputs():
            match output:
                case Publish(topic, message):
                    self._port.publish(topic, message)
                case Ask(mark, command, arguments):
                    self._ask(mark, command, arguments)
                case Go(goal):
                    self._port.go(goal, time.monotonic())
                case Cancel(number):
                    self._port.cancel(number)
                case Act():
                    self._port.act(output, time.monotonic())
                case Leave():
                    self._port.leave(output)
                case Log(text):
                    self._port.log(text)

    def _ask(self, mark: int, command: str, arguments: Mapping[str, Any]) -> None:
        if self._link is None:
            return
        try:
            self._link.ask(mark, command, arguments)
        except NotRunningError as error:
            self._lose(error)

    def _farewell(self) -> None:
        """Whatever ends the bridge, first command the base to stand."""
        self._bridge.lost(time.monotonic())
        self._pass_on()
        select.select([], [], [], FAREWELL_S)
        if self._link is not None:
            self._link.close()
        self._port.close()
        self._inbox.close()
