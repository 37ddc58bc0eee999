"""A control socket that answers every request, for what only has to ask."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from socketserver import StreamRequestHandler, ThreadingUnixStreamServer

from hvcpd.daemon.control_protocol import PROTOCOL


class _Obliging(StreamRequestHandler):
    def handle(self) -> None:
        with suppress(ConnectionError):  # who only looks whether somebody is there hangs up at once
            self._write({"event": "hello", "protocol": PROTOCOL, "name": "Rob"})
            for _ in self.rfile:
                self._write({"ok": True, "result": {"stopped": True, "before": False, "text": "x", "name": "x"}})
                self._write({"event": "said", "text": "x"})

    def _write(self, value: dict[str, object]) -> None:
        self.wfile.write(json.dumps(value).encode() + b"\n")


@contextmanager
def obliging_robot(folder: Path) -> Iterator[dict[str, str]]:
    """A robot Rob in that folder, with a settings file; gives the variables by which commands find him."""
    config = folder / "hvcpd.yaml"
    config.write_text("name: Rob\nstate_dir: .\n")
    with ThreadingUnixStreamServer(str(folder / "rob.sock"), _Obliging) as robot:
        thread = threading.Thread(target=robot.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield {"HVCPD_CONFIG": str(config), "XDG_RUNTIME_DIR": ""}
        finally:
            robot.shutdown()
            thread.join()
