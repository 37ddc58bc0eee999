"""An event loop whose time jumps to the next timer as soon as nothing else is to be done: who sleeps costs no time."""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Callable, Coroutine
from functools import wraps
from typing import Any

from hil_fakes.dynamixel.virtual import VirtualTime


class _Selector(selectors.DefaultSelector):
    """Lets virtual time pass instead of waiting."""

    def __init__(self, clock: VirtualTime) -> None:
        super().__init__()
        self._clock = clock

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        assert timeout is not None, "nobody waits for anything that time could bring"
        ready = super().select(0)
        if not ready:
            self._clock.advance(max(timeout, 0.0))
        return ready


class _Loop(asyncio.SelectorEventLoop):
    def __init__(self, clock: VirtualTime) -> None:
        self._virtual = clock
        super().__init__(_Selector(clock))

    def time(self) -> float:
        return self._virtual.now_s


async def pass_time(duration_s: float) -> None:
    """Let virtual time pass; costs none on the wall. Only in `run_virtually`."""
    assert isinstance(asyncio.get_running_loop(), _Loop)
    await asyncio.sleep(duration_s)


def run_virtually(scene: Coroutine[Any, Any, Any], clock: VirtualTime | None = None) -> Any:
    """Run a scene without threads, sockets and processes on a clock of its own."""
    with asyncio.Runner(loop_factory=lambda: _Loop(clock or VirtualTime())) as runner:
        return runner.run(asyncio.wait_for(scene, 1000.0))


def virtually(test: Callable[..., Coroutine[Any, Any, Any]]) -> Callable[..., Any]:
    """Has a test that is a coroutine run so."""
    return wraps(test)(lambda *arguments, **given: run_virtually(test(*arguments, **given)))
