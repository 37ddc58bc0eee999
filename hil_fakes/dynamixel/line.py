"""A serial line with Dynamixel devices on it, without any port: bytes in, bytes out, and time that is made to pass."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence

from hil_fakes.dynamixel.dispatch import respond
from hil_fakes.dynamixel.faults import DELAY_S, ReplyFaults
from hil_fakes.dynamixel.motor import FakeMotor
from hil_fakes.dynamixel.opencr import FakeOpenCR
from hil_fakes.dynamixel.protocol import Packet, PacketReader

BABBLE_BYTES_S = 20_000.0
"""A babbling device fills a fifth of a line of 1,000,000 baud; assumption."""


class Line:
    """Devices and what goes wrong between them and the port. Time passes only in `advance`."""

    def __init__(self, devices: Sequence[FakeMotor | FakeOpenCR], seed: int = 0) -> None:
        if len({device.motor_id for device in devices}) < len(devices):
            raise ValueError("two motors on one bus share an identifier")
        self._devices = tuple(devices)
        for device in self._devices:
            device.seed(seed)
        self._random = random.Random(f"babble {seed}")
        self.faults = ReplyFaults()
        self.reader = PacketReader()
        self.now_s = 0.0
        self._babble_until_s = 0.0
        self._coming: list[tuple[float, bytes]] = []

    @property
    def motors(self) -> Mapping[int, FakeMotor]:
        """The motors by identifier, powered or not."""
        return {device.motor_id: device for device in self._devices if isinstance(device, FakeMotor)}

    def babble(self, duration_s: float) -> None:
        """From now on, for a while, random bytes run over the line."""
        self._babble_until_s = self.now_s + duration_s

    def hear(self, data: bytes, speed_hz: int | None) -> bytes:
        """Bytes from the port at a line speed; the bytes that come back at once."""
        wire = b""
        for packet in self.reader.feed(data):
            for reply in self._replies(packet, speed_hz):
                now, later = self.faults.apply(reply)
                wire += self._noise(len(now) / BABBLE_BYTES_S * 2.0) + now
                if later:
                    self._coming.append((self.now_s + DELAY_S, later))
        return wire

    def advance(self, dt_s: float) -> bytes:
        """Let time pass for all devices; the bytes that come meanwhile."""
        for device in self._devices:
            device.advance(dt_s)
        noise = self._noise(dt_s)
        self.now_s += dt_s
        due = b"".join(data for at_s, data in self._coming if at_s <= self.now_s)
        due += b"".join(device.collect() for device in self._devices if isinstance(device, FakeOpenCR))
        self._coming = [(at_s, data) for at_s, data in self._coming if at_s > self.now_s]
        return noise + due

    def _replies(self, packet: Packet, speed_hz: int | None) -> list[bytes]:
        there = [d for d in self._devices if d.powered and d.baud_rate_hz in (speed_hz, 0)]
        replies = respond({d.motor_id: d for d in there if isinstance(d, FakeMotor)}, packet)
        for device in there:
            if isinstance(device, FakeOpenCR):
                replies += device.respond(packet)
        return replies

    def _noise(self, dt_s: float) -> bytes:
        share_s = min(dt_s, self._babble_until_s - self.now_s)
        return self._random.randbytes(round(share_s * BABBLE_BYTES_S)) if share_s > 0.0 else b""
