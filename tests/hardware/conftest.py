"""Fake motors on a pty, and a robot in virtual time."""

from collections.abc import Iterator

import pytest

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hil_fakes.virtual_robot import Kind, VirtualRobot


@pytest.fixture
def bus() -> Iterator[FakeBus]:
    with FakeBus(turtlebot3_pair(), seed=1) as fake:
        yield fake


@pytest.fixture
def kind() -> Kind:
    """The kind of `robot`."""
    return "dynamixel"


@pytest.fixture
def robot(kind: Kind) -> Iterator[VirtualRobot]:
    made = VirtualRobot(kind, seed=1)
    made.wheels.open()
    yield made
    made.wheels.close()
