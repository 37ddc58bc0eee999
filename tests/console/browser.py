"""A real browser without a screen, and pages for it, served from a thread of their own."""

from __future__ import annotations

import asyncio
import shutil
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Self, TypeVar

from axe_core_python.selenium import Axe
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.keys import Keys
from starlette.types import ASGIApp

from hvcpd.console.app import live_app
from hvcpd.console.guard import PageAccess
from hvcpd.console.scene import Scene
from hvcpd.console.serve import PageServer, open_port
from hvcpd.console.viewers import Viewers
from tests.console.asking import Robot, status

TAB, ENTER, ESCAPE = Keys.TAB, Keys.ENTER, Keys.ESCAPE
CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
MISSING = CHROMIUM is None or DRIVER is None
WHY = "not installed: chromium, or chromium-driver (`make parts` installs them as root)"
PATIENCE_S = 20.0
QUIET = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --autoplay-policy=no-user-gesture-required"
).split()
"""Without a screen, as root, and without looking for anything on a network."""

T = TypeVar("T")


@contextmanager
def chromium() -> Iterator[webdriver.Chrome]:
    """A browser with an empty profile."""
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM or ""
    for argument in QUIET:
        options.add_argument(argument)
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    try:
        yield driver
    finally:
        driver.quit()


def look_like(driver: webdriver.Chrome, width: int, height: int, scheme: str = "light", phone: bool = False) -> None:
    """Be a screen of this size, in this colour scheme."""
    size = {"width": width, "height": height, "deviceScaleFactor": 2 if phone else 1, "mobile": phone}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    feature = {"name": "prefers-color-scheme", "value": scheme}
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "screen", "features": [feature]})


def until(look: Callable[[], T]) -> T:
    """What `look` gives as soon as it is something: a browser draws when it likes."""
    end_s = time.monotonic() + PATIENCE_S
    while True:
        found = look()
        if found or time.monotonic() > end_s:
            assert found, "the page does not come to it"
            return found
        threading.Event().wait(0.02)


def faults(driver: webdriver.Chrome) -> list[str]:
    """The violations that axe-core finds, of any impact."""
    return [f"{v['id']}: {n['target']}" for v in Axe().run(driver)["violations"] for n in v["nodes"]]


class Served:
    """A page on a port of this computer."""

    def __init__(self, app: ASGIApp, key: str | None = None, ending: Callable[[], None] = lambda: None) -> None:
        self._ready = threading.Event()
        self._server = PageServer(app, self._ready.set, ending)
        self._key = key
        self.url = ""

    @contextmanager
    def up(self) -> Iterator[Self]:
        """Serve meanwhile."""
        with open_port("127.0.0.1", 0) as listener:
            self.url = f"http://127.0.0.1:{listener.getsockname()[1]}/" + (f"?key={self._key}" if self._key else "")
            thread = threading.Thread(target=self._serve, args=(listener,))
            thread.start()
            assert self._ready.wait(PATIENCE_S)
            try:
                yield self
            finally:
                self._server.should_exit = True
                thread.join(PATIENCE_S)

    def _serve(self, listener: socket.socket) -> None:
        self._server.serve_on(listener)


class Show(Served):
    """A live page of a robot that was made up: the test tells what happens."""

    def __init__(self) -> None:
        self.robot = Robot()
        self.scene = Scene(Viewers())
        self._loop: asyncio.AbstractEventLoop | None = None
        super().__init__(live_app(self.scene, self.robot.ask, self._run, PageAccess()), ending=self.scene.viewers.end)

    async def _run(self) -> None:
        self._loop = asyncio.get_running_loop()
        self.scene.status(status())
        self.scene.link(True, "Connected to Rob")
        await asyncio.Event().wait()

    def do(self, act: Callable[..., Any], *arguments: Any) -> None:
        """Have it done in the page's own thread, and wait for that."""
        assert self._loop is not None
        done = threading.Event()

        def run() -> None:
            act(*arguments)
            done.set()

        self._loop.call_soon_threadsafe(run)
        assert done.wait(PATIENCE_S)
