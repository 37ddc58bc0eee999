"""The connection to the robot's control socket, which is made again whenever it breaks."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from hvcpd.config.json_objects import json_object
from hvcpd.console.scene import Scene
from hvcpd.daemon.control_protocol import LEARN_S, PROTOCOL
from hvcpd.daemon.control_socket import short_address
from hvcpd.errors import HvcpdError, NotDoneError, NotRunningError

LOOK_S = 1.0
"""Interval between two requests for the state."""
ANSWER_S = 10.0
"""A daemon that lives answers within about 0.05 s; to a stop, where the disk does not answer, after LATCH_S."""
LEARNING = ("add", "remove")
"""Requests about tasks that take as long as LEARN_S."""
OTHER_SHAPE = (AttributeError, LookupError, TypeError, ValueError)
"""What is raised where a reply has another shape than docs/control.md has."""
RETRY_S = (0.25, 0.5, 1.0, 2.0)
"""Delays before each new attempt to connect, from a connection on; the last one is repeated."""
MAX_LINE_BYTES = 4 * 1024 * 1024
"""A reply's line; a hundred rows of transcript have about 30 kB."""
BACK_S = 8 * 3600.0
"""Length of the past transcript that is requested: a shift."""
EVENTS = "said heard garbled held noted taskchanged performed skill statechanged moved level".split()

Reply = dict[str, Any]


class Link:
    """Passes the events of the daemon at `path` to the scene, and requests to the daemon."""

    def __init__(
        self,
        path: Path,
        scene: Scene,
        wall_s: Callable[[], float] = time.time,
        pause: Callable[[float], Awaitable[None]] = asyncio.sleep,
    ) -> None:
        self._path = path
        self._scene = scene
        self._wall_s = wall_s
        self._pause = pause
        self._failures = 0
        self._writer: asyncio.StreamWriter | None = None
        self._asked: dict[int, asyncio.Future[Reply]] = {}
        self._next_id = 1
        self._last_row = 0
        self._changed = asyncio.Event()
        self._early: list[Reply] | None = None

    async def run(self) -> None:
        """Follow the daemon until cancelled."""
        while True:
            try:
                await self._follow()
            except HvcpdError as error:
                self._scene.link(False, f"{error}; searching for it again")
            except OSError as error:
                why = error.strerror or "no connection"
                self._scene.link(False, f"No robot answers at {self._path} ({why}); searching for it again")
            except OTHER_SHAPE as error:
                self._scene.link(False, f"That daemon's answer is unknown here ({error}); searching again")
            await self._pause(RETRY_S[min(self._failures, len(RETRY_S) - 1)])
            self._failures += 1

    async def ask(self, command: str, **arguments: Any) -> Reply:
        """The result of a command. Raises NotRunningError without a daemon, NotDoneError with the daemon's reason."""
        if self._writer is None:
            raise NotRunningError("The robot cannot be reached: its daemon does not answer")
        number, self._next_id = self._next_id, self._next_id + 1
        answer = self._asked[number] = asyncio.get_running_loop().create_future()
        try:
            self._writer.write(json.dumps({"id": number, "command": command, **arguments}).encode() + b"\n")
            async with asyncio.timeout(LEARN_S if arguments.get("do") in LEARNING else ANSWER_S):
                await self._writer.drain()
                reply = await answer
        except (TimeoutError, OSError):
            raise NotRunningError("The robot's daemon does not answer") from None
        finally:
            self._asked.pop(number, None)
        if reply.get("ok") is not True:
            raise NotDoneError(str(reply.get("error", {}).get("text", "the daemon gave no reason")))
        return dict(reply["result"])

    async def _follow(self) -> None:
        """One connection, until it ends. Raises OSError, NotRunningError and NotDoneError."""
        with short_address(self._path) as address:
            reader, self._writer = await asyncio.open_unix_connection(address, limit=MAX_LINE_BYTES)
        try:
            hello = await self._line(reader)
            if hello.get("protocol") != PROTOCOL:
                raise NotDoneError(
                    "That daemon uses another protocol version than this console; restart it after an upgrade"
                )
            # No TaskGroup: Python 3.11's forgets that it was cancelled if a task of it fails at that moment.
            tasks = [asyncio.create_task(self._read(reader)), asyncio.create_task(self._look())]
            try:
                done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
                for task in done:
                    task.result()
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
        finally:
            self._writer.close()
            with suppress(OSError):
                await self._writer.wait_closed()
            self._writer = None
            for answer in self._asked.values():
                if not answer.done():
                    answer.set_exception(NotRunningError("The robot's daemon has ended"))

    async def _read(self, reader: asyncio.StreamReader) -> None:
        while True:
            line = await self._line(reader)
            if "ok" in line:
                answer = self._asked.get(line.get("id", 0))
                if answer is not None and not answer.done():
                    answer.set_result(line)
            elif self._early is not None:
                self._early.append(line)
            else:
                self._event(line)

    async def _line(self, reader: asyncio.StreamReader) -> Reply:
        try:
            value = json_object(await reader.readuntil(b"\n"))
        except asyncio.IncompleteReadError:
            raise NotRunningError("The robot's daemon has ended") from None
        except asyncio.LimitOverrunError:
            value = None
        if value is None:
            raise NotDoneError(f"The program that answers at {self._path} is not hvcpd")
        return value

    async def _look(self) -> None:
        """Subscribe, read the transcript so far, then request state and board at intervals."""
        self._early = []
        await self.ask("subscribe", events=EVENTS)
        status = await self.ask("status")
        self._failures = 0
        self._scene.status(status)
        self._scene.link(True, f"Connected to {status['name']}; reading what was said before …")
        await self._read_back()
        early, self._early = self._early, None
        for event in early:
            self._event(event)
        while True:
            self._changed.clear()
            status = await self.ask("status")
            self._scene.status(status)
            if status["state"] != "starting":
                self._scene.tasks((await self.ask("tasks"))["tasks"])
            self._scene.link(True, f"Connected to {status['name']}")
            with suppress(TimeoutError):
                async with asyncio.timeout(LOOK_S):
                    await self._changed.wait()

    async def _read_back(self) -> None:
        since_s = self._wall_s() - BACK_S
        while True:
            rows = (await self.ask("transcript", after=self._last_row, since_s=since_s))["rows"]
            if not rows:
                return
            self._last_row = rows[-1]["number"]
            self._scene.rows(rows)

    def _event(self, event: Reply) -> None:
        self._scene.event(event)
        if event.get("event") in ("taskchanged", "statechanged"):
            self._changed.set()
