"""The contract of a wheel motor, fake or real: checks over the unmodified `dynamixel-sdk`.

Run on a robot only with its wheels off the ground. Each check leaves the motors at standstill without torque. In
your own test suite:

    @pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
    def test_contract(rig, check):
        check(rig)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from dynamixel_sdk import COMM_RX_TIMEOUT, COMM_SUCCESS, GroupBulkRead, GroupSyncRead, GroupSyncWrite

from hil_fakes.dynamixel.control_table import MODEL_NUMBER

OPERATING_MODE, TORQUE, WATCHDOG, GOAL, VELOCITY, POSITION = 11, 64, 98, 104, 128, 132
VOLTAGE, TEMPERATURE, PRESENT = 144, 146, 128
RESULT_FAIL, DATA_RANGE, DATA_LENGTH, DATA_LIMIT, ACCESS = 1, 4, 5, 6, 7
UNUSED_ID = 77

SPEED_UNITS = 100
"""22.9 rev/min: clearly moving, and far from the limit."""
SPEED_TOLERANCE_UNITS = 10
TICKS_PER_UNIT_S = 0.229 / 60.0 * 4096


@dataclass(frozen=True)
class Rig:
    """Two motors to try: the SDK's open port and packet handler, and how to let time pass."""

    port: Any
    protocol: Any
    ids: tuple[int, int]
    wait: Callable[[float], None]
    """Waits the given time in s: `FakeBus.advance`, or real time on a robot."""

    def write(self, motor_id: int, address: int, size: int, value: int) -> tuple[int, int]:
        """Write a register; the SDK's result and the motor's error number."""
        result, error = self.protocol.writeTxRx(
            self.port, motor_id, address, size, list(value.to_bytes(size, "little", signed=value < 0))
        )
        return int(result), int(error) & 0x7F

    def read(self, motor_id: int, address: int, size: int) -> int:
        """Read a signed register; an AssertionError if it does not come."""
        data, result, error = self.protocol.readTxRx(self.port, motor_id, address, size)
        assert (result, error & 0x7F) == (COMM_SUCCESS, 0)
        return int.from_bytes(bytes(data), "little", signed=True)

    def ready(self) -> None:
        """Both motors in velocity mode under torque at standstill."""
        for motor_id in self.ids:
            for address, size, value in ((TORQUE, 1, 0), (WATCHDOG, 1, 0), (OPERATING_MODE, 1, 1), (GOAL, 4, 0)):
                assert self.write(motor_id, address, size, value) == (COMM_SUCCESS, 0)
            assert self.write(motor_id, TORQUE, 1, 1) == (COMM_SUCCESS, 0)

    def rest(self) -> None:
        """Both motors at standstill without torque."""
        for motor_id in self.ids:
            self.write(motor_id, TORQUE, 1, 0)
            self.write(motor_id, WATCHDOG, 1, 0)
            self.write(motor_id, GOAL, 4, 0)
        self.wait(0.5)


def answers_a_ping_with_its_model(rig: Rig) -> None:
    """The ping answers with the model number."""
    for motor_id in rig.ids:
        assert rig.protocol.ping(rig.port, motor_id)[:2] == (MODEL_NUMBER, COMM_SUCCESS)


def is_silent_for_another_id(rig: Rig) -> None:
    """Nobody answers in another's name."""
    assert rig.protocol.ping(rig.port, UNUSED_ID)[1] == COMM_RX_TIMEOUT


def locks_its_eeprom_under_torque(rig: Rig) -> None:
    """The operating mode lies in the EEPROM."""
    rig.ready()
    assert rig.write(rig.ids[0], OPERATING_MODE, 1, 3) == (COMM_SUCCESS, ACCESS)
    assert rig.read(rig.ids[0], OPERATING_MODE, 1) == 1
    rig.rest()


def refuses_to_write_what_it_measures(rig: Rig) -> None:
    """The present position is read-only."""
    assert rig.write(rig.ids[0], POSITION, 4, 0) == (COMM_SUCCESS, ACCESS)


def refuses_half_a_register(rig: Rig) -> None:
    """Two bytes of a goal velocity's four."""
    assert rig.write(rig.ids[0], GOAL, 2, 10) == (COMM_SUCCESS, DATA_LENGTH)


def refuses_a_speed_beyond_its_limit(rig: Rig) -> None:
    """The velocity limit is at most 1023."""
    rig.ready()
    error = rig.write(rig.ids[0], GOAL, 4, 1024)[1]
    assert error in (DATA_LIMIT, DATA_RANGE)
    assert rig.read(rig.ids[0], GOAL, 4) == 0
    rig.rest()


def refuses_a_watchdog_beyond_its_range(rig: Rig) -> None:
    """-1 is a state, not a setting."""
    assert rig.write(rig.ids[0], WATCHDOG, 1, -1) == (COMM_SUCCESS, DATA_RANGE)


