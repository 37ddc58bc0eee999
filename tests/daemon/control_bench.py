"""A daemon's control socket around a robot that is told what it hears: no sound card, no serial port, no waiting."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hvcpd.config.settings_file import Loaded, load_with_sources
from hvcpd.config.task_changes import TaskChanges
from hvcpd.daemon.control_service import ControlService
from hvcpd.daemon.control_socket import short_address
from hvcpd.daemon.control_status import Body
from hvcpd.daemon.journal_service import JournalService
from hvcpd.daemon.reloading import Rereading
from hvcpd.daemon.wheel_service import WheelService
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.ports import WheelCommand, WheelReading
from hvcpd.recognition.events import Event
from hvcpd.robot.sealing import Sealing
from tests.robot.test_hold import BLOCK, Bench

ONE_TASK = "tasks:\n- {number: 1, name: water the green rose, place: {x_m: 0, y_m: 0}, actions: [{forward: 1}]}\n"


def run(scene: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(scene, 30.0))


@dataclass
class NotedWheels:
    """Wheels that turn as they are told, and keep what they were told."""

    told: list[WheelCommand] = field(default_factory=list)

    def open(self) -> None:
        """Nothing to open."""

    def exchange(self, command: WheelCommand) -> WheelReading:
        self.told.append(command)
        return WheelReading(0.0, 0.0, voltage_v=11.9)

    def close(self) -> None:
        """Nothing to close."""


class Talk:
    """A client that writes what it likes, and reads lines."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer

    async def line(self) -> dict[str, Any] | None:
        """The next line; None when the daemon has hung up."""
        try:
            raw = await self.reader.readline()
        except ConnectionError:
            return None
        return dict(json.loads(raw)) if raw else None

    async def ask(self, command: str, **arguments: object) -> dict[str, Any]:
        """The reply to a request, whatever events come before it."""
        return await self.say(json.dumps({"command": command, **arguments}).encode() + b"\n")

    async def say(self, raw: bytes) -> dict[str, Any]:
        """The reply to these bytes."""
        self.writer.write(raw)
        while True:
            line = await self.line()
            assert line is not None, "the daemon has hung up"
            if "ok" in line:
                return line

    async def hang_up(self) -> None:
        self.writer.close()
        with suppress(ConnectionError):
            await self.writer.wait_closed()


class SomeWords(Rereading):
    """Of tasks, their names are compared at once; the comparison of all words, which takes seconds, is left out."""

    def read(self, changes: TaskChanges | None) -> tuple[Loaded, Wiring]:
        loaded = self.load()
        return loaded, wire_up(loaded.settings, changes=changes)


class ControlBench:
    """The service, the robot behind it, and clients. `compares_words`: new words with all others, for seconds."""

    def __init__(
        self,
        directory: Path,
        board: str = ONE_TASK,
        compares_words: bool = False,
        sealing: Sealing | None = None,
        **more: object,
    ) -> None:
        (directory / "tasks.yaml").write_text(board)
        self.file = directory / "bench.yaml"
        self.file.write_text("mode: volunteer\n")
        given = {"name": "Rob", "tasks": str(directory / "tasks.yaml"), "state_dir": str(directory / "state")} | more

        load = partial(load_with_sources, self.file, given, environment={})
        loaded = load()
        wiring = wire_up(loaded.settings)
        self.bench = Bench(*wiring.tasks.tasks[0].actions, skills=wiring.tasks.skills, sealing=sealing)
        self.wheels = NotedWheels()
        self.journal = JournalService(wiring)
        self.body = Body(wiring, self.journal)
        rereading = SomeWords(load, loaded.sources, allow_confusable=not compares_words)
        self.service = ControlService(self.body, rereading)
        self.path = loaded.settings.control.socket or directory / "state" / "rob.sock"
        self._talks: list[Talk] = []

    async def open(self, with_robot: bool = True) -> None:
        await self.service.open()
        await self.journal.open()
        if with_robot:
            self.begin()

    def begin(self) -> None:
        self.service.begin(self.bench.robot)
        self.body.wheels = WheelService(self.wheels)

    async def close(self) -> None:
        for talk in self._talks:
            await talk.hang_up()
        await self.service.close()
        if self.body.wheels is not None:
            await self.body.wheels.close()
        await self.journal.close()
        self.service.release()

    async def live(self, *events: Event, blocks: int = 1) -> None:
        """Some blocks, after the first of which these events are known."""
        robot, wheels = self.bench.robot, self.body.wheels
        self.bench.recogniser.coming += events
        for _ in range(blocks):
            heard = np.full(BLOCK, 0.1, np.float32)
            reading = wheels.take_reading() if wheels is not None else None
            output = robot.step(heard, reading)
            self.records = output.records
            if wheels is not None:
                wheels.serve(output.wheels, robot.now)
                await wheels.settled()
            self.journal.write(output.records, robot.now)
            self.service.note(robot, heard, reading, output)
            await asyncio.sleep(0)

    async def connect(self) -> Talk:
        """A client, and its first line read; it hangs up when the bench is closed."""
        with short_address(self.path) as address:
            talk = Talk(*await asyncio.open_unix_connection(address))
        self._talks.append(talk)
        first = await talk.line()
        assert first is not None
        assert first["event"] == "hello"
        return talk


@asynccontextmanager
async def control(
    directory: Path, with_robot: bool = True, board: str = ONE_TASK, compares_words: bool = False, **more: object
) -> AsyncIterator[ControlBench]:
    """A bench that is open meanwhile."""
    bench = ControlBench(directory, board, compares_words, **more)
    await bench.open(with_robot)
    try:
        yield bench
    finally:
        await bench.close()


@asynccontextmanager
async def talking(directory: Path, **more: Any) -> AsyncIterator[tuple[ControlBench, Talk]]:
    """As `control`, with a client."""
    async with control(directory, **more) as bench:
        yield bench, await bench.connect()
