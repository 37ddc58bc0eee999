"""What passes between the rooms and the outside: units, shapes and the two device interfaces.

Whoever drives a robot (the daemon on real devices, the bench on fakes) talks to it in these terms only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

SAMPLE_RATE_HZ = 16_000
"""The rate of all sound inside hvcpd; devices and files of other rates are converted at the edge."""

Samples = NDArray[np.float32]
"""Mono sound, shape (n,), float32, 1.0 = full scale."""


@dataclass(frozen=True)
class Pose:
    """Where a robot is, by REP-103: metres, radians, x forward, counter-clockwise positive."""

    x_m: float
    y_m: float
    heading_rad: float = 0.0


@dataclass(frozen=True)
class WheelCommand:
    """Wanted wheel speeds, rad/s at the wheel, forward positive."""

    left_rad_s: float = 0.0
    right_rad_s: float = 0.0


STANDSTILL = WheelCommand()


@dataclass(frozen=True)
class WheelReading:
    """What the encoders say: angle of each wheel (rad, unbounded, forward positive) and its speed (rad/s).

    Beside them each motor's effort, -1 to 1 of what it can do, and the battery's voltage (V) if it was measured.
    """

    left_rad: float
    right_rad: float
    left_rad_s: float = 0.0
    right_rad_s: float = 0.0
    left_effort: float = 0.0
    right_effort: float = 0.0
    voltage_v: float | None = None


class Wheels(Protocol):
    """Two driven wheels. Every method may raise `hvcpd.errors.DeviceError`."""

    def open(self) -> None:
        """Find the motors, check them, switch torque on. Wheels stand still afterwards."""

    def exchange(self, command: WheelCommand) -> WheelReading:
        """Send the wanted speeds and read the encoders; blocks for one bus cycle."""

    def close(self) -> None:
        """Stop the wheels, switch torque off and let go of the port. Never raises."""
