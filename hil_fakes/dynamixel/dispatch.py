"""The motors' replies to one instruction on a bus; no wire, no time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from hil_fakes.dynamixel.motor import FakeMotor
from hil_fakes.dynamixel.protocol import (
    BROADCAST_ID,
    Instruction,
    Packet,
    StatusError,
    address_and_size,
    encode_fast_status,
    encode_status,
)

CLEAR_TURNS = b"\x01DXL\x22"
"""Parameters of the clear instruction for the turn count (e-Manual, Protocol 2.0, "Clear")."""


def respond(motors: Mapping[int, FakeMotor], packet: Packet) -> list[bytes]:
    """Carry out `packet` on those it is for; return their status packets in order of sending."""
    for motor in motors.values():
        motor.notice_traffic()
    match packet.instruction:
        case Instruction.SYNC_READ | Instruction.BULK_READ:
            wanted = _sync_reads if packet.instruction == Instruction.SYNC_READ else _bulk_reads
            return [_status(motor, *motor.memory.read(a, n)) for motor, a, n in wanted(motors, packet.parameters)]
        case Instruction.FAST_SYNC_READ:
            return _fast_sync_read(motors, packet.parameters)
        case Instruction.SYNC_WRITE:
            _sync_write(motors, packet.parameters)
            return []
        case Instruction.BULK_WRITE:
            _bulk_write(motors, packet.parameters)
            return []
    replies = [_single(motor, packet) for motor in _addressees(motors, packet.motor_id)]
    silent = packet.motor_id == BROADCAST_ID and packet.instruction != Instruction.PING
    return [] if silent else [reply for reply in replies if reply]


def _addressees(motors: Mapping[int, FakeMotor], motor_id: int) -> list[FakeMotor]:
    if motor_id == BROADCAST_ID:
        return [motors[key] for key in sorted(motors)]
    return [motors[motor_id]] if motor_id in motors else []


def _status(motor: FakeMotor, error: StatusError, data: bytes = b"") -> bytes:
    return encode_status(motor.motor_id, motor.error_field(error), data)


def _single(motor: FakeMotor, packet: Packet) -> bytes:
    """One motor's reply to an instruction for it; empty if its status return level keeps it silent."""
    motor_id = motor.motor_id  # a write may change it, and the reply still carries the old one
    level = motor.memory.get("status_return_level")
    error, data = _carry_out(motor, packet.instruction, packet.parameters)
    needed = 0 if packet.instruction == Instruction.PING else 1 if packet.instruction == Instruction.READ else 2
    return encode_status(motor_id, motor.error_field(error), data) if level >= needed else b""


def _carry_out(motor: FakeMotor, instruction: int, parameters: bytes) -> tuple[StatusError, bytes]:
    address, size = address_and_size(parameters)
    match instruction:
        case Instruction.PING:
            return StatusError.NONE, motor.memory.read(0, 2)[1] + motor.memory.read(6, 1)[1]
        case Instruction.READ if len(parameters) == 4:
            return motor.memory.read(address, size)
        case Instruction.WRITE if len(parameters) > 2:
            return motor.write(address, parameters[2:]), b""
        case Instruction.REG_WRITE if len(parameters) > 2:
            return motor.register(address, parameters[2:]), b""
        case Instruction.ACTION:
            return motor.act(), b""
        case Instruction.REBOOT:
            motor.reboot()
            return StatusError.NONE, b""
        case Instruction.CLEAR if parameters == CLEAR_TURNS:
            return motor.clear_turns(), b""
        case Instruction.READ | Instruction.WRITE | Instruction.REG_WRITE | Instruction.CLEAR:
            return StatusError.DATA_LENGTH, b""
    return StatusError.INSTRUCTION, b""


def _sync_reads(motors: Mapping[int, FakeMotor], parameters: bytes) -> Iterator[tuple[FakeMotor, int, int]]:
    address, size = address_and_size(parameters)
    for motor_id in parameters[4:]:
        if motor_id in motors:
            yield motors[motor_id], address, size


def _fast_sync_read(motors: Mapping[int, FakeMotor], parameters: bytes) -> list[bytes]:
    wanted = list(_sync_reads(motors, parameters))
    if not wanted or len(wanted) < len(parameters) - 4:
        return []  # each motor waits for its predecessor's part, so a missing one silences the rest
    replies = []
    for motor, address, size in wanted:
        error, data = motor.memory.read(address, size)
        replies.append((motor.motor_id, motor.error_field(error), data or bytes(size)))
    return [encode_fast_status(replies)]


def _bulk_reads(motors: Mapping[int, FakeMotor], parameters: bytes) -> Iterator[tuple[FakeMotor, int, int]]:
    for at in range(0, len(parameters) - 4, 5):
        if parameters[at] in motors:
            yield motors[parameters[at]], *address_and_size(parameters, at + 1)


def _sync_write(motors: Mapping[int, FakeMotor], parameters: bytes) -> None:
    address, size = address_and_size(parameters)
    for at in range(4, len(parameters) - size, size + 1):
        if parameters[at] in motors:
            motors[parameters[at]].write(address, parameters[at + 1 : at + 1 + size])


def _bulk_write(motors: Mapping[int, FakeMotor], parameters: bytes) -> None:
    at = 0
    while at + 5 <= len(parameters):
        address, size = address_and_size(parameters, at + 1)
        if parameters[at] in motors:
            motors[parameters[at]].write(address, parameters[at + 5 : at + 5 + size])
        at += 5 + size
