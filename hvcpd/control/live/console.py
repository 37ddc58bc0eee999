"""`hvcpctl console`: a live page in the browser about a running robot, or the replay of a recorded mission."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Callable
from contextlib import closing
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from secrets import token_urlsafe
from typing import TYPE_CHECKING

from hvcpd.control.live.daemon_client import find_daemon
from hvcpd.control.output import print_note
from hvcpd.errors import ConfigError, NotDoneError, how_to_install

if TYPE_CHECKING:
    from starlette.types import ASGIApp

    from hvcpd.console.guard import PageAccess


def run(options: argparse.Namespace) -> None:
    """Serve the page until interrupted."""
    if missing := missing_parts():
        raise NotDoneError(f"the console needs {' and '.join(missing)}: {how_to_install(' '.join(missing))}")
    from hvcpd.console.guard import KEY_BYTES, PageAccess
    from hvcpd.console.serve import PageServer, is_loopback, open_file, open_port

    if options.unix is not None:
        with open_file(options.unix) as listener:
            app, end = _app(options, PageAccess())
            text = (
                f"The page is in {options.unix}; for a browser elsewhere:  ssh -L "
                f"{shlex.quote(f'8765:{options.unix.absolute()}')} "
                "THIS-COMPUTER\nand then open http://localhost:8765/ there. Ctrl-C ends it.\n"
            )
            PageServer(app, partial(sys.stdout.write, text), end).serve_on(listener)
        return
    if not is_loopback(options.listen) and not options.expose:
        raise ConfigError(
            f"--listen {options.listen}: anybody who reaches that address could see the page; for a phone or another "
            "computer use a tunnel (docs/console.md), or add --expose"
        )
    key = token_urlsafe(KEY_BYTES)
    with open_port(options.listen, options.port) as listener:
        host = f"[{options.listen}]" if ":" in options.listen else options.listen
        address = f"{host}:{listener.getsockname()[1]}"
        if options.expose:
            print_note(
                f"warning: {address} is not encrypted: anybody on that network can read the page's key and all that is "
                "said, and stop and resume the robot"
            )
        app, end = _app(options, PageAccess(frozenset({address}), key))
        text = f"Open  http://{address}/?key={key}\nCtrl-C ends it.\n"
        PageServer(app, partial(sys.stdout.write, text), end).serve_on(listener)


def missing_parts() -> list[str]:
    """The packages that the page lacks."""
    return [name for name in ("starlette", "uvicorn") if find_spec(name) is None]


def _app(options: argparse.Namespace, access: PageAccess) -> tuple[ASGIApp, Callable[[], None]]:
    """The page, and what lets its viewers go."""
    if options.replay is not None:
        from hvcpd.console.app import replay_app
        from hvcpd.console.replay import read_recording

        recording = read_recording(options.replay)
        sound = str(recording.sound) if recording.sound is not None else None
        return replay_app(recording.messages, sound, recording.title, access), lambda: None
    with closing(find_daemon(options)) as daemon:  # if there is none, or more than one, that is said at once
        path = daemon.path.absolute()
    return live_page(path, access)


def live_page(socket: Path, access: PageAccess) -> tuple[ASGIApp, Callable[[], None]]:
    """The page about the robot with that control socket, and what lets its viewers go."""
    from hvcpd.console.app import live_app
    from hvcpd.console.link import Link
    from hvcpd.console.scene import Scene
    from hvcpd.console.viewers import Viewers

    scene = Scene(Viewers())
    link = Link(socket, scene)
    return live_app(scene, link.ask, link.run, access), scene.viewers.end
