"""`hvcpctl follow`: what a robot says, hears and does, as it happens; lines in a pipe, a live screen on a terminal."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Protocol

from hvcpd.control.live.daemon_client import DaemonClient, find_daemon
from hvcpd.control.output import print_note, show
from hvcpd.errors import BusyError, NotRunningError

if TYPE_CHECKING:
    from hvcpd.control.live.follow_lines import FollowLines

LOOK_S = 1.0
"""Interval between two requests for state and board, and between two attempts to reach a daemon that has ended."""


class Show(Protocol):
    """A display of what happens."""

    def event(self, event: dict[str, Any], wall_s: float) -> None: ...

    def state(self, status: dict[str, Any], tasks: list[dict[str, Any]]) -> None: ...

    def note(self, text: str) -> None: ...


class Following:
    """Two connections to one daemon: one for events, one for requests, because a reply would interrupt the events."""

    def __init__(self, asking: DaemonClient, more: Sequence[str]) -> None:
        """Ask for the usual kinds of events, and for `more`. Raises BusyError where too many follow already."""
        with ExitStack() as stack:
            stack.enter_context(closing(asking))
            self._asking, self.hearing = asking, stack.enter_context(closing(DaemonClient(asking.path)))
            usual = self.hearing.ask("subscribe")
            if more:
                self.hearing.ask("subscribe", events=[*usual["events"], *more])
            self._connections = stack.pop_all()

    def close(self) -> None:
        """Close both connections."""
        self._connections.close()

    def run(self, show: Show) -> NoReturn:
        """Show what comes until the daemon ends. Raises NotRunningError then, and BusyError if it hangs."""
        looked_s, offset_s = -math.inf, 0.0
        while True:
            if time.monotonic() - looked_s >= LOOK_S:
                looked_s = time.monotonic()
                status = self._asking.ask("status")
                offset_s = status["wall_s"] - status["now_s"]
                tasks = self._asking.ask("tasks")["tasks"] if status["state"] != "starting" else []
                show.state(status, tasks)
            event = self.hearing.event_within(LOOK_S)
            if event is not None:
                show.event(event, event.get("at_s", 0.0) + offset_s)


class JsonShow:
    """Prints each event as a JSON object on a line, with the wall-clock time."""

    def event(self, event: dict[str, Any], wall_s: float) -> None:
        show(True, {**event, "wall_s": round(wall_s, 3)})

    def state(self, status: dict[str, Any], tasks: list[dict[str, Any]]) -> None:
        """Prints nothing; `hvcpctl status --watch --json` does."""

    def note(self, text: str) -> None:
        print_note(text)


def run(options: argparse.Namespace, wait: Callable[[float], None] = time.sleep) -> None:
    """Follow until interrupted; wait for a daemon that has ended or does not answer."""
    more = {"moved": options.poses, "sound": options.sound}
    with ExitStack() as stack:
        show: Show = JsonShow() if options.json else stack.enter_context(_terminal())
        watch(options, show, wait, [kind for kind, wanted in more.items() if wanted])


def watch(
    options: argparse.Namespace, show: Show, wait: Callable[[float], None] = time.sleep, more: Sequence[str] = ()
) -> NoReturn:
    """Show what the robot that the options mean does, for ever; `more`: frequent events."""
    following = Following(find_daemon(options), more)  # if there is none at the start, that is said at once
    path = following.hearing.path  # by the options it might later be another one
    while True:
        with closing(following):
            try:
                following.run(show)
            except (NotRunningError, BusyError) as error:
                show.note(f"{error}; waiting for it to come back")
        following = _follow_again(path, more, wait)
        show.note(f"{following.hearing.name} is back")


def _follow_again(path: Path, more: Sequence[str], wait: Callable[[float], None]) -> Following:
    while True:
        wait(LOOK_S)
        with suppress(NotRunningError, BusyError):
            return Following(DaemonClient(path), more)


def _terminal() -> AbstractContextManager[FollowLines]:
    from hvcpd.control.live.follow_lines import FollowLines
    from hvcpd.control.live.terminal import Terminal

    return FollowLines(Terminal(highlight=False))
