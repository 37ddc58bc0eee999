"""Motors behind a pseudo-terminal: to the software under test a serial port like any other.

One thread answers requests as soon as they come. Motor time passes only in `FakeBus.advance`, so a simulation in
virtual time is deterministic: between two advances the motors answer the same, however often they are asked. An
instruction that nobody answers (a sync write) is sure to have arrived once a later one was answered.

    with FakeBus(turtlebot3_pair(), seed=1) as bus:
        software_under_test(port=bus.path)
        bus.advance(0.02)
        assert bus.motors[1].true_angle_rad > 0.0
"""

from __future__ import annotations

import os
import select
import tempfile
import termios
import threading
import tty
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from hil_fakes.dynamixel.line import Line
from hil_fakes.dynamixel.motor import FakeMotor
from hil_fakes.dynamixel.opencr import FakeOpenCR

READ_SIZE = 4096
"""Bytes taken from the pseudo-terminal at once: the size of its buffer on Linux."""

_SPEEDS_HZ = {
    getattr(termios, name): int(name[1:]) for name in dir(termios) if name.startswith("B") and name[1:].isdigit()
}


class FakeBus:
    """Several devices on one line. `path` is the port to open; it stays the same when the adapter is replugged.

    Without a `path` of its own the port gets one in a directory for it alone.
    """

    def __init__(self, devices: Sequence[FakeMotor | FakeOpenCR], seed: int = 0, path: Path | None = None) -> None:
        self.line = Line(devices, seed)
        self.faults, self.reader = self.line.faults, self.line.reader
        """The faults of the next replies; the packets that the devices decoded, with counters."""
        self._lock = threading.Condition()
        self._directory = tempfile.TemporaryDirectory(prefix="fake-dynamixel-")
        self.path = str(path or Path(self._directory.name) / "tty")
        self._master = self._slave = -1
        self._wake_read, self._wake_write = os.pipe()
        self.heard_bytes = 0
        """Of all that was written to the port so far; each is answered, if at all, before it is counted."""
        self._thread: threading.Thread | None = None
        self.replug()

    def __enter__(self) -> FakeBus:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def motors(self) -> Mapping[int, FakeMotor]:
        """The motors by identifier, powered or not."""
        return self.line.motors

    @property
    def plugged(self) -> bool:
        """Whether the adapter is in its socket."""
        return self._thread is not None

    @property
    def caught_up(self) -> bool:
        """Whether nothing that was written to the port waits to be heard."""
        return not select.select([self._master], [], [], 0.0)[0]

    def advance(self, dt_s: float) -> None:
        """Let the devices' time pass; may be called from any thread."""
        with self._lock:
            wire = self.line.advance(dt_s)
            if wire and self._thread is not None:
                self._send(wire)

    def wait_until(self, condition: Callable[[], bool], timeout_s: float = 5.0) -> bool:
        """Wait until what the motors hear makes `condition` true, at most `timeout_s` of real time; whether it is.

        For instructions that nobody answers: their bytes pass through the kernel and the bus's own thread.
        """
        with self._lock:
            return self._lock.wait_for(condition, timeout_s)

    def unplug(self) -> None:
        """Pull the adapter out of its socket: the port vanishes, the motors keep their power."""
        if self._thread is None:
            return
        os.write(self._wake_write, b"x")
        self._thread.join()
        self._thread = None
        os.close(self._slave)
        os.close(self._master)
        Path(self.path).unlink()

    def replug(self) -> None:
        """Plug the adapter in again; the port comes back under the same name."""
        if self._thread is not None:
            return
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        port = Path(self.path)
        if port.is_symlink():  # of one that was killed
            port.unlink()
        port.symlink_to(os.ttyname(self._slave))
        self._thread = threading.Thread(target=self._serve, name="fake-dynamixel", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread and remove the port; safe to call twice."""
        if self._wake_write < 0:
            return
        self.unplug()
        os.close(self._wake_read)
        os.close(self._wake_write)
        self._wake_read = self._wake_write = -1
        self._directory.cleanup()

    def _serve(self) -> None:
        poller = select.poll()
        poller.register(self._master, select.POLLIN)
        poller.register(self._wake_read, select.POLLIN)
        while True:
            ready = dict(poller.poll())
            if self._wake_read in ready:
                os.read(self._wake_read, 1)
                return
            try:
                self._answer(os.read(self._master, READ_SIZE))
            except BlockingIOError:
                continue  # the software flushed its output, or does not read its input: bytes are lost as on a wire

    def _answer(self, data: bytes) -> None:
        with self._lock:
            wire = self.line.hear(data, _SPEEDS_HZ.get(termios.tcgetattr(self._master)[5]))
            if wire:
                self._send(wire)
            self.heard_bytes += len(data)
            self._lock.notify_all()

    def _send(self, wire: bytes) -> None:
        with suppress(BlockingIOError):  # nobody reads, and the kernel's buffer is full: lost as on a wire
            os.write(self._master, wire)
