"""The contract of an OpenCR with TurtleBot3 firmware, fake or real: checks over the unmodified `dynamixel-sdk`.

Run on a robot only with its wheels off the ground. Use as `hil_fakes.dynamixel.contract`, with a `Rig` whose `ids` are
the controller's identifier twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from dynamixel_sdk import COMM_RX_TIMEOUT, COMM_SUCCESS

from hil_fakes.dynamixel.contract import Rig

MILLIS, DEBUG_MODE, HEARTBEAT, VOLTAGE, VELOCITY_LEFT, POSITION_LEFT = 10, 14, 19, 42, 128, 136
TORQUE, LINEAR_X = 149, 150
ROBOTIS_START, ROBOTIS_SIZE = 10, 172
"""The block that ROBOTIS's own node reads every 50 ms."""
SPEED = 5
"""0.05 m/s in the units of the command words."""
TICKS_PER_S = SPEED * 0.01 / (2.0 * math.pi * 0.033) * 4096


def _command(rig: Rig, linear: int) -> None:
    block = linear.to_bytes(4, "little", signed=True) + bytes(20)
    assert rig.protocol.writeTxRx(rig.port, rig.ids[0], LINEAR_X, 24, list(block)) == (COMM_SUCCESS, 0)


def _drive(rig: Rig, linear: int, seconds: float, beating: bool = True) -> None:
    """Command a speed for a while, with or without a heartbeat every 100 ms."""
    for beat in range(round(seconds / 0.1)):
        _command(rig, linear)
        if beating:
            rig.write(rig.ids[0], HEARTBEAT, 1, beat % 100 + 1)
        rig.wait(0.1)


def _rest(rig: Rig) -> None:
    _drive(rig, 0, 0.5)
    rig.wait(0.7)


def answers_a_ping_with_its_model(rig: Rig) -> None:
    """0x5000."""
    assert rig.protocol.ping(rig.port, rig.ids[0])[:2] == (0x5000, COMM_SUCCESS)


def is_silent_to_a_broadcast_ping(rig: Rig) -> None:
    """The controller does not answer a broadcast ping, so it cannot be found by searching."""
    assert rig.protocol.broadcastPing(rig.port)[0] == {}


def answers_the_read_of_robotis_own_node(rig: Rig) -> None:
    """172 bytes from 10."""
    data, result, error = rig.protocol.readTxRx(rig.port, rig.ids[0], ROBOTIS_START, ROBOTIS_SIZE)
    assert (result, error, len(data)) == (COMM_SUCCESS, 0, ROBOTIS_SIZE)


def starts_without_debug_mode(rig: Rig) -> None:
    """In debug mode it would not stop when its program dies."""
    assert rig.read(rig.ids[0], DEBUG_MODE, 1) == 0


def counts_milliseconds(rig: Rig) -> None:
    """From its start on."""
    before = rig.read(rig.ids[0], MILLIS, 4)
    rig.wait(0.5)
    assert 400 <= rig.read(rig.ids[0], MILLIS, 4) - before <= 900


def tells_its_battery(rig: Rig) -> None:
    """In hundredths of a volt."""
    assert 1000 <= rig.read(rig.ids[0], VOLTAGE, 4) <= 1300


def drives_while_its_heart_beats(rig: Rig) -> None:
    """Speed and position agree with the command."""
    rig.write(rig.ids[0], TORQUE, 1, 1)
    _drive(rig, SPEED, 1.0)
    before = rig.read(rig.ids[0], POSITION_LEFT, 4)
    _drive(rig, SPEED, 1.0)
    assert rig.read(rig.ids[0], VELOCITY_LEFT, 4) > 0
    moved = rig.read(rig.ids[0], POSITION_LEFT, 4) - before
    assert abs(moved - TICKS_PER_S) <= 0.2 * TICKS_PER_S
    _rest(rig)


def stops_when_the_heartbeat_stays_the_same(rig: Rig) -> None:
    """Although commands still come: they do not count as life."""
    rig.write(rig.ids[0], TORQUE, 1, 1)
    _drive(rig, SPEED, 1.0)
    _drive(rig, SPEED, 1.0, beating=False)
    assert abs(rig.read(rig.ids[0], VELOCITY_LEFT, 4)) <= 1
    _rest(rig)


def is_silent_to_what_it_does_not_know(rig: Rig) -> None:
    """A reg write, for example."""
    assert rig.protocol.regWriteTxRx(rig.port, rig.ids[0], LINEAR_X, 4, [0, 0, 0, 0])[0] == COMM_RX_TIMEOUT


CHECKS: tuple[Callable[[Rig], None], ...] = (
    answers_a_ping_with_its_model,
    is_silent_to_a_broadcast_ping,
    answers_the_read_of_robotis_own_node,
    starts_without_debug_mode,
    counts_milliseconds,
    tells_its_battery,
    drives_while_its_heart_beats,
    stops_when_the_heartbeat_stays_the_same,
    is_silent_to_what_it_does_not_know,
)
"""Every check of the contract."""
