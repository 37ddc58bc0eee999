"""The control socket's clients: each line is served as it comes, and none of them can hold up the robot.

A request with an id is served at once, whatever its client still waits for: a stop never waits for a new task's words
to be compared, or for a disk. A request without an id is answered before the next line is read.

All of it runs in the event loop between two blocks of sound, so everything is bounded: clients, bytes of a line,
requests a second, bytes that a client leaves unread.
"""

from __future__ import annotations

import asyncio
import socket
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any

import structlog

from hvcpd.daemon.control_lobby import Lobby, Visitor
from hvcpd.daemon.control_protocol import (
    MAX_LINE_BYTES,
    RefusalError,
    Request,
    id_of,
    line_of,
    parse_request,
    refusal_line,
    reply_line,
    says_stop,
)
from hvcpd.daemon.control_socket import Caller

MAX_CLIENTS = 16
"""Maximum number of clients that have sent a request: a ROS bridge, a console with several windows, and people's
commands."""
STOP_PLACES = 16
"""Further places for clients that begin with "stop", for while all others are taken."""
MAX_FOLLOWERS = 12
"""Maximum number of clients that may stay for events; the other places are for requests, such as "stop"."""
MAX_PENDING = 8
"""Maximum number of unanswered requests of a client: another one is refused, unless it is a "stop", of which as many
again may be unanswered."""
PAUSE_S = 0.01
"""After each request of a client, so that 16 that ask without end take less than a tenth of a processor's time."""
PATIENCE_S = 5.0
"""Time within which a client must read its reply; then it is let go."""
MAX_UNREAD_BYTES = 1 << 18
"""256 KiB: many minutes of events; a client that lets more of them lie is let go."""
FAREWELL_S = 0.5
"""Time that clients have to read what they were sent when the daemon ends."""

_log = structlog.get_logger(__name__)


@dataclass(eq=False)
class Client:
    """One connection."""

    caller: Caller
    asked_s: float
    """When it last asked something, by the event loop's clock."""
    is_new: bool = True
    """Whether its first line is still to be served."""
    pending: set[asyncio.Task[None]] = field(default_factory=set)
    """Its requests that are not yet answered."""
    writer: asyncio.StreamWriter | None = None
    wanted: frozenset[str] = frozenset()
    """The kinds of events that it follows."""

    def send(self, line: bytes) -> bool:
        """Send a line; False if the client has left too much unread, and must be disconnected."""
        if self.writer is None:
            return False
        if self.writer.transport.get_write_buffer_size() > MAX_UNREAD_BYTES:
            self.writer.transport.abort()
            return False
        self.writer.write(line)
        return True


Serve = Callable[[Request, Client], Awaitable[Mapping[str, Any]]]
"""Carries a request out; raises RefusalError."""


