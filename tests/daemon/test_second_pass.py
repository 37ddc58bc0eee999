"""A second pass in a thread: what it finds comes back, and too much is refused."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from structlog.testing import capture_logs

from hvcpd.daemon.second_pass import MOST_WAITING, SecondPass
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.stages import Segment

SENTENCE = Recognised(("stop",), "stranger", 0, 100, 0.9, 20.0, ())


def segment() -> Segment:
    return Segment(np.zeros(100, np.float32), 0, 0, 100)


class Gate:
    """Looks when it is let, and tells in which thread it did."""

    def __init__(self) -> None:
        self.open = threading.Event()
        self.thread = ""

    def prepare(self, _go_on: Callable[[], bool]) -> None:
        pass

    def search(self, _segment: Segment) -> Recognised | None:
        self.open.wait(5.0)
        self.thread = threading.current_thread().name
        return SENTENCE


class Broken:
    def prepare(self, _go_on: Callable[[], bool]) -> None:
        pass

    def search(self, _segment: Segment) -> Recognised | None:
        raise ImportError("no such library")


async def test_what_was_found_comes_back_from_another_thread() -> None:
    work, gate, one = SecondPass(None), Gate(), segment()
    assert work.submit(one, gate.search)
    assert list(work.results()) == []
    gate.open.set()
    await work.settled()
    assert list(work.results()) == [(one, SENTENCE)]
    assert gate.thread.startswith("second-pass")
    assert list(work.results()) == []
    await work.close()


async def test_no_more_wait_than_can_be_told_in_time() -> None:
    work, gate = SecondPass(None), Gate()
    assert all(work.submit(segment(), gate.search) for _ in range(MOST_WAITING))
    assert not work.submit(segment(), gate.search)
    gate.open.set()
    await work.settled()
    assert len(work.results()) == MOST_WAITING
    assert work.submit(segment(), gate.search)
    await work.close()


async def test_a_look_that_fails_finds_nothing() -> None:
    work, one = SecondPass(None), segment()
    assert work.submit(one, Broken().search)
    await work.settled()
    assert list(work.results()) == [(one, None)]
    await work.close()


async def test_a_pool_that_takes_nothing_is_replaced_and_reported() -> None:
    """As one does that can start no thread."""
    closed = ThreadPoolExecutor(1)
    closed.shutdown()
    pools = iter((closed, closed, ThreadPoolExecutor(1)))
    with capture_logs() as logs:
        work, gate, found = SecondPass(None, lambda: next(pools)), Gate(), segment()
        gate.open.set()
        assert not work.submit(segment(), gate.search)
        assert not work.submit(segment(), gate.search), "the robot lives without"
        assert work.submit(found, gate.search)
        await work.settled()
        assert list(work.results()) == [(found, SENTENCE)]
        await work.close()
    assert [line["event"] for line in logs if line["log_level"] == "warning"] == ["second pass restarted"] * 2
