"""Whether a ROS 1 master answers, by its XML-RPC interface (ROS wiki, "ROS/Master_API"); nothing of ROS is needed."""

from __future__ import annotations

import http.client
import os
import threading
import xmlrpc.client
from collections.abc import Callable, Mapping
from typing import Any
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

from hvcpd.errors import ConfigError

DEFAULT_URI = "http://localhost:11311"
"""Address of a master unless another is given (ROS wiki, "ROS/EnvironmentVariables")."""
ANSWER_S = 0.3
"""A master answers within milliseconds; the robot is to stand within half a second of its end."""
EVERY_S = 0.15
"""Between two questions."""
MISSES = 5
"""Number of late answers in a row, while the master's port is still open, from which on it counts as hanging: twice in
three minutes two of them were late on a busy machine. A master that has ended is noticed at once."""

NOT_RPC = (http.client.HTTPException, xmlrpc.client.Error, ExpatError, LookupError, ValueError, TypeError)
"""What `xmlrpc.client` raises for an answer that is no RPC's, be it a web page."""


class _Impatient(xmlrpc.client.Transport):
    def make_connection(self, host: str) -> http.client.HTTPConnection:  # type: ignore[override]
        return http.client.HTTPConnection(host, timeout=ANSWER_S)


def master_uri(environment: Mapping[str, str] = os.environ) -> str:
    """Where the master is to be. Raises ConfigError for what leads nowhere."""
    uri = environment.get("ROS_MASTER_URI") or DEFAULT_URI
    try:
        leads_somewhere = uri.startswith("http://") and bool(urlsplit(uri).hostname)
    except ValueError:  # of a broken IPv6 address
        leads_somewhere = False
    if not leads_somewhere:
        raise ConfigError(f"ROS_MASTER_URI is {uri!r}; it looks like {DEFAULT_URI}")
    return uri


def master_pid(uri: str) -> int:
    """The master's process. Raises OSError if none answers (TimeoutError if it is late)."""
    try:
        answer: Any = xmlrpc.client.ServerProxy(uri, transport=_Impatient()).getPid("/hvcpd")
        code, _, pid = answer
    except NOT_RPC as error:
        raise ConnectionError(f"the program that answers there is not a ROS master ({error})") from None
    if code != 1 or not isinstance(pid, int):
        raise ConnectionError("the program that answers there is not a ROS master")
    return pid


class MasterWatch:
    """Asks the master again and again, in a thread; another one in its place counts as gone, for it knows no node."""

    def __init__(self, uri: str, ask: Callable[[str], int] = master_pid, every_s: float = EVERY_S) -> None:
        self._uri = uri
        self._ask = ask
        self._every_s = every_s
        self._over = threading.Event()
        self._first: int | None = None
        self._misses = 0
        self.fault: str | None = None
        self._thread = threading.Thread(target=self._watch, name="ros-master", daemon=True)

    def start(self) -> None:
        """Begin to ask."""
        self._thread.start()

    def wait(self, timeout_s: float) -> None:
        """Wait until there is a fault, for `timeout_s` at most."""
        self._thread.join(timeout_s)

    def close(self) -> None:
        """Ask no more."""
        self._over.set()
        if self._thread.is_alive():
            self._thread.join()

    def look(self) -> None:
        """Ask once."""
        try:
            pid = self._ask(self._uri)
        except TimeoutError:
            self._misses += 1
            if self._misses >= MISSES:
                self.fault = f"the ROS master at {self._uri} does not answer"
        except OSError as error:
            self.fault = f"no ROS master at {self._uri} ({error.strerror or error})"
        else:
            self._misses = 0
            self._first = self._first or pid
            if pid != self._first:
                self.fault = f"another ROS master at {self._uri}"

    def _watch(self) -> None:
        while self.fault is None and not self._over.wait(self._every_s):
            self.look()
