"""Fake motors on a pty, and a robot in virtual time."""

from collections.abc import Iterator

import pytest

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hil_fakes.virtual_robot import VirtualRobot


@pytest.fixture
def bus() -> Iterator[FakeBus]:
    with FakeBus(turtlebot3_pair(), seed=1) as fake:
        yield fake


@pytest.fixture
def robot() -> Iterator[VirtualRobot]:
    made = VirtualRobot(seed=1)
    made.wheels.open()
    yield made
    made.wheels.close()
