"""A signal that ends `hvcpctl` leaves no process and no folder."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hvcpd.control.ending import ENDING, ending_in_order

WAITS = """
import signal, socket, tempfile
from hvcpd.control.ending import ending_in_order
with ending_in_order(), tempfile.TemporaryDirectory():
    told, tells = socket.socketpair()
    tells.setblocking(False)
    signal.set_wakeup_fd(tells.fileno())
    print("in it", flush=True)
    told.recv(1)
"""
"""After signal.pause() it slept for ever if the signal came just before."""


@contextmanager
def waiting(folder: Path, ignores: bool = False) -> Iterator[subprocess.Popen[str]]:
    """A process within a temporary folder in `folder`; `ignores`: it was started as by nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN) if ignores else None
    command, environment = [sys.executable, "-c", WAITS], {**os.environ, "TMPDIR": str(folder)}
    try:
        with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == "in it\n"
            yield process
    finally:
        if before is not None:
            signal.signal(signal.SIGHUP, before)


@pytest.mark.slow
@pytest.mark.parametrize("number", ENDING)
def test_a_signal_ends_it_as_ever_but_leaves_no_folder(number: signal.Signals, tmp_path: Path) -> None:
    with waiting(tmp_path) as process:
        assert len(list(tmp_path.iterdir())) == 1
        process.send_signal(number)
        assert process.wait(60.0) == -number
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_hangup_that_is_ignored_stays_so(tmp_path: Path) -> None:
    with waiting(tmp_path, ignores=True) as process:
        process.send_signal(signal.SIGHUP)
        process.send_signal(signal.SIGTERM)
        assert process.wait(60.0) == -signal.SIGTERM


def test_who_takes_a_request_to_end_takes_a_hangup_as_one() -> None:
    """The console's server showed a traceback of its libraries."""
    taken: list[int] = []
    outside = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # ignored, where the tests run under nohup
    with ending_in_order():
        before = signal.signal(signal.SIGTERM, lambda number, _: taken.append(number))
        signal.raise_signal(signal.SIGHUP)
        signal.signal(signal.SIGTERM, before)
    signal.signal(signal.SIGHUP, outside)
    assert taken == [signal.SIGTERM]


def test_afterwards_signals_are_as_before() -> None:
    before = [signal.getsignal(number) for number in ENDING]
    with ending_in_order():
        assert [signal.getsignal(number) for number in ENDING] != before
    assert [signal.getsignal(number) for number in ENDING] == before


@pytest.mark.slow
def test_a_benchmark_that_is_ended_leaves_no_work_behind(tmp_path: Path) -> None:
    """Its folder stayed in /tmp, and what it measured ran on."""
    command = [sys.executable, "-m", "hvcpd.control.cli", "bench"]
    with subprocess.Popen(command, env={**os.environ, "TMPDIR": str(tmp_path)}, start_new_session=True) as bench:
        while not list(tmp_path.glob("hvcpd-bench-*/*")):  # the work has begun
            assert bench.poll() is None
        bench.terminate()
        assert bench.wait(60.0) == -signal.SIGTERM
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ProcessLookupError):
        os.killpg(bench.pid, 0)
