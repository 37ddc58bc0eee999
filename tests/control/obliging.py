"""A control socket that answers requests as a test wants, for what only has to ask."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from socketserver import StreamRequestHandler, ThreadingUnixStreamServer
from typing import Any

from hvcpd.daemon.control_protocol import PROTOCOL

Answer = Callable[[dict[str, Any]], Iterable[dict[str, Any]]]
"""The lines that answer a request."""


def oblige(_request: object) -> Iterator[dict[str, Any]]:
    """An answer to any request."""
    yield {"ok": True, "result": {"stopped": True, "before": False, "text": "x", "name": "x"}}
    yield {"event": "said", "text": "x"}


class _Robot(ThreadingUnixStreamServer):
    def __init__(self, path: Path, answer: Answer) -> None:
        super().__init__(str(path), _Client)
        self.answer = answer


class _Client(StreamRequestHandler):
    server: _Robot

    def handle(self) -> None:
        with suppress(ConnectionError):  # who only looks whether somebody is there hangs up at once
            self._write({"event": "hello", "protocol": PROTOCOL, "name": "Rob"})
            for line in self.rfile:
                for answer in self.server.answer(json.loads(line)):
                    self._write(answer)

    def _write(self, value: dict[str, object]) -> None:
        self.wfile.write(json.dumps(value).encode() + b"\n")


@contextmanager
def obliging_robot(folder: Path, answer: Answer = oblige) -> Iterator[dict[str, str]]:
    """A robot Rob in that folder, with a settings file; gives the variables by which commands find him."""
    config = folder / "hvcpd.yaml"
    config.write_text("name: Rob\nstate_dir: .\n")
    with _Robot(folder / "rob.sock", answer) as robot:
        thread = threading.Thread(target=robot.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield {"HVCPD_CONFIG": str(config), "XDG_RUNTIME_DIR": ""}
        finally:
            robot.shutdown()
            thread.join()
