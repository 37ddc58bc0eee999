"""Calls of skills, carried out to the end or cancelled, and what is left of their processes."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Callable, Coroutine
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from hil_fakes.sound_server import wait_until
from hvcpd.skills.life import Call
from hvcpd.skills.runners import ProgramRunner, Runner

STOP_S = 0.5
"""From a cancel to the safe state, at the most."""


def call(**arguments: float | str) -> Call:
    return Call(1, 3, "pour", tuple(arguments.items()), 20.0)


def shell(text: str, *more: str) -> ProgramRunner:
    """A program, which happens to be a shell here; what follows are its arguments."""
    return ProgramRunner(("sh", "-c", text, "sh", *more))


def perform(runner: Runner, what: Call | None = None) -> tuple[dict[str, Any], list[tuple[float | None, str]]]:
    told: list[tuple[float | None, str]] = []

    async def scene() -> dict[str, Any]:
        try:
            return dict(await runner.perform(what or call(), lambda share, text: told.append((share, text))))
        finally:
            await runner.close()

    return run(scene()), told


def run(scene: Coroutine[Any, Any, Any]) -> Any:
    return asyncio.run(asyncio.wait_for(scene, 20.0))


async def met(true: Callable[[], bool], what: str) -> None:
    """Wait for another process, on a busy machine for long."""
    await asyncio.to_thread(wait_until, true, 60.0, what)


async def cancelled(runner: Runner, begun: Callable[[], bool], what: Call | None = None) -> float:
    """Cancel a call once it has begun; how long it took until all was safe, s."""
    task = asyncio.create_task(runner.perform(what or call(), lambda _share, _text: None))  # type: ignore[arg-type]
    while not begun():
        assert not task.done(), task
        await asyncio.sleep(0)
    began_s = time.monotonic()
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    return time.monotonic() - began_s


def left_of(group: int) -> list[str]:
    """The processes of a group that still run; who is dead and was not yet fetched by its parent does not."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _parent, its_group = path.read_text().rpartition(")")[2].split()[:3]
            found += [path.parent.name] if int(its_group) == group and state not in "ZX" else []
    return found


def program_of(pid: Path) -> int | None:
    """The process that a program wrote down, once it has."""
    return int(pid.read_text()) if pid.exists() and pid.read_text() else None


def until_gone(group: int) -> None:
    """Who was sent SIGKILL runs no further, but is there until a busy kernel gives it its turn to die."""
    wait_until(lambda: left_of(group) == [], 5.0, "the group is gone")


def fake_pins(folder: Path) -> dict[str, str]:
    """The environment in which gpiozero uses pins in a folder."""
    return {**os.environ, "GPIOZERO_PIN_FACTORY": "files", "FAKE_PINS": str(folder)}
