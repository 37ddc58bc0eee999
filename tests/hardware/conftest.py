"""Fake motors with the driver on them, and a little robot in virtual time."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hvcpd.hardware.kinematics import Odometry
from hvcpd.hardware.motion import MotionState
from hvcpd.hardware.navigator import Journey, Navigator
from hvcpd.hardware.wheels import DynamixelSettings, DynamixelWheels
from hvcpd.ports import STANDSTILL, Pose, WheelCommand, WheelReading

PATIENT = DynamixelSettings(timeout_s=1.0)
"""For tests in which every reply comes."""
HASTY = DynamixelSettings(timeout_s=0.03, search_s=0.05)
"""For tests in which some do not."""


@dataclass
class Clock:
    """Virtual time in s."""

    now_s: float = 0.0

    def __call__(self) -> float:
        return self.now_s


@dataclass
class Robot:
    """Fake motors and the driver, advanced together by one clock."""

    bus: FakeBus
    clock: Clock
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
        self.bus.advance(dt_s)
        self.clock.now_s += dt_s
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


def make_robot(bus: FakeBus, settings: DynamixelSettings = PATIENT) -> Robot:
    clock = Clock()
    return Robot(bus, clock, DynamixelWheels(bus.path, settings=settings, clock=clock))


@pytest.fixture
def robot(bus: FakeBus) -> Iterator[Robot]:
    made = make_robot(bus)
    made.wheels.open()
    yield made
    made.wheels.close()


@pytest.fixture
def hasty(bus: FakeBus) -> Iterator[Robot]:
    made = make_robot(bus, HASTY)
    made.wheels.open()
    yield made
    made.wheels.close()
