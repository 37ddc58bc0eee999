"""Sends every change to all viewers of the page. A viewer that does not keep up misses changes, and delays nobody."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Any

Message = dict[str, Any]

MAX_VIEWERS = 24
"""Most viewers: the phones and screens of a laboratory, with some to spare; each has a connection of its own."""
MAX_WAITING = 256
"""Lines that may wait for one viewer: some twenty minutes of talk."""
REPLACED = frozenset({"robots", "board", "alarms", "level", "moved", "link"})
"""Kinds of messages of which only the newest counts."""


class Viewer:
    """One open page, and the messages that wait for it."""

    def __init__(self) -> None:
        self._waiting: deque[Message] = deque()
        self._newest: dict[tuple[str, str], Message] = {}
        self._wake = asyncio.Event()
        self._overrun = False
        self.ended = False
        """Nothing more will be told."""

    def put(self, message: Message) -> None:
        """Queue a message; of kinds in REPLACED only the newest is kept. Never waits."""
        if message["kind"] in REPLACED:
            self._newest[message["kind"], str(message.get("name", ""))] = message
        elif len(self._waiting) < MAX_WAITING:
            self._waiting.append(message)
        else:
            self._overrun = True
        self._wake.set()

    def renew(self) -> None:
        """Queue a new snapshot."""
        self._overrun = True
        self._wake.set()

    def end(self) -> None:
        """Send what waits, and then end."""
        self.ended = True
        self._wake.set()

    async def take(self, snapshot: Callable[[], Message]) -> list[Message]:
        """All messages that wait, as soon as there are some. After an overrun it is a new `snapshot`."""
        await self._wake.wait()
        self._wake.clear()
        messages = [*self._newest.values(), *self._waiting]
        overrun, self._overrun = self._overrun, False
        self._newest.clear()
        self._waiting.clear()
        return [snapshot()] if overrun else messages


class Viewers:
    """All open pages."""

    def __init__(self) -> None:
        self._viewers: set[Viewer] = set()

    def tell(self, message: Message) -> None:
        """Send a message to all viewers. Never waits."""
        for viewer in self._viewers:
            viewer.put(message)

    def renew(self) -> None:
        """Send a new snapshot to all viewers."""
        for viewer in self._viewers:
            viewer.renew()

    @property
    def full(self) -> bool:
        """Whether as many pages are open as may be."""
        return len(self._viewers) >= MAX_VIEWERS

    def join(self) -> Viewer:
        """Add a viewer."""
        viewer = Viewer()
        self._viewers.add(viewer)
        return viewer

    def end(self) -> None:
        """End all viewers, because the console ends."""
        for viewer in self._viewers:
            viewer.end()

    def leave(self, viewer: Viewer) -> None:
        """The page was closed."""
        self._viewers.discard(viewer)
