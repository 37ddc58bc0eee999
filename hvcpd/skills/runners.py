"""What carries calls out: a program, a pin, a Python object. Each runs in the host's event loop and never blocks it.

`perform` returns what came of the call and raises FailedError with the reason; cancelled, it leaves all safe before
it ends.
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Protocol

import structlog

from hvcpd.config.skills import Value
from hvcpd.skills.guard import GuardLine
from hvcpd.skills.life import Call

TERM_S = 0.25
"""After SIGTERM a program has so long to leave all safe, before SIGKILL; a stop is to be safe within half a second."""
SAFE_S = 5.0
"""Longest time for the program that leaves all safe, before it is ended too."""
MAX_LINE_BYTES = 8192
"""Of what a program says; longer lines are passed over."""
MAX_REASON_LENGTH = 200

_PLACE = re.compile(r"\{([a-z][a-z0-9_]*)\}")

_log = structlog.get_logger(__name__)


class FailedError(Exception):
    """A call cannot be carried out; the text is the reason."""


@dataclass
class Said:
    """What a program or an object has told of its call."""

    results: dict[str, Any] = field(default_factory=dict)
    reason: str = ""


Tell = Callable[[float | None, str], None]
"""How far a call is, as a share of 1 if that is known, and in words."""


class Runner(Protocol):
    """Carries out the calls of one skill, one at a time."""

    async def perform(self, call: Call, tell: Tell) -> Mapping[str, Any]: ...

    def hold(self, on: bool) -> None:
        """Stand still, safe, until it is told to go on."""

    async def close(self) -> None: ...


def filled(words: tuple[str, ...], arguments: Mapping[str, Value]) -> tuple[str, ...]:
    """A program's words with the arguments in their places. Raises KeyError for one that is not there."""
    return tuple(_PLACE.sub(lambda found: _written(arguments[found[1]]), word) for word in words)


def places(words: tuple[str, ...]) -> frozenset[str]:
    """The parameters that a program's words name."""
    return frozenset(name for word in words for name in _PLACE.findall(word))


def _written(value: Value) -> str:
    return value if isinstance(value, str) else f"{value:.10g}"


class Program:
    """A program in a process group of its own, never by a shell. Lines of JSON on its standard output tell of it:
    {"progress": 0.5, "text": "…"}, {"results": {…}}, {"reason": "the tank is empty"}. Exit status 0 is done."""

    def __init__(self, run: tuple[str, ...], safe: tuple[str, ...] = (), guard: GuardLine | None = None) -> None:
        self._run = run
        self._safe = safe
        self._guard = guard
        self._process: asyncio.subprocess.Process | None = None

    async def perform(self, call: Call, tell: Tell) -> Mapping[str, Any]:
        """Run it to its end."""
        arguments = dict(call.arguments)
        safe = filled(self._safe, arguments)
        starting, said = asyncio.ensure_future(start(filled(self._run, arguments))), Said()
        try:
            try:  # a cancel may come when it runs already, and is not yet known to
                process = self._process = await asyncio.shield(starting)
            except OSError as error:
                raise FailedError(f"{self._run[0]}: {error.strerror}") from None
            if self._guard is not None:
                self._guard.arm(process.pid, safe)
            await listen(process, said, tell)
            status = await process.wait()
            if status == 0:
                return said.results
        finally:
            self._process = None
            await shielded(self._end(starting, safe))
        raise FailedError(said.reason or _told(status))

    async def _end(self, starting: asyncio.Future[asyncio.subprocess.Process], safe: tuple[str, ...]) -> None:
        """Nothing of it is left, and all is safe, unless it came to a good end, or never began."""
        try:
            process = await starting
        except OSError:
            return
        await end_group(process)
        if safe and process.returncode != 0:
            with suppress(OSError):
                last = await start(safe)
                with suppress(TimeoutError):
                    await asyncio.wait_for(last.wait(), SAFE_S)
                await end_group(last)
        if self._guard is not None:
            self._guard.clear()

    def hold(self, on: bool) -> None:
        """Freeze it, and all that it has started, where it is."""
        if self._process is not None:
            signal_group(self._process.pid, signal.SIGSTOP if on else signal.SIGCONT)

    async def close(self) -> None:
        """Nothing is open between two calls."""


async def shielded(last: Any) -> None:
    """Do this to its end, whatever is cancelled meanwhile."""
    task = asyncio.ensure_future(last)
    while not task.done():
        with suppress(asyncio.CancelledError):
            await asyncio.shield(task)
    task.result()


async def start(words: tuple[str, ...], asks: bool = False) -> asyncio.subprocess.Process:
    """A program in a group of its own. Raises OSError.

    Nothing is done between fork and exec: for that Python copies its own process, which takes the longer the larger
    it is. That nothing outlives this process is the guard's work.
    """
    return await asyncio.create_subprocess_exec(
        *words,
        stdin=asyncio.subprocess.PIPE if asks else asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        limit=MAX_LINE_BYTES,
        start_new_session=True,
    )


async def listen(process: asyncio.subprocess.Process, said: Said, tell: Tell) -> None:
    """Take what a program tells, line by line, until it ends."""
    assert process.stdout is not None
    while True:
        try:
            line = await process.stdout.readuntil(b"\n")
        except asyncio.LimitOverrunError as error:
            await process.stdout.readexactly(max(error.consumed, 1))
            continue
        except asyncio.IncompleteReadError as error:
            line = error.partial
        if not line:
            return
        take_line(line, said, tell)


def take_line(line: bytes, said: Said, tell: Tell) -> dict[str, Any]:
    """What a line of JSON tells; anything else is somebody's print."""
    try:
        value = json.loads(line)
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        return {}
    results, share = value.get("results"), value.get("progress")
    if isinstance(results, dict):
        said.results.update(results)
    if "reason" in value:
        said.reason = str(value["reason"])[:MAX_REASON_LENGTH]
    if share is not None or "text" in value:
        good = isinstance(share, float | int) and not isinstance(share, bool) and 0.0 <= share <= 1.0
        tell(float(share) if good and share is not None else None, str(value.get("text", ""))[:MAX_REASON_LENGTH])
    return value


async def end_group(process: asyncio.subprocess.Process) -> None:
    """SIGTERM, and soon after it SIGKILL, to a program and all that it has started."""
    if process.returncode is None:
        signal_group(process.pid, signal.SIGCONT)
        signal_group(process.pid, signal.SIGTERM)
        with suppress(TimeoutError):
            await asyncio.wait_for(process.wait(), TERM_S)
    signal_group(process.pid, signal.SIGKILL)
    await process.wait()


def signal_group(group: int, number: signal.Signals) -> None:
    """Send a signal to whatever is left of a process group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(group, number)


def _told(status: int) -> str:
    return f"ended by signal {-status}" if status < 0 else f"exit status {status}"
