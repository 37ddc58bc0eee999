"""A host's end of the connection, by itself: calls that fail, are cancelled, and take their time to be safe."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from structlog.testing import capture_logs

from hvcpd.skills.host import BEATS_MISSED_S, Host
from hvcpd.skills.life import Call
from hvcpd.skills.runners import Runner, Tell, shielded


class Lingering:
    """Takes until `safe` is set to end a call that was cancelled."""

    def __init__(self) -> None:
        self.safe = asyncio.Event()
        self.begun: list[int] = []
        self.under_way = 0
        self.held: list[bool] = []

    async def perform(self, call: Call, tell: Tell) -> dict[str, Any]:
        self.under_way += 1
        assert self.under_way == 1, "a runner carries out one call at a time"
        self.begun.append(call.number)
        try:
            await asyncio.Event().wait()
        finally:
            await shielded(self.safe.wait())
            self.under_way -= 1
        return {}

    def hold(self, on: bool) -> None:
        self.held.append(on)

    async def close(self) -> None: ...


@asynccontextmanager
async def serving(skill: str, runner: Runner) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    """A robot's end of the connection to a host that offers one skill."""
    ours, theirs = socket.socketpair()
    reader, writer = await asyncio.open_connection(sock=ours)
    service = asyncio.create_task(Host({skill: runner}).serve(*await asyncio.open_connection(sock=theirs)))
    yield reader, writer
    writer.close()
    await service


async def test_a_mistake_of_a_runner_fails_its_call_at_once() -> None:
    """A pin that broke while it was on, for example: the call hung until its time limit."""

    class Broken(Lingering):
        async def perform(self, call: Call, tell: Tell) -> dict[str, Any]:
            raise OSError(5, "Input/output error")

    called = {"event": "perform", "call": 1, "task": 1, "skill": "pour", "arguments": {}, "limit_s": 60.0}
    async with serving("pour", Broken()) as (reader, writer):
        writer.write(json.dumps(called).encode() + b"\n")
        while (line := json.loads(await reader.readline()))["command"] != "failed":
            pass
        assert line["reason"] == "OSError: [Errno 5] Input/output error"


class Ends:
    """The robot's end of the connection."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer

    def send(self, number: int, *events: str, skill: str = "hold") -> None:
        for event in events:
            call = {"task": 1, "skill": skill, "arguments": {}, "limit_s": 60.0}
            self._writer.write(json.dumps({"event": event, "call": number, **call}).encode() + b"\n")

    async def told(self, command: str, number: int) -> None:
        while (line := json.loads(await self._reader.readline())).get("command") != command or line["call"] != number:
            pass

    async def all_taken(self) -> None:
        """Wait until the host has taken all that was sent."""
        self.send(99, "perform", skill="unknown")
        await self.told("failed", 99)


async def test_a_call_begins_only_when_the_cancelled_one_before_it_is_safe() -> None:
    """A Python object that was called again within milliseconds of its cancel went on to the end of its time limit."""
    runner = Lingering()
    async with serving("hold", runner) as connection:
        robot = Ends(*connection)
        robot.send(1, "perform")
        await robot.told("progress", 1)
        robot.send(1, "cancel")
        robot.send(2, "perform", "cancel")
        robot.send(3, "perform")
        await robot.all_taken()
        assert runner.begun == [1]
        runner.safe.set()
        await robot.told("failed", 1)
        await robot.told("progress", 3)
        robot.send(3, "cancel")
        await robot.told("failed", 3)
        assert runner.begun == [1, 3]


async def test_a_call_that_is_paused_before_it_has_begun_begins_when_it_goes_on() -> None:
    """The runner was told to hold, and then carried the call out while the robot stood."""
    runner = Lingering()
    runner.safe.set()
    async with serving("hold", runner) as connection:
        robot = Ends(*connection)
        robot.send(1, "perform", "pause")
        await robot.all_taken()
        assert runner.begun == []
        robot.send(1, "resume")
        await robot.told("progress", 1)
        robot.send(1, "pause", "resume", "cancel")
        await robot.told("failed", 1)
        assert (runner.begun, runner.held) == ([1], [True, False])


async def test_a_robot_that_beats_no_longer_for_a_cancelled_call_is_not_called_silent() -> None:
    """A Python object that hung was killed at its time limit, and the log blamed the robot."""
    with capture_logs() as logs:
        loop, ahead_s = asyncio.get_running_loop(), 0.0
        clock = loop.time
        loop.time = lambda: clock() + ahead_s  # type: ignore[method-assign]
        runner = Lingering()
        async with serving("hold", runner) as (reader, writer):
            asked = ("perform", "hold", "progress"), ("cancel", "hold", ""), ("perform", "unknown", "failed")
            for event, skill, told in asked:
                called = {"event": event, "call": 1, "task": 1, "skill": skill, "arguments": {}, "limit_s": 60.0}
                writer.write(json.dumps(called).encode() + b"\n")
                while told and json.loads(await reader.readline()).get("command") != told:
                    pass
            ahead_s = 2.0 * BEATS_MISSED_S
            for _ in range(3):
                await asyncio.sleep(0)
            runner.safe.set()
    assert not [line for line in logs if "silent" in line.get("reason", "")]
