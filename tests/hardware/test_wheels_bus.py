"""Registers over the SDK: no late reply is ever taken for another register's."""

import os
import termios
from collections.abc import Iterator
from contextlib import suppress
from functools import partial

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.faults import ReplyFault
from hil_fakes.dynamixel.line import Line
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hil_fakes.dynamixel.paced import PacedPort
from hil_fakes.dynamixel.virtual import VirtualPort, VirtualTime
from hvcpd.hardware import registers
from hvcpd.hardware.wheels_bus import BusError, DynamixelBus, RefusedError

READABLE = {
    registers.FIRMWARE_VERSION: 45,
    registers.OPERATING_MODE: 3,
    registers.TORQUE_ENABLE: 0,
    registers.PRESENT_TEMPERATURE: 30,
    registers.PRESENT_INPUT_VOLTAGE: 120,
    registers.PRESENT_LOAD: 0,
    registers.VELOCITY_LIMIT: 265,
    registers.PRESENT_VELOCITY: 0,
}


@pytest.fixture
def line(bus: FakeBus) -> Iterator[DynamixelBus]:
    opened = DynamixelBus(bus.path, 1_000_000, 0.01, partial(PacedPort, bus))
    opened.open()
    yield opened
    opened.close()


def test_reads_and_writes(line: DynamixelBus) -> None:
    assert [line.ping(motor_id) for motor_id in (1, 2)] == [1060, 1060]
    assert {register: line.read(1, register) for register in READABLE} == READABLE
    line.write(2, registers.OPERATING_MODE, 1)
    assert line.read(2, registers.OPERATING_MODE) == 1
    assert line.find(0.05) == {1: 1060, 2: 1060}


def test_a_refusal_names_the_register(line: DynamixelBus) -> None:
    with pytest.raises(RefusedError, match=r"motor 1 .* refuses operating mode: .* range"):
        line.write(1, registers.OPERATING_MODE, 2)


def test_a_late_reply_is_not_taken_for_a_register_of_the_same_size(bus: FakeBus, line: DynamixelBus) -> None:
    bus.faults.schedule(ReplyFault.LATE)
    with pytest.raises(BusError, match="no answer"):
        line.read(1, registers.FIRMWARE_VERSION)
    assert line.read(1, registers.PRESENT_TEMPERATURE) == 30  # and not 45


def test_a_device_that_takes_no_bytes_fails_and_is_there_again_afterwards(bus: FakeBus) -> None:
    """Pyserial waited for it for ever, and with it the thread of the wheels."""
    line = DynamixelBus(bus.path, 1_000_000, 1.0)
    line.open()
    tty = os.open(bus.path, os.O_RDWR | os.O_NOCTTY)
    try:
        termios.tcflow(tty, termios.TCOOFF)
        for _ in range(3):
            with pytest.raises(BusError, match=r"takes no more bytes; does it hang\? Press its reset button"):
                line.read(1, registers.OPERATING_MODE)
        termios.tcflow(tty, termios.TCOON)
        assert line.read(1, registers.OPERATING_MODE) == 3
    finally:
        os.close(tty)
        line.close()


@pytest.mark.parametrize("delayed", range(1, 12))
def test_replies_that_are_late_by_several_requests_are_not_taken_for_later_ones(delayed: int) -> None:
    """Every reply comes 60 ms late, while we wait 34 ms for it: that of a probe may come in time for the next one."""
    line, time = Line(turtlebot3_pair(), 1), VirtualTime()
    bus = DynamixelBus("virtual", 1_000_000, 0.034, lambda _, hz, timeout_s: VirtualPort(line, time, hz, timeout_s))
    bus.open()
    line.faults.schedule(*[ReplyFault.DELAY] * delayed)
    right = 0
    for _ in range(20):
        for register in (registers.FIRMWARE_VERSION, registers.OPERATING_MODE, registers.TORQUE_ENABLE):
            with suppress(BusError):
                assert bus.read(1, register) == READABLE[register]
                right += 1
    assert right > 40


def test_an_acknowledgement_that_comes_late_is_not_taken_for_the_next(bus: FakeBus, line: DynamixelBus) -> None:
    bus.faults.schedule(ReplyFault.LATE)
    with pytest.raises(BusError):
        line.write(1, registers.OPERATING_MODE, 1)
    with pytest.raises(RefusedError):
        line.write(1, registers.OPERATING_MODE, 2)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.lists(st.sampled_from(list(ReplyFault)), max_size=12),
    st.lists(st.tuples(st.sampled_from([1, 2]), st.sampled_from(list(READABLE))), min_size=1, max_size=8),
)
def test_under_any_faults_a_read_is_right_or_fails(
    faults: list[ReplyFault], reads: list[tuple[int, registers.Register]]
) -> None:
    with FakeBus(turtlebot3_pair()) as bus:
        line = DynamixelBus(bus.path, 1_000_000, 0.002, partial(PacedPort, bus))
        line.open()
        bus.faults.schedule(*faults)
        for motor_id, register in reads:
            try:
                assert line.read(motor_id, register) == READABLE[register]
            except BusError:
                continue
        line.close()
