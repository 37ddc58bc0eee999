"""Where a robot truly is, from the true angles of its wheels. For the bench, never for the robot.

The figures of the wheels are written down again here, so that a wrong one in hvcpd shows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hil_fakes.dynamixel.motor import FakeMotor
from hvcpd.ports import Pose


@dataclass(frozen=True)
class TrueWheels:
    """The true dimensions of the wheels; the defaults are a TurtleBot3 Burger's (ROBOTIS e-Manual, "Features")."""

    left_radius_m: float = 0.033
    right_radius_m: float = 0.033
    separation_m: float = 0.160


class TruePose:
    """Adds up the true angles that the motors (left, right) turn the wheels by; the heading counts whole turns."""

    def __init__(self, start: Pose, motors: tuple[FakeMotor, FakeMotor], wheels: TrueWheels) -> None:
        self.pose = start
        self._motors = motors
        self._wheels = wheels
        self._last = self._angles()

    def follow(self) -> None:
        """Add the turns of the wheels since the last call."""
        left_rad, right_rad = self._angles()
        left_m = (left_rad - self._last[0]) * self._wheels.left_radius_m
        right_m = (right_rad - self._last[1]) * self._wheels.right_radius_m
        self._last = left_rad, right_rad
        turn_rad = (right_m - left_m) / self._wheels.separation_m
        course_rad = self.pose.heading_rad + turn_rad / 2.0
        way_m = (left_m + right_m) / 2.0
        self.pose = Pose(
            self.pose.x_m + way_m * math.cos(course_rad),
            self.pose.y_m + way_m * math.sin(course_rad),
            self.pose.heading_rad + turn_rad,
        )

    def _angles(self) -> tuple[float, float]:
        left, right = self._motors
        return left.true_angle_rad, right.true_angle_rad
