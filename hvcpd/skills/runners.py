"""Runners carry calls out: a program, a pin, a Python object. Each runs in the host's event loop and never blocks it.

`perform` returns the result of the call and raises FailedError with the reason; when cancelled, it leaves all safe
before it ends.
"""

from __future__ import annotations

import asyncio
import json
import math
import os
import re
import signal
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from numbers import Real
from typing import Any, Protocol

import structlog

from hvcpd.config.json_objects import json_object
from hvcpd.config.skills import Value
from hvcpd.skills.guard import GuardLine
from hvcpd.skills.life import MAX_RESULTS, Call

TERM_S = 0.25
"""Time for a program to leave all safe after SIGTERM, before SIGKILL; a stop is to be safe within half a second. As
long for what it has started once it has ended itself."""
KILLED_S = 0.1
"""Longest wait for a program to be gone after SIGKILL, whose output others may keep open."""
SAFE_S = 5.0
"""Longest time for the program that leaves all safe, before it is ended too."""
MAX_LINE_BYTES = 8192
"""Longest line of a program's output; longer lines are skipped."""
MAX_REASON_LENGTH = 200
MAX_NAME_LENGTH = 40
MAX_RESULTS_LENGTH = 4096
"""Of all results as JSON, so that they fit a line of the control socket with what stands around them."""

_PLACE = re.compile(r"\{([a-z][a-z0-9_]*)\}")

_log = structlog.get_logger(__name__)


class FailedError(Exception):
    """A call cannot be carried out; the text is the reason."""


@dataclass
class Reported:
    """The reports of a program or an object about its call."""

    results: dict[str, Value] = field(default_factory=dict)
    reason: str = ""

    def add(self, results: Mapping[Any, Any]) -> None:
        """Take results, each as a number or a text, as many as can be passed on."""
        for name, value in results.items():
            more = self.results | {as_text(name, MAX_NAME_LENGTH): _as_value(value)}
            if len(more) <= MAX_RESULTS and len(json.dumps(more)) <= MAX_RESULTS_LENGTH:
                self.results = more


Tell = Callable[[float | None, str], None]
"""Progress of a call: as a share of 1 if that is known, and in words."""


class Runner(Protocol):
    """Carries out the calls of one skill, one at a time."""

    async def perform(self, call: Call, tell: Tell) -> Mapping[str, Any]: ...

    def hold(self, on: bool) -> None:
        """Stand still, safe, until Resume."""

    async def close(self) -> None: ...


def filled(words: tuple[str, ...], arguments: Mapping[str, Value]) -> tuple[str, ...]:
    """A program's words with the arguments in their places. Raises FailedError for one that is not there."""
    for name in sorted(places(words) - arguments.keys()):
        raise FailedError(f"it is not told `{name}`")
    return tuple(filled_in(word, arguments) for word in words)


def filled_in(text: str, arguments: Mapping[str, Value]) -> str:
    """A text with the arguments in their places; a place without one stays as it is."""
    return _PLACE.sub(lambda found: written(arguments[found[1]]) if found[1] in arguments else found[0], text)


def places(words: tuple[str, ...]) -> frozenset[str]:
    """The parameters that a program's words name."""
    return frozenset(name for word in words for name in _PLACE.findall(word))


def number_of(call: Call, name: str) -> float:
    """The call's argument of that name. Raises FailedError if it is no number, or missing."""
    value = dict(call.arguments).get(name)
    if not isinstance(value, float):
        raise FailedError(f"it is not told `{name}`")
    return value


def as_text(found: object, length: int = MAX_REASON_LENGTH) -> str:
    """Whatever a program or an object reports, as a text that can be encoded."""
    return str(found).encode(errors="replace").decode()[:length]


def _as_value(found: object) -> Value:
    """The same as a number, if it is one and finite, or else as a text."""
    with suppress(OverflowError):  # an integer of hundreds of digits
        if isinstance(found, Real) and math.isfinite(found):
            return float(found)
    return as_text(found)


def written(value: Value) -> str:
    """A number as short as it can be, of ten digits at most; a text as it is."""
    return value if isinstance(value, str) else f"{value:.10g}"


class ProgramRunner:
    """A program in a process group of its own, never run by a shell. It reports as lines of JSON on its standard
    output: {"progress": 0.5, "text": "…"}, {"results": {…}}, {"reason": "the tank is empty"}. Exit status 0 is done."""

    def __init__(self, run: tuple[str, ...], safe: tuple[str, ...] = (), guard: GuardLine | None = None) -> None:
        self._run = run
        self._safe = safe
        self._guard = guard
        self._process: asyncio.subprocess.Process | None = None
        self._is_held = False

    async def perform(self, call: Call, tell: Tell) -> Mapping[str, Any]:
        """Run it to its end."""
        self._is_held = False
        arguments = dict(call.arguments)
        safe = filled(self._safe, arguments)
        self._arm(None, safe)  # before it begins, for this process may be killed in between
        mark = self._guard.mark if self._guard is not None else {}
        starting, said = asyncio.ensure_future(start(filled(self._run, arguments), mark=mark)), Reported()
        try:
            try:  # a cancel may come when it already runs, and is not yet known to
                process = self._process = await asyncio.shield(starting)
            except OSError as error:
                raise FailedError(f"{self._run[0]}: {error.strerror}") from None
            if self._is_held:  # it was held while it started
                self.hold(True)
            self._arm(process.pid, safe)
            status = await status_after(process, said, tell)
            if status == 0:
                return said.results
        finally:
            self._process = None
            await shielded(self._end(starting, safe))
        raise FailedError(said.reason or _status_text(status))

    async def _end(self, starting: asyncio.Future[asyncio.subprocess.Process], safe: tuple[str, ...]) -> None:
        """End every process of it and make all safe, unless it ended well, or never began."""
        with suppress(OSError):
            process = await starting
            await end_group(process)
            if safe and process.returncode != 0 and (wrong := await fault_of_running(safe)):
                _log.error("not left safe", program=safe[0], reason=wrong)
        self._arm()

    def _arm(self, group: int | None = None, safe: tuple[str, ...] = ()) -> None:
        if self._guard is not None:
            self._guard.arm(group, safe)

    def hold(self, on: bool) -> None:
        """Freeze it, and all that it has started, where it is."""
        self._is_held = on
        if self._process is not None:
            signal_group(self._process.pid, signal.SIGSTOP if on else signal.SIGCONT)

    async def close(self) -> None:
        """Nothing is open between two calls."""


