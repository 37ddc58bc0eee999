"""Whether a master answers: against a small XML-RPC server, and with scripted answers."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest

from hvcpd.errors import ConfigError
from hvcpd.ros.master import DEFAULT_URI, MISSES, MasterWatch, master_pid, master_uri


class Server(SimpleXMLRPCServer):
    """Answers `getPid` with a value or, word for word, with bytes."""

    def __init__(self, answer: object) -> None:
        super().__init__(("127.0.0.1", 0), SimpleXMLRPCRequestHandler, logRequests=False)
        self._answer = answer
        self.register_function(lambda caller: answer, "getPid")

    def _marshaled_dispatch(self, *arguments: Any, **options: Any) -> Any:
        return self._answer if isinstance(self._answer, bytes) else super()._marshaled_dispatch(*arguments, **options)


@contextmanager
def server(answer: object) -> Iterator[str]:
    """Something that answers `getPid` like that."""
    with Server(answer) as there:
        thread = threading.Thread(target=there.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield f"http://127.0.0.1:{there.server_address[1]}"
        finally:
            there.shutdown()
            thread.join()


def test_a_master_tells_its_process() -> None:
    with server([1, "", 4711]) as uri:
        assert master_pid(uri) == 4711


@pytest.mark.parametrize("answer", [[0, "no", 1], [1, "", "pid"], "hello", 5, [1, 2]])
def test_what_answers_otherwise_is_no_master(answer: object) -> None:
    with server(answer) as uri, pytest.raises(ConnectionError, match="not a ROS master"):
        master_pid(uri)


PAIRS = b"<methodResponse><params><value><struct><value>name</value></struct></value></params></methodResponse>"


@pytest.mark.parametrize(
    "answer", [b"<html>Hello", b"", b"<?xml version='1.0' encoding='none'?><a/>", b"<a></b>", PAIRS]
)
def test_what_answers_in_no_xml_of_rpc_is_no_master(answer: bytes) -> None:
    """A traceback ended the bridge or, later, its watch alone: a master that ended then was never noticed."""
    with server(answer) as uri, pytest.raises(ConnectionError, match="not a ROS master"):
        master_pid(uri)


def test_where_nobody_listens_there_is_no_master() -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        uri = f"http://127.0.0.1:{probe.getsockname()[1]}"
    with pytest.raises(OSError, match="refused"):
        master_pid(uri)


def test_a_master_that_hangs_is_late() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent, pytest.raises(TimeoutError):
        master_pid(f"http://127.0.0.1:{silent.getsockname()[1]}")


def scripted(*answers: int | OSError) -> Callable[[str], int]:
    left = list(answers)

    def ask(_: str) -> int:
        answer = left.pop(0)
        if isinstance(answer, OSError):
            raise answer
        return answer

    return ask


def fault_after(*answers: int | OSError) -> str | None:
    watch = MasterWatch("http://there", scripted(*answers))
    for _ in answers:
        watch.look()
    return watch.fault


def test_a_master_is_gone_when_nobody_listens_or_another_is_there() -> None:
    assert fault_after(5, 5, 5) is None
    assert "no ROS master at http://there" in (fault_after(5, ConnectionRefusedError(111, "refused")) or "")
    assert "another" in (fault_after(5, 6) or "")


def test_one_late_answer_is_forgiven_and_more_are_not() -> None:
    late = TimeoutError("late")
    assert fault_after(5, *[late] * (MISSES - 1), 5, *[late] * (MISSES - 1)) is None
    assert "does not answer" in (fault_after(5, *[late] * MISSES) or "")


def test_the_watch_notices_it_by_itself() -> None:
    watch = MasterWatch("http://there", scripted(5, 5, ConnectionRefusedError(111, "refused")), every_s=0.001)
    watch.start()
    watch.wait(10.0)
    assert watch.fault is not None
    watch.close()


def test_the_environment_says_where_it_is() -> None:
    assert master_uri({}) == DEFAULT_URI
    assert master_uri({"ROS_MASTER_URI": "http://robot:11311"}) == "http://robot:11311"


@pytest.mark.parametrize("uri", ["localhost:11311", "http://", "http://[1"])
def test_a_place_that_is_none_is_not_waited_for(uri: str) -> None:
    with pytest.raises(ConfigError, match="it looks like http://localhost:11311"):
        master_uri({"ROS_MASTER_URI": uri})
