"""A robot's body in the simulated room: fake motors on a pty turn its wheels, and the wheels move it.

The true place follows from the fakes' true wheel angles and is known to the room only; the robot has its encoders.
"""

from __future__ import annotations

import math
from types import TracebackType

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hvcpd.hardware.wheels import DynamixelSettings, DynamixelWheels
from hvcpd.ports import Pose, WheelCommand, WheelReading

WHEEL_RADIUS_M = 0.033
SEPARATION_M = 0.160
"""TurtleBot3 Burger (ROBOTIS e-Manual, "Features"). Written again here, so that a wrong figure in hvcpd shows."""
LEFT_ID, RIGHT_ID = 1, 2
TIMEOUT_S = 2.0
"""Of real time for an answer on the pty: virtual time stands still meanwhile, and machines may be loaded."""


class Body:
    """Two fake motors, the unmodified driver on their port, and the true pose. A context manager."""

    def __init__(self, start: Pose, seed: int) -> None:
        self.pose = start
        self.motors = turtlebot3_pair(LEFT_ID, RIGHT_ID)
        self._bus = FakeBus(self.motors, seed=seed)
        self.wheels = DynamixelWheels(
            self._bus.path, ids=(LEFT_ID, RIGHT_ID), settings=DynamixelSettings(timeout_s=TIMEOUT_S), clock=lambda: 0.0
        )
        self._angles = self._true_angles()

    def __enter__(self) -> Body:
        self.wheels.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.wheels.close()
        self._bus.close()

    def exchange(self, command: WheelCommand) -> WheelReading:
        """One cycle on the bus."""
        return self.wheels.exchange(command)

    def advance(self, dt_s: float) -> None:
        """Let the motors turn for `dt_s` and move the body accordingly."""
        self._bus.advance(dt_s)
        left_rad, right_rad = self._true_angles()
        forward_m = WHEEL_RADIUS_M * ((left_rad - self._angles[0]) + (right_rad - self._angles[1])) / 2
        turn_rad = WHEEL_RADIUS_M * ((right_rad - self._angles[1]) - (left_rad - self._angles[0])) / SEPARATION_M
        self._angles = left_rad, right_rad
        course_rad = self.pose.heading_rad + turn_rad / 2
        self.pose = Pose(
            self.pose.x_m + forward_m * math.cos(course_rad),
            self.pose.y_m + forward_m * math.sin(course_rad),
            self.pose.heading_rad + turn_rad,
        )

    def _true_angles(self) -> tuple[float, float]:
        motors = self._bus.motors
        return motors[LEFT_ID].true_angle_rad, motors[RIGHT_ID].true_angle_rad
