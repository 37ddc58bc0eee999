"""Dynamixel Protocol 2.0 as a motor sees it: bytes in, instructions out; replies to bytes.

Source: ROBOTIS e-Manual, "Protocol 2.0" and "CRC calculation". This codec shares nothing with `dynamixel-sdk`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

HEADER = b"\xff\xff\xfd\x00"
BROADCAST_ID = 0xFE
STATUS = 0x55

CRC_POLYNOMIAL = 0x8005
"""e-Manual: CRC-16 of 0x8005, most significant bit first, start value 0, nothing reflected."""

MAX_LENGTH = 1024
"""A longer length field is taken for noise, so that a damaged one cannot make the motor deaf for long."""

OVERHEAD = 7
"""Bytes before the instruction: header (4), identifier (1), length (2)."""


class Instruction(IntEnum):
    """Instruction codes of Protocol 2.0."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    REBOOT = 0x08
    CLEAR = 0x10
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83
    FAST_SYNC_READ = 0x8A
    BULK_READ = 0x92
    BULK_WRITE = 0x93


class StatusError(IntEnum):
    """Error numbers in bits 0 to 6 of a status packet's error field."""

    NONE = 0
    RESULT_FAIL = 1
    INSTRUCTION = 2
    CRC = 3
    DATA_RANGE = 4
    DATA_LENGTH = 5
    DATA_LIMIT = 6
    ACCESS = 7


ALERT = 0x80
"""Bit 7 of the error field: the hardware error status is not zero."""


@dataclass(frozen=True)
class Packet:
    """One instruction as received: whom it is for, what to do, and its parameters without stuffing."""

    motor_id: int
    instruction: int
    parameters: bytes = b""


def address_and_size(parameters: bytes, at: int = 0) -> tuple[int, int]:
    """The two numbers of 16 bits at that place, as instructions have them."""
    return int.from_bytes(parameters[at : at + 2], "little"), int.from_bytes(parameters[at + 2 : at + 4], "little")


def _crc_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        register = byte << 8
        for _ in range(8):
            register = (register << 1) ^ (CRC_POLYNOMIAL if register & 0x8000 else 0)
        table.append(register & 0xFFFF)
    return tuple(table)


_CRC_TABLE = _crc_table()


def crc16(data: bytes) -> int:
    """The CRC-16 of `data`, 0 to 65535."""
    register = 0
    for byte in data:
        register = ((register & 0xFF) << 8) ^ _CRC_TABLE[(register >> 8) ^ byte]
    return register


def stuff(body: bytes) -> bytes:
    """Put 0xFD after every FF FF FD, so that no header appears inside a packet."""
    return body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")


def unstuff(body: bytes) -> bytes:
    """Undo `stuff`."""
    return body.replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")


def encode(motor_id: int, body: bytes) -> bytes:
    """A whole packet from its instruction and parameters: header, stuffing, length and CRC added."""
    stuffed = stuff(body)
    packet = HEADER + bytes((motor_id,)) + (len(stuffed) + 2).to_bytes(2, "little") + stuffed
    return packet + crc16(packet).to_bytes(2, "little")


def encode_status(motor_id: int, error: int, parameters: bytes = b"") -> bytes:
    """A motor's reply."""
    return encode(motor_id, bytes((STATUS, error)) + parameters)


def encode_fast_status(replies: list[tuple[int, int, bytes]]) -> bytes:
    """The single joint reply to a fast sync read, from (identifier, error, data) of each motor in order.

    Each motor adds error, identifier, data and the CRC of all that went before it; `dynamixel-sdk` looks at the last.
    """
    length = 1 + sum(len(data) + 4 for _, _, data in replies)
    packet = HEADER + bytes((BROADCAST_ID,)) + (length).to_bytes(2, "little") + bytes((STATUS,))
    for motor_id, error, data in replies:
        packet += bytes((error, motor_id)) + data
        packet += crc16(packet).to_bytes(2, "little")
    return packet


class PacketReader:
    """Finds instruction packets in a stream of bytes that may come in any portions, with noise between them."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.crc_errors = 0
        """Packets dropped because their CRC was wrong."""
        self.noise_bytes = 0
        """Bytes that belonged to no packet."""

    def feed(self, data: bytes) -> list[Packet]:
        """Take in bytes; return the packets that they complete."""
        self._buffer += data
        packets = []
        while self._skip_to_header():
            length = int.from_bytes(self._buffer[5:7], "little")
            if not 3 <= length <= MAX_LENGTH:
                self._skip(1)
                continue
            if len(self._buffer) < OVERHEAD + length:
                break
            packet = self._take(OVERHEAD + length)
            if packet is not None:
                packets.append(packet)
        return packets

    def _skip_to_header(self) -> bool:
        """Drop noise; True if a header with its length field stands at the start of the buffer."""
        start = self._buffer.find(HEADER)
        if start < 0:
            keep = min(len(self._buffer), len(HEADER) - 1)
            self._skip(len(self._buffer) - keep)
            return False
        self._skip(start)
        return len(self._buffer) >= OVERHEAD

    def _skip(self, count: int) -> None:
        self.noise_bytes += count
        del self._buffer[:count]

    def _take(self, size: int) -> Packet | None:
        raw = bytes(self._buffer[:size])
        if crc16(raw[:-2]) != int.from_bytes(raw[-2:], "little"):
            self.crc_errors += 1
            self._skip(1)  # the length itself may be damaged: look for the next header inside
            return None
        del self._buffer[:size]
        body = unstuff(raw[OVERHEAD:-2])
        if raw[7] == STATUS:  # a motor's own reply or another's, echoed on the half-duplex line
            return None
        return Packet(raw[4], body[0], body[1:])
