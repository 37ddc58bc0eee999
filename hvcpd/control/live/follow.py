"""`hvcpctl follow`: what a robot says, hears and does, as it happens; lines in a pipe, a live screen on a terminal."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

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


@dataclass
class Following:
    """Two connections to one daemon: one for events, one for requests, because a reply would interrupt the events."""

    asking: DaemonClient
    hearing: DaemonClient
    _offset_s: float = 0.0
    _looked_s: float = field(default=float("-inf"))

    def close(self) -> None:
        """Close both connections."""
        self.asking.close()
        self.hearing.close()

    def subscribe(self, more: Sequence[str]) -> None:
        """Ask for the usual kinds of events, and for `more`. Raises BusyError where too many follow already."""
        usual = self.hearing.ask("subscribe")
        if more:
            self.hearing.ask("subscribe", events=[*usual["events"], *more])

    def run(self, show: Show, n_events: int | None = None) -> None:
        """Show what comes, `n_events` at most (None: until the daemon ends). Raises NotRunningError, and BusyError if
        it hangs."""
        shown = 0
        while n_events is None or shown < n_events:
            if time.monotonic() - self._looked_s >= LOOK_S:
                self._looked_s = time.monotonic()
                self._look(show)
            event = self.hearing.event_within(LOOK_S)
            if event is not None:
                shown += 1
                show.event(event, event.get("at_s", 0.0) + self._offset_s)

    def _look(self, show: Show) -> None:
        status = self.asking.ask("status")
        self._offset_s = status["wall_s"] - status["now_s"]
        tasks = self.asking.ask("tasks")["tasks"] if status["state"] != "starting" else []
        show.state(status, tasks)


class JsonShow:
    """Prints each event as a JSON object on a line, with the wall-clock time."""

    def event(self, event: dict[str, Any], wall_s: float) -> None:
        show(True, {**event, "wall_s": round(wall_s, 3)})

    def state(self, status: dict[str, Any], tasks: list[dict[str, Any]]) -> None:
        """Prints nothing; `hvcpctl status --watch --json` does."""

    def note(self, text: str) -> None:
        print_note(text)


def run(options: argparse.Namespace, wait: Callable[[float], None] = time.sleep, n_events: int | None = None) -> None:
    """Follow until interrupted; wait for a daemon that has ended or does not answer."""
    more = {"moved": options.poses, "sound": options.sound}
    with ExitStack() as stack:
        show: Show = JsonShow() if options.json else stack.enter_context(_terminal())
        watch(options, show, wait, n_events, [kind for kind, wanted in more.items() if wanted])


def watch(
    options: argparse.Namespace,
    show: Show,
    wait: Callable[[float], None] = time.sleep,
    n_events: int | None = None,
    more: Sequence[str] = (),
) -> None:
    """Show what the robot that the options mean does, for ever or for a number of events; `more`: frequent events."""
    following = _connect(find_daemon(options), more)  # if there is none at the start, that is said at once
    path = following.hearing.path  # by the options it might later be another one
    while True:
        with closing(following):
            try:
                following.run(show, n_events)
                return
            except (NotRunningError, BusyError) as error:
                show.note(f"{error}; waiting for it to come back")
        following = _connect_again(path, more, wait)
        show.note(f"{following.hearing.name} is back")


def _connect_again(path: Path, more: Sequence[str], wait: Callable[[float], None]) -> Following:
    while True:
        wait(LOOK_S)
        with suppress(NotRunningError, BusyError):
            return _connect(DaemonClient(path), more)


def _connect(asking: DaemonClient, more: Sequence[str]) -> Following:
    with ExitStack() as stack:
        stack.enter_context(closing(asking))
        hearing = stack.enter_context(closing(DaemonClient(asking.path)))
        following = Following(asking, hearing)
        following.subscribe(more)
        stack.pop_all()
        return following


def _terminal() -> AbstractContextManager[FollowLines]:
    from hvcpd.control.live.follow_lines import FollowLines
    from hvcpd.control.live.terminal import Terminal

    return FollowLines(Terminal(highlight=False))
