"""The motor's contract: on the fake always, on a robot with `REAL_WHEELS_PORT=/dev/ttyUSB0 pytest -m hardware`."""

import os
import time
from collections.abc import Callable

import pytest
from dynamixel_sdk import PacketHandler, PortHandler

from hil_fakes.dynamixel.contract import CHECKS, Rig


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_fake_keeps_the_contract(rig: Rig, check: Callable[[Rig], None]) -> None:
    check(rig)


@pytest.mark.hardware
@pytest.mark.skipif("REAL_WHEELS_PORT" not in os.environ, reason="REAL_WHEELS_PORT names no port of a real robot")
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_robot_keeps_the_contract(check: Callable[[Rig], None]) -> None:
    port = PortHandler(os.environ["REAL_WHEELS_PORT"])
    assert port.setBaudRate(1_000_000)
    rig = Rig(port, PacketHandler(2.0), (1, 2), time.sleep)
    try:
        check(rig)
    finally:
        rig.rest()
        port.closePort()
