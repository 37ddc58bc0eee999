"""A robot's body in the simulated room: fake motors on a pty turn its wheels, and the wheels move it.

The true place follows from the fakes' true wheel angles and is known to the room only; the robot has its encoders.
"""

from __future__ import annotations

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hil_fakes.true_pose import TruePose, TrueWheels
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.ports import Pose, WheelCommand, WheelReading

LEFT_ID, RIGHT_ID = 1, 2
BAUD_RATE_HZ = 115_200
"""A pty takes no time at any rate; this one exists under qemu-user too, whose terminals end at 460,800."""
TIMEOUT_S = 2.0
"""Of real time for an answer on the pty: virtual time stands still meanwhile, and machines may be loaded."""


class Body:
    """Two fake motors, the unmodified driver on their port, and the true pose. A context manager."""

    def __init__(self, start: Pose, seed: int) -> None:
        self._now_s = 0.0
        self.motors = turtlebot3_pair(LEFT_ID, RIGHT_ID, baud_rate_hz=BAUD_RATE_HZ)
        self._bus = FakeBus(self.motors, seed=seed)
        self.wheels = DynamixelWheels(
            self._bus.path,
            ids=(LEFT_ID, RIGHT_ID),
            baud_rate=BAUD_RATE_HZ,
            timeout_s=TIMEOUT_S,
            clock=lambda: self._now_s,
        )
        self._truth = TruePose(start, self.motors, TrueWheels())

    def __enter__(self) -> Body:
        self.wheels.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.wheels.close()
        self._bus.close()

    @property
    def pose(self) -> Pose:
        """Where it truly is."""
        return self._truth.pose

    def exchange(self, command: WheelCommand) -> WheelReading:
        """One cycle on the bus."""
        return self.wheels.exchange(command)

    def advance(self, dt_s: float) -> None:
        """Let the motors turn for `dt_s` and move the body accordingly."""
        self._now_s += dt_s
        self._bus.advance(dt_s)
        self._truth.follow()