class ControlServer:
    """Serves the clients of a listening socket with `serve`; `hello` is the first line to each, and `gone` is told of
    each that has disconnected."""

    def __init__(self, serve: Serve, hello: Callable[[], Mapping[str, Any]], gone: Callable[[Client], None]) -> None:
        self._serve = serve
        self._tell_gone = gone
        self._lobby = Lobby(lambda: line_of(hello()), self._admit)
        self._clients: dict[Client, asyncio.Task[None]] = {}

    def open(self, listener: socket.socket) -> None:
        """Begin to serve who connects to this listener, and no longer to an earlier one."""
        self._lobby.open(listener)

    async def close(self) -> None:
        """Stop serving, and close all connections."""
        self._lobby.close()
        for client in self._clients:
            if client.writer is not None:
                client.writer.close()
        if self._clients:
            _, late = await asyncio.wait(self._clients.values(), timeout=FAREWELL_S)
            for task in late:
                task.cancel()

    def followed(self, kind: str) -> bool:
        """Whether any client has subscribed to events of this kind."""
        return any(kind in client.wanted for client in self._clients)

    def publish(self, event: Mapping[str, Any]) -> None:
        """Send an event to all clients that have subscribed to its kind."""
        kind = event["event"]
        followers = [client for client in self._clients if kind in client.wanted]
        if followers:
            line = line_of(event)
            for client in followers:
                if not client.send(line):
                    self._let_go(client)

    def follow(self, client: Client, kinds: frozenset[str]) -> None:
        """Subscribe the client to events of these kinds. Raises RefusalError if there are too many subscribers."""
        others = sum(bool(each.wanted) for each in self._clients if each is not client)
        if kinds and others >= MAX_FOLLOWERS:
            raise RefusalError("busy", f"{MAX_FOLLOWERS} programs already follow this robot; end one of them")
        client.wanted = kinds

    def _admit(self, visitor: Visitor) -> None:
        """Serve a client from the lobby, if need be instead of another one."""
        client = Client(visitor.caller, asyncio.get_running_loop().time())
        _log.debug("control client", pid=client.caller.pid, uid=client.caller.uid, gid=client.caller.gid)
        if len(self._clients) >= MAX_CLIENTS and not self._make_room():
            places = MAX_CLIENTS + (STOP_PLACES if visitor.says_stop else 0)
            if len(self._clients) >= places:
                visitor.refuse(f"{len(self._clients)} programs are being served; try again in a moment")
                return
        task = asyncio.get_running_loop().create_task(self._talk(client, visitor))
        self._clients[client] = task
        task.add_done_callback(lambda done: self._gone(client, done))

    def _make_room(self) -> bool:
        """Of who follows nothing and waits for no answer, one of the process with most connections, who asked something
        longest ago, is most likely hanging. False if there is none."""
        idle = [client for client in self._clients if not (client.wanted or client.is_new or client.pending)]
        if not idle:
            return False
        most = Counter(client.caller.pid for client in self._clients)
        first = min(idle, key=lambda each: (-most[each.caller.pid], each.asked_s))
        first.send(refusal_line(None, RefusalError("busy", f"{MAX_CLIENTS} programs are connected; more are waiting")))
        if first.writer is not None:
            first.writer.close()
        self._clients.pop(first).cancel()
        return True

    def _gone(self, client: Client, done: asyncio.Task[None]) -> None:
        self._clients.pop(client, None)
        self._tell_gone(client)
        if client.writer is not None:
            client.writer.close()
        error = None if done.cancelled() else done.exception()
        if error is not None:  # our own mistake costs that client, not the robot
            _log.error("control client failed", exc_info=error)

    async def _talk(self, client: Client, visitor: Visitor) -> None:
        loop = asyncio.get_running_loop()
        reader = asyncio.StreamReader(MAX_LINE_BYTES)
        reader.feed_data(bytes(visitor.said))
        protocol = asyncio.StreamReaderProtocol(reader)
        with ExitStack() as stack:
            stack.callback(visitor.connection.close)
            transport, _ = await loop.connect_accepted_socket(lambda: protocol, visitor.connection)
            stack.pop_all()
        client.writer = asyncio.StreamWriter(transport, protocol, reader, loop)
        async with asyncio.TaskGroup() as replies:
            while (line := await _line(client, reader)) is not None:
                client.asked_s, client.is_new = loop.time(), False
                n_pending = len(client.pending)
                if n_pending >= MAX_PENDING and (n_pending >= 2 * MAX_PENDING or not says_stop(line)):
                    text = f"{MAX_PENDING} requests of this program are not answered yet"
                    client.send(refusal_line(id_of(line), RefusalError("busy", text)))
                else:
                    reply = replies.create_task(self._reply(client, client.writer, line))
                    client.pending.add(reply)
                    reply.add_done_callback(client.pending.discard)
                    if id_of(line) is None:
                        await asyncio.wait([reply])
                await asyncio.sleep(PAUSE_S)

    def _let_go(self, client: Client) -> None:
        client.wanted = frozenset()
        _log.warning(
            "control client disconnected", reason="it does not read", pid=client.caller.pid, uid=client.caller.uid
        )

    async def _reply(self, client: Client, writer: asyncio.StreamWriter, line: bytes) -> None:
        if not client.send(await self._answer(client, line)):
            return
        try:
            async with asyncio.timeout(PATIENCE_S):
                await writer.drain()
        except TimeoutError:
            writer.transport.abort()
            self._let_go(client)
        except ConnectionError:
            return

    async def _answer(self, client: Client, line: bytes) -> bytes:
        try:
            request = parse_request(line)
        except RefusalError as refusal:
            return refusal_line(id_of(line), refusal)
        try:
            return reply_line(request.id, await self._serve(request, client))
        except RefusalError as refusal:
            return refusal_line(request.id, refusal)


async def _line(client: Client, reader: asyncio.StreamReader) -> bytes | None:
    """The client's next line; None if none can come."""
    try:
        return await reader.readuntil(b"\n")
    except asyncio.LimitOverrunError:
        text = f"a line has at most {MAX_LINE_BYTES} bytes"
        client.send(refusal_line(None, RefusalError("too_long", text)))
    except (asyncio.IncompleteReadError, ConnectionError):
        pass
    return None
