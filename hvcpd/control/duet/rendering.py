"""Renders the words of a duet's robots in other processes: while an interpreter renders, it is late for its sound.

There is one for each robot, and all of them fill one cache: first with what is needed before anything can be heard and
said, then, as the robots talk already, with all else.
"""

from __future__ import annotations

import asyncio
import math
import os
import signal
from collections.abc import Callable, Sequence
from dataclasses import replace
from multiprocessing import get_context
from multiprocessing.synchronize import Event
from pathlib import Path

import numpy as np

from hvcpd.assembly.make import make_robot
from hvcpd.config.interruption import handled
from hvcpd.config.settings import Settings
from hvcpd.daemon.cache_warm_up import CacheWarmUp, Preparation
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.errors import DeviceError
from hvcpd.ports import Samples
from hvcpd.recognition.stages import SynchronousWorker
from hvcpd.synthesis.unit_cache import SUFFIX, UnitCache, key_of

LOOK_S = 0.5
"""Interval of the checks whether the processes have ended."""
NICENESS = 19
"""While the robots talk, rendering takes only the processor time that nobody else wants."""
_SEEN = np.zeros(0, np.float32)


class _NotRenderedError(Exception):
    """A unit is not in the cache."""


class _Inventory(UnitCache):
    """Looks whether a unit is in the cache, and reads none."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._units = folder

    def get(self, content: object, _make: Callable[[], Samples]) -> Samples:
        """Return nothing. Raises _NotRenderedError."""
        if not (self._units / (key_of(content) + SUFFIX)).exists():
            raise _NotRenderedError
        return _SEEN.copy()


def is_rendered(wiring: Wiring) -> bool:
    """Whether the cache has all that this robot says, at both rates. With that of all robots in the room, they have
    their templates of each other, too."""
    inventory = _Inventory(wiring.settings.state_dir / "units")
    warm_up = CacheWarmUp(wiring.plan(second=SynchronousWorker()), replace(wiring.sound, cache=inventory))
    try:
        warm_up.before_speaking()
        warm_up.at_the_other_rate()
    except _NotRenderedError:
        return False
    return True


class Rendering:
    """The processes, one for each of these robots."""

    def __init__(self, wirings: Sequence[Wiring], niceness: int = NICENESS) -> None:
        """`niceness` is what they add to their own once the robots can talk."""
        context = get_context("spawn")  # a fork would inherit the sound library's threads
        self._can_talk = [context.Event() for _ in wirings]
        self._processes = [
            context.Process(target=_render, args=(wiring.settings, can_talk, niceness), daemon=True)
            for wiring, can_talk in zip(wirings, self._can_talk, strict=True)
        ]
        with handled(signal.SIG_IGN, signal.SIGINT):  # Ctrl-C is for this process alone
            for process in self._processes:
                process.start()

    def wait(self) -> None:
        """Wait until the robots can hear each other and speak. Raises DeviceError if a process fails."""
        for process, can_talk in zip(self._processes, self._can_talk, strict=True):
            while not can_talk.wait(LOOK_S):
                if not process.is_alive() and not can_talk.is_set():
                    raise DeviceError("the robots' words could not be rendered; what went wrong stands above")

    async def ended(self) -> None:
        """Wait until everything is rendered, or a process has failed: then the robots render the rest themselves."""
        while any(process.is_alive() for process in self._processes):
            await asyncio.sleep(LOOK_S)

    def end(self) -> None:
        """Render no more."""
        for process in self._processes:
            process.terminate()
            process.join()


def _render(settings: Settings, can_talk: Event, niceness: int) -> None:
    """Render what the daemon of these settings would, in a robot that is discarded afterwards."""
    wiring = wire_up(settings)
    plan = wiring.plan(second=SynchronousWorker())
    warm_up = CacheWarmUp(plan, wiring.sound, Preparation(logged_every_s=math.inf))
    warm_up.before_listening()
    warm_up.before_speaking()
    can_talk.set()
    os.nice(niceness)
    warm_up.the_rest(make_robot(plan, wiring.sound))
