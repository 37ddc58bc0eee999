"""What passes between the rooms and the outside: units, shapes and the two device interfaces.

Whoever drives a robot (the daemon on real devices, the bench on fakes) talks to it in these terms only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeAlias

if TYPE_CHECKING:  # what only asks a robot needs no arithmetic library
    import numpy as np
    from numpy.typing import NDArray

SAMPLE_RATE_HZ = 16_000
"""The rate of all sound inside hvcpd; devices and files of other rates are converted at the edge."""

Samples: TypeAlias = "NDArray[np.float32]"
"""Mono sound, shape (n,), float32, 1.0 = full scale."""


def samples_in(seconds: float) -> int:
    """Number of samples in a time."""
    return round(seconds * SAMPLE_RATE_HZ)


WARN_BATTERY_V = 11.1
"""Below this a person should charge: a TurtleBot3's battery has 11.1 V nominally and is cut off at 11.0 V (ROBOTIS
e-Manual)."""

STILL_M, STILL_RAD = 0.001, 0.002
"""A pose that differs by no more is the same: the encoders' steps are 0.05 mm, and a standing wheel may flicker."""


@dataclass(frozen=True)
class Place:
    """A point on the floor of the room, in metres, in the frame in which the robots' start poses are given."""

    x_m: float
    y_m: float

    def distance_m(self, other: Place) -> float:
        """The distance to another point, m."""
        return math.hypot(other.x_m - self.x_m, other.y_m - self.y_m)

    def toward(self, goal: Place, share: float) -> Place:
        """The point that a share of the straight way to `goal` leads to."""
        return Place(self.x_m + share * (goal.x_m - self.x_m), self.y_m + share * (goal.y_m - self.y_m))


@dataclass(frozen=True)
class Pose:
    """Where a robot is, by REP-103: metres, radians, x forward, counter-clockwise positive."""

    x_m: float
    y_m: float
    heading_rad: float = 0.0

    def near(self, other: Pose) -> bool:
        """Whether the robot has not moved between the two, but for a flicker of its encoders."""
        apart_m = math.hypot(self.x_m - other.x_m, self.y_m - other.y_m)
        return apart_m <= STILL_M and abs(self.heading_rad - other.heading_rad) <= STILL_RAD


@dataclass(frozen=True)
class PlaceGoal:
    """A place in the room (m) to bring the base to, whatever its heading there; every request has its own number."""

    number: int
    x_m: float
    y_m: float


@dataclass(frozen=True)
class WheelCommand:
    """Wanted wheel speeds, rad/s at the wheel, forward positive."""

    left_rad_s: float = 0.0
    right_rad_s: float = 0.0


STANDSTILL = WheelCommand()


@dataclass(frozen=True)
class WheelReading:
    """What the encoders say: angle of each wheel (rad, unbounded, forward positive) and its speed (rad/s).

    Beside them each motor's effort, -1 to 1 of what it can do, and the battery's voltage (V) if it was measured. A base
    that keeps account of its own way says no angles but its `pose`, in its own odometry frame (REP-105).
    """

    left_rad: float
    right_rad: float
    left_rad_s: float = 0.0
    right_rad_s: float = 0.0
    left_effort: float = 0.0
    right_effort: float = 0.0
    voltage_v: float | None = None
    pose: Pose | None = None


class Wheels(Protocol):
    """Two driven wheels. Every method may raise `hvcpd.errors.DeviceError`."""

    def open(self) -> None:
        """Find the motors, check them, switch torque on. Wheels stand still afterwards."""

    def exchange(self, command: WheelCommand) -> WheelReading:
        """Send the wanted speeds and read the encoders; blocks for one bus cycle."""

    def close(self) -> None:
        """Stop the wheels, switch torque off and let go of the port. Never raises."""
