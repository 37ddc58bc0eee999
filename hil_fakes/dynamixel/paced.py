"""A serial port whose time-outs go by what the fake has done, not by the clock on the wall.

On a busy machine a fake may answer later than any motor would, and a test of a lost reply would lose others too. A
`PacedPort` gives up as soon as the fake has heard everything and has not answered, and no earlier. For fakes whose time
the test itself makes pass (no `RealTimePump`), one port open at a time.
"""

from __future__ import annotations

import select
import time
from collections.abc import Sequence

from dynamixel_sdk import PortHandler

from hil_fakes.dynamixel.bus import FakeBus

LOOK_EVERY_S = 0.001
PATIENCE_S = 60.0
"""Real time without a sign of the fake after which it is unplugged or dead."""


class PacedPort(PortHandler):  # type: ignore[misc]  # the SDK carries no types
    """`dynamixel-sdk`'s port on a FakeBus's pseudo-terminal, without its clock."""

    def __init__(self, bus: FakeBus, path: str = "", baud_rate: int = 1_000_000, _timeout_s: float = 0.0) -> None:
        super().__init__(path or bus.path)
        self.baudrate = baud_rate
        self._bus = bus
        self._to_hear = 0

    def openPort(self) -> bool:  # noqa: N802 – the SDK's names
        """Open the port and lock it against a second program. Raises serial.SerialException."""
        self._to_hear = self._bus.heard_bytes
        opened = bool(super().openPort())
        self.ser.exclusive = True
        return opened

    def closePort(self) -> None:  # noqa: N802
        """Let go of the port; safe to call when it is not open."""
        if self.ser is not None:
            self.ser.close()
        self.is_open = self.is_using = False

    def writePort(self, packet: Sequence[int]) -> int:  # noqa: N802
        written = int(super().writePort(packet))
        self._to_hear += written
        return written

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """Up to `length` bytes, as soon as there are some or the fake has nothing to answer."""
        return bytes(self.ser.read(length)) if length > 0 and self._wait() else b""

    def isPacketTimeout(self) -> bool:  # noqa: N802
        """Whether nothing more can come."""
        return not self._wait()

    def overtime(self) -> bool:
        """Never: a fake that babbles is heard to the end."""
        return False

    def drain(self) -> int:
        """Throw away what still comes; the number of bytes thrown away."""
        thrown = 0
        while self._wait():
            thrown += len(self.ser.read(max(self.ser.in_waiting, 1)))
        return thrown

    def _wait(self) -> bool:
        """Whether there are bytes, once the fake has heard all that was written."""
        end_s = time.monotonic() + PATIENCE_S
        while self._bus.plugged and self._bus.heard_bytes < self._to_hear and time.monotonic() < end_s:
            select.select([], [], [], LOOK_EVERY_S)
        return bool(select.select([self.ser.fileno()], [], [], 0.0)[0])
