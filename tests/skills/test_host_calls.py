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
from tests.daemon.control_bench import run


class Lingering:
    """Takes until `safe` is set to end a call that was cancelled."""

    def __init__(self) -> None:
        self.safe = asyncio.Event()
        self.begun: list[int] = []
        self.under_way = 0

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

    def hold(self, on: bool) -> None: ...

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


def test_a_mistake_of_a_runner_fails_its_call_at_once() -> None:
    """A pin that broke while it was on, for example: the call hung until its time limit."""

    class Broken(Lingering):
        async def perform(self, call: Call, tell: Tell) -> dict[str, Any]:
            raise OSError(5, "Input/output error")

    async def play() -> None:
        called = {"event": "perform", "call": 1, "task": 1, "skill": "pour", "arguments": {}, "limit_s": 60.0}
        async with serving("pour", Broken()) as (reader, writer):
            writer.write(json.dumps(called).encode() + b"\n")
            while (line := json.loads(await reader.readline()))["command"] != "failed":
                pass
            assert line["reason"] == "OSError: [Errno 5] Input/output error"

    run(play())


def test_a_call_begins_only_when_the_cancelled_one_before_it_is_safe() -> None:
    """A Python object that was called again within milliseconds of its cancel went on to the end of its time limit."""

    async def play() -> None:
        runner = Lingering()
        async with serving("hold", runner) as (reader, writer):

            def send(event: str, number: int, skill: str = "hold") -> None:
                call = {"task": 1, "skill": skill, "arguments": {}, "limit_s": 60.0}
                writer.write(json.dumps({"event": event, "call": number, **call}).encode() + b"\n")

            async def told(command: str, number: int) -> None:
                while (line := json.loads(await reader.readline())).get("command") != command or line["call"] != number:
                    pass

            send("perform", 1)
            await told("progress", 1)
            for number in (1, 2):
                send("cancel", number)
                send("perform", number + 1)
            send("perform", 4, "unknown")
            await told("failed", 4)  # it has taken all that was sent before
            assert runner.begun == [1]
            runner.safe.set()
            await told("failed", 1)
            await told("progress", 3)
            send("cancel", 3)
            await told("failed", 3)
            assert runner.begun == [1, 3]

    run(play())


def test_a_robot_that_beats_no_longer_for_a_cancelled_call_is_not_called_silent() -> None:
    """A Python object that hung was killed at its time limit, and the log blamed the robot."""

    async def play() -> None:
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

    with capture_logs() as logs:
        run(play())
    assert not [line for line in logs if "silent" in line.get("reason", "")]
