"""Faults of replies on the wire, in the order that a test schedules."""

from __future__ import annotations

from collections import deque
from enum import Enum


class ReplyFault(Enum):
    """The fate of one status packet."""

    NONE = "none"
    """The reply arrives as it was sent."""
    DROP = "drop"
    """The reply never arrives."""
    CORRUPT = "corrupt"
    """One bit is flipped, so that its CRC is wrong."""
    LATE = "late"
    """The reply arrives only together with the next one, before it."""
    DELAY = "delay"
    """The reply arrives by itself, but only after `DELAY_S`: later than any driver waits."""
    NOISE = "noise"
    """Bytes that belong to no packet come before it."""


DELAY_S = 0.060
"""Longer than the 34 ms that `dynamixel-sdk` waits."""

NOISE_BYTES = bytes((0x00, 0xFF, 0xFF, 0x5A, 0xFD, 0xFF))
"""Line noise with pieces of a header in it."""


class ReplyFaults:
    """A queue of faults: each status packet takes the next one; without any, all is well."""

    def __init__(self) -> None:
        self._queue: deque[ReplyFault] = deque()
        self._late = b""

    def schedule(self, *faults: ReplyFault) -> None:
        """Apply these to the next status packets, one each."""
        self._queue.extend(faults)

    def clear(self) -> None:
        """From now on all is well."""
        self._queue.clear()
        self._late = b""

    @property
    def pending(self) -> int:
        """Faults that no status packet has met yet."""
        return len(self._queue)

    def apply(self, reply: bytes) -> tuple[bytes, bytes]:
        """The bytes that reach the wire instead of `reply`: those at once, and those after `DELAY_S`."""
        late, self._late = self._late, b""
        match self._queue.popleft() if self._queue else ReplyFault.NONE:
            case ReplyFault.DROP:
                return late, b""
            case ReplyFault.CORRUPT:
                return late + reply[:-3] + bytes((reply[-3] ^ 0x10,)) + reply[-2:], b""
            case ReplyFault.LATE:
                self._late = reply
                return late, b""
            case ReplyFault.DELAY:
                return late, reply
            case ReplyFault.NOISE:
                return late + NOISE_BYTES + reply, b""
            case _:
                return late + reply, b""
