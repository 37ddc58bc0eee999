"""The page's server, and requests that are none."""

from __future__ import annotations

import socket
from urllib.parse import urlsplit

import pytest

from hvcpd.console.app import live_app
from hvcpd.console.guard import PageAccess
from hvcpd.console.scene import Scene
from hvcpd.console.viewers import Viewers
from tests.console.asking import Robot
from tests.console.browser import Served


async def nothing() -> None:
    """There is no robot to follow."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "sent",
    [
        b"\x00\xff nonsense",
        b"POST /act HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\nZZ\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\r\n",
    ],
)
def test_a_request_that_is_none_writes_nothing(sent: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    """Any user of the computer could fill the terminal of a console or a duet with tracebacks."""
    scene = Scene(Viewers())
    with Served(live_app(scene, Robot().ask, nothing, PageAccess(key="secret"))).up() as served:
        address = urlsplit(served.url)
        with socket.create_connection((address.hostname, address.port), timeout=10.0) as client:
            client.sendall(sent)
            client.shutdown(socket.SHUT_WR)
            answer = b"".join(iter(lambda: client.recv(4096), b""))
    assert answer.startswith((b"HTTP/1.1 400 ", b"HTTP/1.1 403 "))
    assert capfd.readouterr() == ("", "")