def turns_at_the_goal_velocity(rig: Rig) -> None:
    """Both ways; position and velocity agree."""
    rig.ready()
    for goal in (SPEED_UNITS, -SPEED_UNITS):
        rig.write(rig.ids[0], GOAL, 4, goal)
        rig.wait(1.0)
        before = rig.read(rig.ids[0], POSITION, 4)
        rig.wait(1.0)
        assert abs(rig.read(rig.ids[0], VELOCITY, 4) - goal) <= SPEED_TOLERANCE_UNITS
        moved = rig.read(rig.ids[0], POSITION, 4) - before
        assert abs(moved - goal * TICKS_PER_UNIT_S) <= 0.15 * abs(goal * TICKS_PER_UNIT_S)
    rig.rest()


def takes_sync_write_and_sync_read(rig: Rig) -> None:
    """One request for both motors."""
    rig.ready()
    group = GroupSyncWrite(rig.port, rig.protocol, GOAL, 4)
    for motor_id in rig.ids:
        group.addParam(motor_id, list(SPEED_UNITS.to_bytes(4, "little")))
    assert group.txPacket() == COMM_SUCCESS
    assert rig.read(rig.ids[1], GOAL, 4) == SPEED_UNITS  # nobody answers a sync write, so ask
    rig.wait(1.0)
    reader = GroupSyncRead(rig.port, rig.protocol, PRESENT, 8)
    for motor_id in rig.ids:
        reader.addParam(motor_id)
    assert reader.txRxPacket() == COMM_SUCCESS
    for motor_id in rig.ids:
        assert abs(reader.getData(motor_id, VELOCITY, 4) - SPEED_UNITS) <= SPEED_TOLERANCE_UNITS
    rig.rest()


def takes_a_bulk_read(rig: Rig) -> None:
    """Another register of each motor."""
    reader = GroupBulkRead(rig.port, rig.protocol)
    reader.addParam(rig.ids[0], VOLTAGE, 2)
    reader.addParam(rig.ids[1], TEMPERATURE, 1)
    assert reader.txRxPacket() == COMM_SUCCESS
    assert 60 <= reader.getData(rig.ids[0], VOLTAGE, 2) <= 140
    assert 0 < reader.getData(rig.ids[1], TEMPERATURE, 1) < 80


def acts_on_a_registered_write(rig: Rig) -> None:
    """Reg write waits for the action instruction."""
    rig.ready()
    payload = list(SPEED_UNITS.to_bytes(4, "little"))
    assert rig.protocol.regWriteTxRx(rig.port, rig.ids[0], GOAL, 4, payload) == (COMM_SUCCESS, 0)
    assert rig.read(rig.ids[0], GOAL, 4) == 0
    rig.protocol.action(rig.port, rig.ids[0])
    rig.protocol.ping(rig.port, rig.ids[1])  # the SDK does not wait for the answer to an action, so let it pass
    assert rig.read(rig.ids[0], GOAL, 4) == SPEED_UNITS
    rig.rest()


def stops_when_its_watchdog_trips(rig: Rig) -> None:
    """After the set silence: standstill, -1, goals refused until 0 is written."""
    rig.ready()
    rig.write(rig.ids[0], WATCHDOG, 1, 25)
    rig.write(rig.ids[0], GOAL, 4, SPEED_UNITS)
    rig.wait(0.4)
    assert rig.read(rig.ids[0], VELOCITY, 4) > SPEED_UNITS // 2
    rig.wait(1.0)
    assert abs(rig.read(rig.ids[0], VELOCITY, 4)) <= 1
    assert rig.read(rig.ids[0], WATCHDOG, 1) == -1
    assert rig.write(rig.ids[0], GOAL, 4, SPEED_UNITS) == (COMM_SUCCESS, DATA_RANGE)
    rig.write(rig.ids[0], TORQUE, 1, 0)
    assert rig.write(rig.ids[0], WATCHDOG, 1, 0) == (COMM_SUCCESS, 0)
    assert rig.write(rig.ids[0], GOAL, 4, 0) == (COMM_SUCCESS, 0)
    rig.rest()


CHECKS: tuple[Callable[[Rig], None], ...] = (
    answers_a_ping_with_its_model,
    is_silent_for_another_id,
    locks_its_eeprom_under_torque,
    refuses_to_write_what_it_measures,
    refuses_half_a_register,
    refuses_a_speed_beyond_its_limit,
    refuses_a_watchdog_beyond_its_range,
    turns_at_the_goal_velocity,
    takes_sync_write_and_sync_read,
    takes_a_bulk_read,
    acts_on_a_registered_write,
    stops_when_its_watchdog_trips,
)
"""Every check of the contract."""
