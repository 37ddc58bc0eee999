"""The serial port under `dynamixel-sdk`: the SDK's own port handler, but waiting instead of busy polling.

The SDK asks a port without pause whether bytes have come, which costs a whole core while a reply is under way, it
times replies by the wall clock, which may jump, and pyserial waits without end for a device that takes no bytes.
`WaitingPort` sleeps in `select`, uses the monotonic clock, and waits for no such device.
"""

from __future__ import annotations

import os
import select
import termios
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Protocol

import serial
from dynamixel_sdk import PortHandler, Protocol2PacketHandler

DRAIN_QUIET_S = 0.02
"""A line that is silent for this long holds no late reply: a USB adapter hands on its bytes every 16 ms by default
(FTDI latency timer), and the motors' own return delay is at most 0.5 ms."""

DRAIN_LIMIT_S = 0.05
"""Draining ends here even if the line babbles on: three tries with all their draining stay within the lease."""

OVERTIME_S = 0.05
"""Time beyond a reply's time for which bytes are still taken: they came in time, and only we are late to fetch them.
After that the line is babbling, and the SDK, which looks at the time only when no bytes are left, would never come
back."""


class Port(Protocol):
    """The port's interface for `dynamixel-sdk` and our bus. All methods but `closePort` may raise `PORT_ERRORS`."""

    is_open: bool
    is_using: bool

    def openPort(self) -> bool: ...  # noqa: N802 – the SDK's names

    def closePort(self) -> None: ...  # noqa: N802

    def clearPort(self) -> None: ...  # noqa: N802

    def readPort(self, length: int) -> bytes: ...  # noqa: N802

    def writePort(self, packet: Sequence[int]) -> int: ...  # noqa: N802

    def setPacketTimeout(self, packet_length: int) -> None: ...  # noqa: N802

    def setPacketTimeoutMillis(self, msec: float) -> None: ...  # noqa: N802

    def isPacketTimeout(self) -> bool: ...  # noqa: N802

    def overtime(self) -> bool:
        """Whether the reply's time has been over for so long that the line must be sending garbage."""

    def drain(self) -> int:
        """Discard input until the line is quiet; return the number of discarded bytes."""


class WaitingPort(PortHandler):  # type: ignore[misc]  # the SDK carries no types
    """A port of `dynamixel-sdk` with a reply time-out in seconds.

    Its methods raise `serial.SerialException` or `OSError` when the adapter is gone.
    """

    def __init__(self, path: str, baud_rate: int, timeout_s: float) -> None:
        super().__init__(path)
        self.baudrate = baud_rate
        self._timeout_ms = timeout_s * 1000.0
        self._reply_ms = 0.0

    def openPort(self) -> bool:  # noqa: N802 – the SDK's name
        """Open the port and lock it against a second program. Raises serial.SerialException, OSError."""
        opened = bool(super().openPort())
        if opened:
            self.ser.exclusive = True
            with suppress(ValueError, NotImplementedError, OSError):  # not every adapter's driver can
                self.ser.set_low_latency_mode(True)  # FTDI: hands on its bytes after 1 ms instead of 16 ms
        return opened

    def closePort(self) -> None:  # noqa: N802
        """Close the port; safe to call when it is not open."""
        if self.ser is not None:
            self.ser.close()
        self.is_open = False
        self.is_using = False

    def writePort(self, packet: Sequence[int]) -> int:  # noqa: N802
        """The number of bytes that are taken: 0 where a controller hangs, its USB still alive, and the kernel's buffer
        is full."""
        try:
            return os.write(self.ser.fileno(), bytes(packet))
        except BlockingIOError:
            return 0

    def getCurrentTime(self) -> float:  # noqa: N802
        """Milliseconds on a clock that never jumps."""
        return time.monotonic() * 1000.0

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: N802
        """Start waiting for a reply of `packet_length` bytes: its time on the wire and our time-out."""
        self.setPacketTimeoutMillis(self.tx_time_per_byte * packet_length + self._timeout_ms)

    def setPacketTimeoutMillis(self, msec: float) -> None:  # noqa: N802
        """Start waiting for a reply for `msec` milliseconds."""
        super().setPacketTimeoutMillis(msec)
        self._reply_ms = msec  # the SDK sets its own to zero when the time is over

    def overtime(self) -> bool:
        """Whether the reply's time has been over for so long that the line must be sending garbage."""
        return bool(self.getTimeSinceStart() > self._reply_ms + OVERTIME_S * 1000.0)

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """Up to `length` bytes; waits for the first of them until the reply's time is over."""
        left_s = (self._reply_ms - self.getTimeSinceStart()) / 1000.0
        if length <= 0 or left_s < -OVERTIME_S or not select.select([self.ser.fileno()], [], [], max(left_s, 0.0))[0]:
            return b""
        return bytes(self.ser.read(length))

    def drain(self) -> int:
        """Discard input until the line is quiet; return the number of discarded bytes."""
        thrown = 0
        end_s = time.monotonic() + DRAIN_LIMIT_S
        while time.monotonic() < end_s and select.select([self.ser.fileno()], [], [], DRAIN_QUIET_S)[0]:
            thrown += len(self.ser.read(max(self.ser.in_waiting, 1)))
        return thrown


PORT_ERRORS = (serial.SerialException, OSError, termios.error)
"""What a vanished adapter raises."""


STUFFED = bytes((0xFF, 0xFF, 0xFD, 0xFD))
UNSTUFFED = STUFFED[:3]
HEADER_SIZE, CRC_SIZE = 7, 2


class PacketHandler(Protocol2PacketHandler):  # type: ignore[misc]
    """The SDK's packet handler with its byte stuffing undone rightly.

    `dynamixel-sdk` 4.1 takes the stuffing out in place and then looks for the next one among the bytes that it has
    just moved, so that FF FF FD FF FD FD loses a byte.
    """

    def removeStuffing(self, packet: list[int]) -> list[int]:  # noqa: N802
        """The packet without stuffing, its length field corrected (e-Manual, Protocol 2.0, "Byte stuffing")."""
        end = HEADER_SIZE + (packet[HEADER_SIZE - 2] | packet[HEADER_SIZE - 1] << 8)
        body = bytes(packet[HEADER_SIZE : end - CRC_SIZE]).replace(STUFFED, UNSTUFFED)
        length = len(body) + CRC_SIZE
        return [*packet[: HEADER_SIZE - 2], length & 0xFF, length >> 8, *body, *packet[end - CRC_SIZE : end]]
