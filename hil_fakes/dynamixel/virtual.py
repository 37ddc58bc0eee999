"""The line without a pseudo-terminal: a port in memory on a virtual clock, so that a time-out costs no time.

Everything that is written is heard at once; to wait for a reply that does not come makes the devices' time pass. The
port has the methods that `dynamixel-sdk`'s packet handlers call, so those run unmodified on it.
"""

from __future__ import annotations

import errno
from collections.abc import Callable, Sequence

from hil_fakes.dynamixel.line import Line

WIRE_BITS = 10
"""A byte on a serial line: start bit, eight bits, stop bit."""
QUIET_S = 0.02
"""Wait of `drain` after the last byte."""


class VirtualTime:
    """A clock in s that moves only when it is told to, and moves all that hang on it."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self._followers: list[Callable[[float], None]] = []

    def __call__(self) -> float:
        return self.now_s

    def follow(self, follower: Callable[[float], None]) -> None:
        """Have `follower(dt_s)` called whenever time passes."""
        self._followers.append(follower)

    def advance(self, dt_s: float) -> None:
        """Let `dt_s` seconds pass."""
        self.now_s += dt_s
        for follower in self._followers:
            follower(dt_s)


class VirtualPort:
    """One end of a line. `plugged` False: the adapter is out of its socket. Raises OSError then, as a real one."""

    def __init__(self, line: Line, time: VirtualTime, baud_rate: int, timeout_s: float) -> None:
        self.is_open = False
        self.is_using = False
        self.plugged = True
        self._line = line
        self._time = time
        self._baud_rate = baud_rate
        self._timeout_s = timeout_s
        self._inbox = bytearray()
        self._start_s = 0.0
        self._limit_s = 0.0
        time.follow(self._pass)

    def _pass(self, dt_s: float) -> None:
        wire = self._line.advance(dt_s)
        if self.is_open and self.plugged:
            self._inbox += wire

    def inject(self, data: bytes) -> None:
        """Have these bytes come next, as noise on the line would."""
        self._inbox += data

    def _check(self) -> None:
        if not self.plugged:
            raise OSError(errno.EIO, "the adapter is unplugged")

    def openPort(self) -> bool:  # noqa: N802 – the SDK's names
        if not self.plugged:
            raise FileNotFoundError(errno.ENOENT, "no such port")
        self.is_open = True
        self._inbox.clear()
        return True

    def closePort(self) -> None:  # noqa: N802
        self.is_open = False
        self.is_using = False

    def clearPort(self) -> None:  # noqa: N802
        self._check()
        self._inbox.clear()

    def writePort(self, packet: Sequence[int]) -> int:  # noqa: N802
        self._check()
        self._inbox += self._line.hear(bytes(packet), self._baud_rate)
        return len(packet)

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """Up to `length` bytes; without any, time passes until one comes or the reply's time is over."""
        self._check()
        while not self._inbox and length > 0 and not self.isPacketTimeout():
            self._time.advance(min(self._left_s(), 0.01) + 1e-6)
        data = bytes(self._inbox[: max(length, 0)])
        del self._inbox[: len(data)]
        return data

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: N802
        self.setPacketTimeoutMillis((packet_length * WIRE_BITS / self._baud_rate + self._timeout_s) * 1000.0)

    def setPacketTimeoutMillis(self, msec: float) -> None:  # noqa: N802
        self._start_s = self._time.now_s
        self._limit_s = msec / 1000.0

    def isPacketTimeout(self) -> bool:  # noqa: N802
        return self._left_s() <= 0.0

    def overtime(self) -> bool:
        """Never: bytes in memory are fetched as soon as they are there."""
        return False

    def drain(self) -> int:
        """Throw away what comes until the line is quiet for a while; the number of bytes thrown away."""
        self._check()
        thrown = len(self._inbox)
        self._inbox.clear()
        self._time.advance(QUIET_S)
        thrown += len(self._inbox)
        self._inbox.clear()
        return thrown

    def _left_s(self) -> float:
        return self._start_s + self._limit_s - self._time.now_s
