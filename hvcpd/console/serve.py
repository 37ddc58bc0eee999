"""Serves the page on a port of this computer, or on a UNIX socket behind a tunnel."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import h11
import uvicorn
from starlette.types import ASGIApp

from hvcpd.daemon.control_socket import answers, listen_at
from hvcpd.errors import ConfigError

BACKLOG = 64
GRACE_S = 1
"""Time that open pages have to end when the console ends."""
SOCKET_MODE = 0o600
"""Permissions of the socket: only the user who started the console, because any client may stop and resume the
robot."""


def is_loopback(address: str) -> bool:
    """Whether only this computer can reach an address. Raises ConfigError if it is none, or stands for all.

    A page at all addresses could not tell its own name from one that was made to lead here.
    """
    try:
        given = ipaddress.ip_address(address)
    except ValueError:
        given = None
    if given is None or given.is_unspecified:
        raise ConfigError(f"--listen {address}: give one address of this computer, as 127.0.0.1")
    return given.is_loopback


@contextmanager
def open_port(address: str, port: int) -> Iterator[socket.socket]:
    """A listening socket. Raises ConfigError if it cannot be opened."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    try:
        listener = socket.create_server((address, port), family=family, backlog=BACKLOG)
    except (OSError, OverflowError) as error:
        number = getattr(error, "errno", None)  # from Python 3.11 on, the text repeats the address as a tuple
        why = os.strerror(number) if number else str(error)
        raise ConfigError(f"cannot serve a page at {address}, port {port}: {why}; choose another with --port") from None
    with listener:
        yield listener


@contextmanager
def open_file(path: Path) -> Iterator[socket.socket]:
    """A listening UNIX socket; one that nobody listens at any more is replaced. Raises ConfigError."""
    try:
        if answers(path):
            raise FileExistsError(None, "another console has that socket")
        listener = listen_at(path, SOCKET_MODE, BACKLOG)
    except OSError as error:
        raise ConfigError(f"--unix {path}: {error.strerror or error}; name another file") from None
    try:
        yield listener
    finally:
        listener.close()
        path.unlink(missing_ok=True)


def _is_ours(record: logging.LogRecord) -> bool:
    """Whether a line of the log is of a fault of ours. Where a request's body is broken, uvicorn answers it, and then
    complains that the page answers it, too."""
    return record.exc_info is None or not isinstance(record.exc_info[1], h11.LocalProtocolError)


class PageServer(uvicorn.Server):
    """Serves a page; `ready` is called once it is served, and `ending` before the server waits for open connections."""

    def __init__(self, app: ASGIApp, ready: Callable[[], object], ending: Callable[[], None] = lambda: None) -> None:
        super().__init__(
            uvicorn.Config(
                app,
                log_level="error",  # its warnings are of requests that are none, which any user here can send
                access_log=False,
                server_header=False,
                proxy_headers=False,
                ws="none",
                timeout_graceful_shutdown=GRACE_S,
            )
        )
        logging.getLogger("uvicorn.error").addFilter(_is_ours)
        self._ready, self._ending = ready, ending

    def serve_on(self, listener: socket.socket) -> None:
        """Serve until SIGINT or SIGTERM, or until `should_exit` is set."""
        asyncio.run(self.serve(sockets=[listener]))

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """As uvicorn's; then call `ready`."""
        await super().startup(sockets)
        self._ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Call `ending`, then as uvicorn's."""
        self._ending()
        await super().shutdown(sockets)
