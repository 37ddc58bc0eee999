"""The process beside a robot that carries out its skills: it offers them over the control socket and executes calls.

Whatever breaks, all is left safe: the connection, the robot's beat, this process (`guard`).
"""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import structlog

from hvcpd.skills.life import CANCELLED, Call
from hvcpd.skills.runners import FailedError, Runner, as_text

BEATS_MISSED_S = 0.35
"""Three beats and a half: a robot silent for this long hangs, and its calls are ended safely."""
PROGRESS_S = 0.1
"""Between two lines of progress to the robot, which takes a hundred lines a second of a client."""
ENDING_S = 1.0
"""Longest time that calls may take to leave all safe once the connection is broken."""

_log = structlog.get_logger(__name__)


@dataclass
class _Ongoing:
    """A call under way; one that is paused before its runner has begun with it waits for `goes_on`."""

    runner: Runner
    before: Sequence[asyncio.Task[None]]
    goes_on: asyncio.Event = field(default_factory=asyncio.Event)
    has_begun: bool = False

    def hold(self, on: bool) -> None:
        """Pause it, or let it go on."""
        if self.has_begun:
            self.runner.hold(on)
        elif on:
            self.goes_on.clear()
        else:
            self.goes_on.set()


class Host:
    """Serves one connection. `runners` by the names of their skills."""

    def __init__(self, runners: Mapping[str, Runner]) -> None:
        self._runners = runners
        self._calls: dict[int, tuple[_Ongoing, asyncio.Task[None]]] = {}
        self._writer: asyncio.StreamWriter | None = None
        self._lease: asyncio.TimerHandle | None = None
        self.refusal = ""
        """Why the robot refuses the offered skills."""

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Offer the skills, and carry calls out until the connection ends; then no call is active any longer."""
        self._writer = writer
        self._send({"id": "offer", "command": "offer", "skills": sorted(self._runners)})
        try:
            while not self.refusal and (line := await reader.readline()):
                with suppress(ValueError):
                    self._take(json.loads(line))
        except ConnectionError:
            pass
        finally:
            self._writer = None
            await self._leave_all()

    def _take(self, value: Mapping[str, Any]) -> None:
        match value:
            case {"event": "perform", "call": int(number)}:
                self._renew()
                self._begin(number, value)
            case {"event": "cancel", "call": int(number)} if number in self._calls:
                self._calls[number][1].cancel()
            case {"event": "pause" | "resume" as kind, "call": int(number)} if number in self._calls:
                self._calls[number][0].hold(kind == "pause")
            case {"event": "beat"}:
                self._renew()
            case {"id": "offer", "ok": False, "error": {"code": "bad_argument", "text": text}}:
                self.refusal = str(text)

    def _begin(self, number: int, value: Mapping[str, Any]) -> None:
        arguments = tuple((name, each) for name, each in value["arguments"].items())
        call = Call(number, value["task"], value["skill"], arguments, value["limit_s"])
        runner = self._runners.get(call.skill)
        if runner is None:
            self._send({"command": "failed", "call": number, "reason": "it is not offered here"})
            return
        ongoing = _Ongoing(runner, [task for _, task in self._calls.values()])
        ongoing.goes_on.set()
        task = asyncio.get_running_loop().create_task(self._perform(ongoing, call))
        self._calls[number] = ongoing, task
        task.add_done_callback(lambda _: self._calls.pop(number, None))

    async def _perform(self, ongoing: _Ongoing, call: Call) -> None:
        """Carry a call out once those before it, which are cancelled, have left all safe."""

        loop = asyncio.get_running_loop()
        began_s, told_s = loop.time(), -math.inf

        def tell(share: float | None, text: str) -> None:
            nonlocal told_s
            if loop.time() - told_s >= PROGRESS_S:
                told_s = loop.time()
                progress = {"share": share} if share is not None else {}
                self._send({"command": "progress", "call": call.number, "text": text, **progress})

        try:
            if ongoing.before:
                await asyncio.wait(ongoing.before)
            await ongoing.goes_on.wait()
            ongoing.has_begun = True
            self._send({"command": "progress", "call": call.number})
            results = await ongoing.runner.perform(call, tell)
        except asyncio.CancelledError:
            self._send({"command": "failed", "call": call.number, "reason": CANCELLED})
            _log.info("skill cancelled", skill=call.skill)
        except Exception as error:  # also a mistake of a device, or of our own, fails this call at once
            expected = isinstance(error, FailedError)
            reason = as_text(error if expected else f"{type(error).__name__}: {error}")
            self._send({"command": "failed", "call": call.number, "reason": reason})
            _log.warning("skill failed", skill=call.skill, reason=reason, exc_info=not expected)
        else:
            self._send({"command": "done", "call": call.number, "results": dict(results)})
            took_s = round(loop.time() - began_s, 2)
            _log.info("skill done", skill=call.skill, arguments=dict(call.arguments), took_s=took_s)

    def _renew(self) -> None:
        if self._lease is not None:
            self._lease.cancel()
        self._lease = asyncio.get_running_loop().call_later(BEATS_MISSED_S, self._lapse)

    def _lapse(self) -> None:
        self._lease = None
        there = [task for _, task in self._calls.values() if not task.cancelling()]  # a robot beats only during a call
        for task in there:
            _log.warning("skill cancelled", reason=f"the robot was silent for {BEATS_MISSED_S:g} s")
            task.cancel()

    async def _leave_all(self) -> None:
        tasks = [task for _, task in self._calls.values()]
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks, timeout=ENDING_S)
        if self._lease is not None:
            self._lease.cancel()

    def _send(self, value: Mapping[str, Any]) -> None:
        if self._writer is not None:
            self._writer.write(json.dumps(value).encode() + b"\n")
