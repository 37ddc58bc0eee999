"""Skills that are Python objects, found by the entry-point group `hvcpd.skills`.

    class Wave:
        async def perform(self, call: SkillCall) -> Result: ...

Each object lives in a process of its own, made once (without arguments) and called repeatedly. One that hangs is
killed, and nothing else with it. When cancelled, `perform` gets asyncio.CancelledError and has a quarter of a second.

    python -m hvcpd.skills.objects NAME

is that process: calls come in as lines of JSON, and their reports go out in the same way.
"""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
import traceback
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.metadata import entry_points
from typing import Any, Protocol

from hvcpd.config.skills import Value
from hvcpd.skills.guard import GuardLine
from hvcpd.skills.life import CANCELLED, Call
from hvcpd.skills.runners import TERM_S, FailedError, Reported, Tell, as_text, end_group, next_report, shielded, start

GROUP = "hvcpd.skills"
MAKE_S = 30.0
"""Time for large libraries, such as those for arms or cameras, to load on a Raspberry Pi."""


@dataclass(frozen=True)
class SkillCall:
    """A request to an object. `progress(0.5, "half way")` reports progress."""

    skill: str
    task: int
    arguments: Mapping[str, Value]
    progress: Callable[[float | None, str], None]


@dataclass(frozen=True)
class Result:
    """The outcome of a call: done, unless there is a `reason` why not; with results by name, numbers or texts."""

    reason: str | None = None
    results: Mapping[str, Value] = field(default_factory=dict)


class PythonSkill(Protocol):
    """The interface of the entry point's class."""

    def perform(self, call: SkillCall) -> Awaitable[Result]: ...


def installed() -> tuple[str, ...]:
    """The names of all skills in the installed Python packages."""
    return tuple(sorted({point.name for point in entry_points(group=GROUP)}))


def unusable(name: str) -> str | None:
    """Why the object of the entry point `name` cannot be made, as its process reports; None if it can."""
    words = (sys.executable, "-m", "hvcpd.skills.objects", name)
    try:
        tried = subprocess.run(words, input=b"", capture_output=True, check=False, timeout=MAKE_S)
    except subprocess.TimeoutExpired:
        return f"it is not ready within {MAKE_S:g} s"
    told = tried.stderr.decode(errors="replace").strip().splitlines()
    return None if tried.returncode == 0 else told[-1] if told else f"its process ends with {tried.returncode}"


class PythonRunner:
    """Carries calls out in the process of the entry point `name`; `guard` ends it should this process be killed."""

    def __init__(self, name: str, guard: GuardLine | None = None) -> None:
        self._words = (sys.executable, "-m", "hvcpd.skills.objects", name)
        self._mark = guard.mark if guard is not None else {}
        self._process: asyncio.subprocess.Process | None = None

    async def open(self) -> None:
        """Prepare the skill, so that a call begins at once. Raises FailedError."""
        if self._process is None or self._process.returncode is not None:
            try:
                self._process = await start(self._words, asks=True, mark=self._mark)
            except OSError as error:
                raise FailedError(f"{self._words[0]}: {error.strerror}") from None

    async def perform(self, call: Call, tell: Tell) -> Mapping[str, Any]:
        """One call; an object that does not confirm that it was cancelled is killed."""
        await self.open()
        process, said = self._process, Reported()
        assert process is not None
        told = {"call": call.number, "skill": call.skill, "task": call.task, "arguments": dict(call.arguments)}
        _send(process, told)
        try:
            over = await self._until_over(process, said, tell)
        except asyncio.CancelledError:
            await shielded(self._cancel(process))
            raise
        if "done" not in over:
            raise FailedError((said.reason or "it gave no reason") if over else "its process has ended")
        return said.results

    async def _cancel(self, process: asyncio.subprocess.Process) -> None:
        _send(process, {"cancel": True})
        with suppress(TimeoutError):
            over = await asyncio.wait_for(self._until_over(process, Reported(), lambda _share, _text: None), TERM_S)
            if over:
                return
        await end_group(process)

    async def _until_over(self, process: asyncio.subprocess.Process, said: Reported, tell: Tell) -> dict[str, Any]:
        """The line that ends a call; nothing if the process ends instead."""
        while (value := await next_report(process, said, tell)) is not None:
            if "done" in value or "reason" in value:
                return value
        await end_group(process)
        return {}

    def hold(self, on: bool) -> None:
        """A Python object is not held: it may be in the middle of an operation, and a stop cancels it soon enough."""

    async def close(self) -> None:
        """End its process."""
        if self._process is not None:
            await end_group(self._process)


def _send(process: asyncio.subprocess.Process, value: Mapping[str, Any]) -> None:
    if process.stdin is not None:
        process.stdin.write(json.dumps(value).encode() + b"\n")


class _Worker:
    """The process's side: one call after the other."""

    def __init__(self, skill: PythonSkill, out: Callable[[Mapping[str, Any]], None]) -> None:
        self._skill = skill
        self._out = out
        self._task: asyncio.Task[Mapping[str, Any]] | None = None

    def take(self, line: bytes) -> None:
        """A call, or that the present one is cancelled."""
        value = json.loads(line)
        if value.get("cancel"):
            if self._task is not None:
                self._task.cancel()
            return
        call = SkillCall(value["skill"], value["task"], value["arguments"], self._progress)
        self._task = asyncio.get_running_loop().create_task(self._perform(call))
        self._task.add_done_callback(self._tell_end)

    def _progress(self, share: float | None, text: str = "") -> None:
        self._out({"progress": share, "text": as_text(text)})

    async def _perform(self, call: SkillCall) -> Mapping[str, Any]:
        """The line that ends the call. A mistake in the object fails that call, and no other."""
        said = Reported()
        try:
            result = await self._skill.perform(call)
            if not hasattr(result, "results"):  # its class has another name: this module runs as __main__
                raise TypeError(f"perform returned {result!r}, not a Result")
            said.add(result.results)
            over = {"done": True} if result.reason is None else {"reason": as_text(result.reason)}
        except (Exception, SystemExit, KeyboardInterrupt) as error:
            traceback.print_exc()  # for whoever writes the object
            over = {"reason": as_text(f"{type(error).__name__}: {error}")}
        return {"results": said.results, **over}

    def _tell_end(self, task: asyncio.Task[Mapping[str, Any]]) -> None:
        self._out({"reason": CANCELLED} if task.cancelled() else task.result())


async def _work(name: str) -> None:
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # an object's output is no answer
    point = next(iter(entry_points(group=GROUP, name=name)))
    worker = _Worker(point.load()(), lambda value: _write(out.fileno(), value))
    loop, reader = asyncio.get_running_loop(), asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while line := await reader.readline():
        worker.take(line)


def _write(fd: int, value: Mapping[str, Any]) -> None:
    os.write(fd, json.dumps(value, default=str).encode() + b"\n")


if __name__ == "__main__":
    asyncio.run(_work(sys.argv[1]))
