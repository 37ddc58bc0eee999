"""Requests to an ASGI application without a network; and replies of a daemon, made up."""

from __future__ import annotations

import asyncio
import json
from dataclasses import dataclass
from typing import Any

from starlette.types import ASGIApp, Message

from hvcpd.console.app import live_app
from hvcpd.console.guard import TOKEN_HEADER, PageAccess
from hvcpd.console.scene import Scene
from hvcpd.console.viewers import Viewers
from hvcpd.errors import HvcpdError

HOST = "127.0.0.1:8765"


@dataclass(frozen=True)
class Answer:
    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def text(self) -> str:
        return self.body.decode()

    def json(self) -> Any:
        return json.loads(self.body)


def request(app: ASGIApp, path: str, method: str = "GET", body: bytes = b"", **headers: str) -> Answer:
    """One request and its whole answer; underscores in headers' names stand for hyphens."""
    given = {"host": HOST} | {name.replace("_", "-"): value for name, value in headers.items()}
    where, _, query = path.partition("?")
    scope = {
        "type": "http",
        "http_version": "1.1",
        "method": method,
        "scheme": "http",
        "path": where,
        "raw_path": where.encode(),
        "query_string": query.encode(),
        "root_path": "",
        "headers": [(name.encode(), value.encode()) for name, value in given.items()],
        "server": ("127.0.0.1", 8765),
        "client": ("127.0.0.1", 50000),
    }
    told: list[Message] = []
    coming = [{"type": "http.request", "body": body, "more_body": False}]

    async def receive() -> Message:
        if not coming:
            await asyncio.Event().wait()  # the client stays, and says no more
        return coming.pop()

    async def send(message: Message) -> None:
        told.append(message)

    async def ask() -> None:
        await app(scope, receive, send)

    asyncio.run(ask())
    start = next(message for message in told if message["type"] == "http.response.start")
    content = b"".join(message.get("body", b"") for message in told if message["type"] == "http.response.body")
    return Answer(start["status"], {k.decode(): v.decode() for k, v in start["headers"]}, content)


class Robot:
    """Takes commands as a daemon does, and notes them; `refusal` is raised instead."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, dict[str, Any]]] = []
        self.refusals: dict[str, HvcpdError] = {}
        self.replies: dict[str, dict[str, Any]] = {}
        """What is in the replies to a command besides or instead of the usual."""
        self.turns: dict[str, int] = {}
        """How many turns of the event loop the reply to a command takes."""
        self.answered: list[str] = []

    async def ask(self, command: str, **arguments: Any) -> dict[str, Any]:
        self.asked.append((command, arguments))
        if command in self.refusals:
            raise self.refusals[command]
        for _ in range(self.turns.get(command, 0)):
            await asyncio.sleep(0)
        self.answered.append(command)
        return {"stopped": command == "stop"} | self.replies.get(command, {})


class Page:
    """A live page without a server, of a robot that was made up."""

    def __init__(self, key: str | None = None, hosts: frozenset[str] = frozenset()) -> None:
        self.robot = Robot()
        self.scene = Scene(Viewers())
        self.scene.status(status())
        self.access = PageAccess(hosts, key)
        self.app = live_app(self.scene, self.robot.ask, self._run, self.access)

    async def _run(self) -> None:
        """Nothing to follow."""

    def get(self, path: str, **headers: str) -> Answer:
        return request(self.app, path, "GET", b"", **headers)

    def act(self, wanted: object, **headers: str) -> Answer:
        """Press a button; what the page itself sends can be replaced."""
        own = {"origin": f"http://{HOST}", TOKEN_HEADER.replace("-", "_"): self.access.token}
        return request(self.app, "/act", "POST", json.dumps(wanted).encode(), **(own | headers))


def status(**more: Any) -> dict[str, Any]:
    """A reply to `status`."""
    return {
        "name": "Rob",
        "team": "plant",
        "state": "ready",
        "doing": "is free",
        "stopped": False,
        "speaking": False,
        "task": None,
        "wall_s": 1_000_000.0,
        "now_s": 100.0,
        "pose": {"x_m": 0.0, "y_m": 0.0, "heading_deg": 0.0},
        "peers": [],
        "battery_v": 11.9,
        "sound": {"listening": True, "level_dbfs": -50.0, "floor_dbfs": -55.0, "mute": False, "lost": {}},
        "wheels": {"fault": None},
        "memory": {"file": "rob.sqlite3", "lost": 0},
    } | more


def task(number: int = 1, **more: Any) -> dict[str, Any]:
    """A row of a reply to `tasks`."""
    return {
        "number": number,
        "name": "water the red rose",
        "state": "open",
        "owner": None,
        "hearsay": False,
        "lease_s": None,
        "failed_by": [],
        "unable": False,
        "place": {"x_m": 1.0, "y_m": 2.0},
    } | more


def heard(text: str = "Hi all, I am Bot", speaker: str = "Bot", at_s: float = 101.0, **more: Any) -> dict[str, Any]:
    """An event of a sentence that was heard."""
    return {
        "event": "heard",
        "at_s": at_s,
        "listener": "Rob",
        "speaker": speaker,
        "text": text,
        "confidence": 0.97,
        "snr_db": 21.0,
        "words": [],
    } | more
