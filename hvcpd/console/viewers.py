"""Hands what happens to every viewer of the page. A viewer that does not keep up misses steps, and holds up nobody."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Any

Message = dict[str, Any]

MAX_VIEWERS = 24
"""Phones and screens of a laboratory, with some to spare: each has a connection of its own."""
MAX_WAITING = 256
"""Lines that may wait for one viewer: some twenty minutes of talk."""
REPLACED = frozenset({"robots", "board", "alarms", "level", "moved", "link"})
"""Kinds of messages of which only the newest counts."""


class Viewer:
    """One open page: what it has still to be told."""

    def __init__(self) -> None:
        self._waiting: deque[Message] = deque()
        self._newest: dict[tuple[str, str], Message] = {}
        self._wake = asyncio.Event()
        self._overrun = False
        self.ended = False
        """Nothing more will be told."""

    @property
    def waiting(self) -> int:
        """Number of messages that wait, without those of kinds in REPLACED."""
        return len(self._waiting)

    def put(self, message: Message) -> None:
        """Have it told; of kinds in REPLACED the newest only. Never waits."""
        if message["kind"] in REPLACED:
            self._newest[message["kind"], str(message.get("name", ""))] = message
        elif len(self._waiting) < MAX_WAITING:
            self._waiting.append(message)
        else:
            self._overrun = True
        self._wake.set()

    def renew(self) -> None:
        """Have it shown everything anew."""
        self._overrun = True
        self._wake.set()

    def end(self) -> None:
        """Tell what waits, and then no more."""
        self.ended = True
        self._wake.set()

    async def take(self, snapshot: Callable[[], Message]) -> list[Message]:
        """All that is to be told now; waits until there is something. After an overrun that is a `snapshot` anew."""
        await self._wake.wait()
        self._wake.clear()
        told = [*self._newest.values(), *self._waiting]
        overrun, self._overrun = self._overrun, False
        self._newest.clear()
        self._waiting.clear()
        return [snapshot()] if overrun else told


class Viewers:
    """All open pages."""

    def __init__(self) -> None:
        self._viewers: set[Viewer] = set()

    def __len__(self) -> int:
        return len(self._viewers)

    def tell(self, message: Message) -> None:
        """Tell all. Never waits."""
        for viewer in self._viewers:
            viewer.put(message)

    def renew(self) -> None:
        """Show everything anew to all."""
        for viewer in self._viewers:
            viewer.renew()

    @property
    def full(self) -> bool:
        """Whether as many pages are open as may be."""
        return len(self._viewers) >= MAX_VIEWERS

    def join(self) -> Viewer:
        """One more page."""
        viewer = Viewer()
        self._viewers.add(viewer)
        return viewer

    def end(self) -> None:
        """Let all pages go: the console ends."""
        for viewer in self._viewers:
            viewer.end()

    def leave(self, viewer: Viewer) -> None:
        """The page was closed."""
        self._viewers.discard(viewer)
