"""A fake bus and the unmodified SDK on it."""

from collections.abc import Iterator

import pytest
from dynamixel_sdk import PacketHandler, PortHandler

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.contract import Rig
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hil_fakes.dynamixel.paced import PacedPort

PATIENCE_MS = 20_000.0


class PatientPort(PortHandler):
    """The SDK's port with more than its 34 ms for a reply that is sure to come: test machines are loaded."""

    def setPacketTimeout(self, packet_length: int) -> None:
        self.setPacketTimeoutMillis(PATIENCE_MS)


@pytest.fixture
def bus() -> Iterator[FakeBus]:
    with FakeBus(turtlebot3_pair(), seed=1) as fake:
        yield fake


@pytest.fixture
def rig(bus: FakeBus) -> Iterator[Rig]:
    port = PacedPort(bus)
    assert port.openPort()
    yield Rig(port, PacketHandler(2.0), (1, 2), bus.advance)
    port.closePort()
