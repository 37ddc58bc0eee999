"""Fake motors with the driver on them, and a little robot in virtual time."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import pytest

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.line import Line
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hil_fakes.dynamixel.virtual import VirtualPort, VirtualTime
from hvcpd.hardware.kinematics import Odometry
from hvcpd.hardware.motion import MotionState
from hvcpd.hardware.navigator import Journey, Navigator
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.ports import STANDSTILL, Pose, WheelCommand, WheelReading

PATIENT_S = 20.0
"""Wait for a reply: For tests on a pty, in which every reply comes, however busy the machine is."""


class MemoryBus:
    """As FakeBus, but in memory and virtual time: for tests in which replies fail to come, which none may do merely
    because the machine is busy. For one driver."""

    path = "virtual"

    def __init__(self, seed: int = 1) -> None:
        self.line = Line(turtlebot3_pair(), seed)
        self.motors = self.line.motors
        self.faults = self.line.faults
        self.time = VirtualTime()
        self.port: VirtualPort

    def make_port(self, _path: str, baud_rate: int, timeout_s: float) -> VirtualPort:
        self.port = VirtualPort(self.line, self.time, baud_rate, timeout_s)
        return self.port

    def unplug(self) -> None:
        self.port.plugged = False

    def replug(self) -> None:
        self.port.plugged = True


@dataclass
class Robot:
    """Fake motors and the driver, advanced together by one clock."""

    bus: FakeBus | MemoryBus
    clock: VirtualTime
    wheels: DynamixelWheels
    odometry: Odometry = field(default_factory=lambda: Odometry(Pose(0.0, 0.0)))
    watchers: list[Callable[[], None]] = field(default_factory=list)

    def watch(self, watcher: Callable[[], None]) -> None:
        """Have `watcher` called whenever time has passed."""
        self.watchers.append(watcher)

    def cycle(self, command: WheelCommand, dt_s: float = 0.02) -> WheelReading:
        """One exchange, and then time passes."""
        reading = self.wheels.exchange(command)
        self.odometry.update(reading)
        self.wait(dt_s)
        return reading

    def run(self, command: WheelCommand, duration_s: float) -> WheelReading:
        """The same command for a while; the last reading."""
        for _ in range(round(duration_s / 0.02)):
            reading = self.cycle(command)
        return reading

    def wait(self, dt_s: float) -> None:
        """Time passes without a word on the bus."""
        self.clock.advance(dt_s)
        for watcher in self.watchers:
            watcher()

    def carry_out(self, navigator: Navigator, journey: Journey, limit_s: float = 60.0) -> MotionState:
        """Let the navigator drive until it has done with the journey."""
        navigator.start(journey, self.odometry.pose)
        reading = self.cycle(STANDSTILL)
        end_s = self.clock.now_s + limit_s
        while navigator.state is MotionState.MOVING and self.clock.now_s < end_s:
            reading = self.cycle(navigator.step(self.odometry.pose, self.clock.now_s, reading))
        self.cycle(STANDSTILL)
        return navigator.state


@pytest.fixture
def bus() -> Iterator[FakeBus]:
    with FakeBus(turtlebot3_pair(), seed=1) as fake:
        yield fake


def make_robot(bus: FakeBus) -> Robot:
    clock = VirtualTime()
    clock.follow(bus.advance)
    return Robot(bus, clock, DynamixelWheels(bus.path, timeout_s=PATIENT_S, clock=clock))


@pytest.fixture
def robot(bus: FakeBus) -> Iterator[Robot]:
    made = make_robot(bus)
    made.wheels.open()
    yield made
    made.wheels.close()


@contextmanager
def faulty_robot(seed: int = 1) -> Iterator[Robot]:
    """A robot whose motors may fail to answer."""
    bus = MemoryBus(seed)
    made = Robot(bus, bus.time, DynamixelWheels(bus.path, clock=bus.time, make_port=bus.make_port))
    made.wheels.open()
    yield made
    made.wheels.close()


@pytest.fixture
def faulty() -> Iterator[Robot]:
    with faulty_robot() as made:
        yield made
