"""OpenCR's contract: on the fake always, on a robot with `REAL_OPENCR_PORT=/dev/ttyACM0 pytest -m hardware`."""

import os
import time
from collections.abc import Callable, Iterator

import pytest
from dynamixel_sdk import PacketHandler, PortHandler

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.contract import Rig
from hil_fakes.dynamixel.opencr import BOOT_S, DEVICE_ID, FakeOpenCR
from hil_fakes.dynamixel.opencr_contract import CHECKS
from hil_fakes.dynamixel.paced import PacedPort


@pytest.fixture
def opencr() -> Iterator[tuple[FakeOpenCR, Rig]]:
    controller = FakeOpenCR()
    with FakeBus([controller], seed=1) as bus:
        port = PacedPort(bus)
        assert port.openPort()
        yield controller, Rig(port, PacketHandler(2.0), (DEVICE_ID, DEVICE_ID), bus.advance)
        port.closePort()


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_fake_keeps_the_contract(opencr: tuple[FakeOpenCR, Rig], check: Callable[[Rig], None]) -> None:
    check(opencr[1])


@pytest.mark.hardware
@pytest.mark.skipif("REAL_OPENCR_PORT" not in os.environ, reason="REAL_OPENCR_PORT names no port of a real robot")
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_robot_keeps_the_contract(check: Callable[[Rig], None]) -> None:
    port = PortHandler(os.environ["REAL_OPENCR_PORT"])
    assert port.setBaudRate(1_000_000)
    try:
        check(Rig(port, PacketHandler(2.0), (DEVICE_ID, DEVICE_ID), time.sleep))
    finally:
        port.closePort()


def test_a_reset_silences_it_for_a_while_and_forgets_everything(opencr: tuple[FakeOpenCR, Rig]) -> None:
    controller, rig = opencr
    rig.write(DEVICE_ID, 19, 1, 77)
    controller.reboot()
    assert rig.protocol.ping(rig.port, DEVICE_ID)[1] != 0
    rig.wait(BOOT_S)
    assert rig.protocol.ping(rig.port, DEVICE_ID)[1] == 0
    assert controller.get("heartbeat") == 0


def test_debug_mode_takes_the_heartbeats_place() -> None:
    controller = FakeOpenCR(debug_mode=True)
    controller.advance(2.0)
    assert controller.connected


def test_an_empty_battery_cuts_the_motors_off_in_the_end() -> None:
    controller = FakeOpenCR()
    for motor in (controller.left, controller.right):
        motor.voltage_v = 10.5
    controller.advance(9.0)
    assert controller.left.powered
    controller.advance(2.0)
    assert not controller.left.powered
    assert controller.get("motor_torque") == 0