async def status_after(process: asyncio.subprocess.Process, said: Reported, tell: Tell) -> int:
    """The exit status of a program, whose reports are read to their end: a full pipe would keep it waiting."""
    while await next_report(process, said, tell) is not None:
        pass
    return await process.wait()


async def fault_of_running(words: tuple[str, ...], within_s: float = SAFE_S) -> str | None:
    """Run the program that leaves all safe. Returns why it has not done so; None if it ended well."""
    try:
        process = await start(words)
    except OSError as error:
        return error.strerror
    try:
        async with asyncio.timeout(within_s):
            status = await status_after(process, Reported(), lambda *_: None)
    except TimeoutError:
        return f"it was ended after {within_s:g} s"
    finally:
        await end_group(process)
    return _status_text(status) if status else None


async def shielded(last: Any) -> None:
    """Run this to its end, even if the caller is cancelled."""
    task = asyncio.ensure_future(last)
    while not task.done():
        with suppress(asyncio.CancelledError):
            await asyncio.shield(task)
    task.result()


async def start(
    words: tuple[str, ...], asks: bool = False, mark: Mapping[str, str] | None = None
) -> asyncio.subprocess.Process:
    """A program in a group of its own, with `mark` in its environment. One in Python prints at once, although nobody
    sees it on a terminal. Raises OSError.

    No code runs between fork and exec: for that Python would copy its own process, which takes longer the larger it
    is. The guard ensures that nothing outlives this process.
    """
    loop = asyncio.get_running_loop()
    transport, protocol = await loop.subprocess_exec(
        partial(_Output, MAX_LINE_BYTES, loop),
        *words,
        stdin=asyncio.subprocess.PIPE if asks else asyncio.subprocess.DEVNULL,
        stderr=None,
        start_new_session=True,
        env={"PYTHONUNBUFFERED": "1", **os.environ, **(mark or {})},
    )
    return asyncio.subprocess.Process(transport, protocol, loop)


class _Output(asyncio.subprocess.SubprocessStreamProtocol):
    """Ends a program's output soon after the program; asyncio itself waits for all that it has started and left."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        assert isinstance(transport, asyncio.SubprocessTransport)
        self._program = transport

    def process_exited(self) -> None:
        super().process_exited()
        for descriptor in (0, 1):
            if (pipe := self._program.get_pipe_transport(descriptor)) is not None:
                asyncio.get_running_loop().call_later(TERM_S, pipe.close)


async def next_report(process: asyncio.subprocess.Process, said: Reported, tell: Tell) -> dict[str, Any] | None:
    """Take the report in the next line of a program's output; None if there is none any more."""
    assert process.stdout is not None
    while True:
        try:
            line = await process.stdout.readuntil(b"\n")
        except asyncio.LimitOverrunError as error:
            await process.stdout.readexactly(max(error.consumed, 1))
            continue
        except asyncio.IncompleteReadError as error:
            line = error.partial
        return take_line(line, said, tell) if line else None


def take_line(line: bytes, said: Reported, tell: Tell) -> dict[str, Any]:
    """The report in a line of JSON; any other line is ordinary output."""
    value = json_object(line)
    if value is None:
        return {}
    results, share = value.get("results"), value.get("progress")
    if isinstance(results, dict):
        said.add(results)
    if "reason" in value:
        said.reason = as_text(value["reason"])
    if share is not None or "text" in value:
        good = isinstance(share, float | int) and not isinstance(share, bool) and 0.0 <= share <= 1.0
        tell(float(share) if good and share is not None else None, as_text(value.get("text", "")))
    return value


async def end_group(process: asyncio.subprocess.Process) -> None:
    """SIGTERM, and soon after it SIGKILL, to a program and all that it has started."""
    if process.returncode is None:
        signal_group(process.pid, signal.SIGCONT)
        signal_group(process.pid, signal.SIGTERM)
        with suppress(TimeoutError):
            await asyncio.wait_for(process.wait(), TERM_S)
    signal_group(process.pid, signal.SIGKILL)
    with suppress(TimeoutError):
        await asyncio.wait_for(process.wait(), KILLED_S)
    process._transport.close()  # type: ignore[attr-defined]  # whoever else has its output open, nobody reads it any more


def signal_group(group: int, number: signal.Signals) -> None:
    """Send a signal to the remaining processes of a group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(group, number)


def _status_text(status: int) -> str:
    return f"ended by signal {-status}" if status < 0 else f"exit status {status}"
