"""The lobby of the control socket: a client waits here, at little cost, until it has sent its first line.

A client that connects in a storm and sends nothing takes no place among the served clients. And "stop" goes before all
others: it is passed on as soon as it is read. A client that does not wait for the first line has sent its own when it
is admitted.
"""

from __future__ import annotations

import asyncio
import socket
from collections import Counter, deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field

import structlog

from hvcpd.daemon.control_protocol import MAX_LINE_BYTES, RefusalError, refusal_line, says_stop
from hvcpd.daemon.control_socket import Caller, caller_of

MAX_WAITING = 64
"""Maximum number of connections that have sent no whole line yet, or wait for their turn; with 8 KiB each they hold
half a megabyte."""
TURN_S = 0.02
ACCEPTS = 8
"""Maximum number of connections accepted each TURN_S: 400 a second, 0.1 ms each (x86), so that a storm takes a few per
cent of a processor. The system keeps the others waiting in the order in which they came."""
ADMISSIONS = 2
"""Maximum number of connections passed on to the request handler each TURN_S; a request takes it ten times as long as
accepting takes."""

_log = structlog.get_logger(__name__)


@dataclass(eq=False)
class Visitor:
    """One connection, and what it has sent so far."""

    connection: socket.socket
    caller: Caller
    said: bytearray = field(default_factory=bytearray)

    @property
    def has_asked(self) -> bool:
        """Whether there is a whole line, or more than a line may have."""
        return b"\n" in self.said or len(self.said) > MAX_LINE_BYTES

    @property
    def says_stop(self) -> bool:
        """Whether its first line is a request to stop."""
        line, _, _ = self.said.partition(b"\n")
        return says_stop(bytes(line))

    def refuse(self, text: str) -> None:
        """Send the reason and close the connection."""
        with suppress(OSError):
            self.connection.send(refusal_line(None, RefusalError("busy", text)))
        self.connection.close()


class Lobby:
    """Accepts connections to `listener`, greets them, and passes each to `admit` once it has sent a line."""

    def __init__(self, hello: Callable[[], bytes], admit: Callable[[Visitor], None]) -> None:
        self._hello = hello
        self._admit = admit
        self._listener: socket.socket | None = None
        self._silent: dict[Visitor, None] = {}
        self._asking: deque[Visitor] = deque()
        self._admissions = ADMISSIONS
        self._turn: asyncio.TimerHandle | None = None
        self._failing = False

    def open(self, listener: socket.socket) -> None:
        """Begin to accept connections, at this listener instead of an earlier one."""
        self._close_listener()
        listener.setblocking(False)
        self._listener = listener
        asyncio.get_running_loop().add_reader(listener, self._let_in)

    def close(self) -> None:
        """Accept no more connections, and close those that wait."""
        loop = asyncio.get_running_loop()
        if self._turn is not None:
            self._turn.cancel()
        self._close_listener()
        for visitor in [*self._silent, *self._asking]:
            loop.remove_reader(visitor.connection)
            visitor.connection.close()
        self._silent.clear()
        self._asking.clear()

    def _close_listener(self) -> None:
        if self._listener is not None:
            asyncio.get_running_loop().remove_reader(self._listener)
            self._listener.close()
            self._listener = None

    def _let_in(self) -> None:
        if self._listener is None:
            return
        asyncio.get_running_loop().remove_reader(self._listener)  # until the next turn
        self._await_turn()
        for _ in range(ACCEPTS):
            try:
                connection, _ = self._listener.accept()
            except BlockingIOError:
                break
            except OSError as error:  # no file descriptors are left: who has connected waits for the next turn
                if not self._failing:
                    _log.warning("control socket fails", reason=error.strerror or str(error))
                self._failing = True
                return
            self._greet(connection)
        self._failing = False

    def _await_turn(self) -> None:
        if self._turn is None:
            self._turn = asyncio.get_running_loop().call_later(TURN_S, self._next_turn)

    def _next_turn(self) -> None:
        self._turn = None
        self._admissions = ADMISSIONS
        while self._asking and self._admissions > 0:
            self._pass_on(self._asking.popleft())
        if self._asking:
            self._await_turn()
        if self._listener is not None:
            asyncio.get_running_loop().add_reader(self._listener, self._let_in)

    def _greet(self, connection: socket.socket) -> None:
        connection.setblocking(False)
        try:
            visitor = Visitor(connection, caller_of(connection))
        except OSError:
            connection.close()
            return
        try:
            connection.send(self._hello())
        except OSError:
            self._gone(visitor)
            return
        if len(self._silent) + len(self._asking) >= MAX_WAITING:
            self._make_room()
        self._silent[visitor] = None
        asyncio.get_running_loop().add_reader(connection, self._listen, visitor)
        self._listen(visitor)

    def _gone(self, visitor: Visitor) -> None:
        """It left before it was greeted, as whoever asked a frozen daemon: of what it asked for, a stop alone still
        counts."""
        with suppress(OSError):
            visitor.said += visitor.connection.recv(MAX_LINE_BYTES)
        if visitor.says_stop:
            self._pass_on(visitor)
        else:
            visitor.connection.close()

    def _listen(self, visitor: Visitor) -> None:
        try:
            more = visitor.connection.recv(MAX_LINE_BYTES + 1 - len(visitor.said))
        except BlockingIOError:
            return
        except OSError:
            more = b""
        visitor.said += more
        if more and not visitor.has_asked:
            return
        self._silent.pop(visitor, None)
        asyncio.get_running_loop().remove_reader(visitor.connection)
        if not more:
            visitor.connection.close()
        elif self._admissions > 0 or visitor.says_stop:
            self._pass_on(visitor)
        else:
            self._asking.append(visitor)
        self._await_turn()

    def _pass_on(self, visitor: Visitor) -> None:
        self._admissions -= 1
        self._admit(visitor)

    def _make_room(self) -> None:
        """Of the process that has most connections here, who has waited longest goes."""
        waiting = [*self._silent, *self._asking]
        most = Counter(visitor.caller.pid for visitor in waiting)
        visitor = max(waiting, key=lambda each: most[each.caller.pid])
        if visitor in self._silent:
            del self._silent[visitor]
            asyncio.get_running_loop().remove_reader(visitor.connection)
        else:
            self._asking.remove(visitor)
        visitor.refuse(f"{MAX_WAITING} programs wait to be served")
