"""A base driven by ROS: no port is opened; a bridge process reports its odometry and gets its commands.

Nothing here knows ROS. `RosBase` is told by the daemon what the bridge says, from the event loop, and asked by the
wheels' thread. Two leases make the base stand: what it has not been told for `FRESH_S` counts as gone, here; and a
bridge that is not told how to move for half a second stops the base (hvcpd/ros).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from hvcpd.errors import DeviceError
from hvcpd.hardware.kinematics import BURGER, Drive, Twist, wheel_command
from hvcpd.ports import Pose, WheelCommand, WheelReading

FRESH_S = 0.35
"""Of real time. A base tells its odometry 20 to 30 times a second (TurtleBot3, Nav2), a slow one 10 times; with the
wheels' own period of 0.05 s and a block of sound the robot is told to stand within half a second."""

LASTING_S = 5.0
"""Time for which the bridge's reason for having no base holds; it repeats it once a second."""

NEVER = "ROS sends no odometry; start `hvcpctl ros`, and see that the base publishes odom"


@dataclass(frozen=True)
class BaseReport:
    """Where the base is in its odometry's frame, and how it moves (nav_msgs/Odometry)."""

    pose: Pose
    twist: Twist


class RosBase:
    """As `hvcpd.ports.Wheels`. `clock` is monotonic, s."""

    def __init__(self, drive: Drive = BURGER, clock: Callable[[], float] = time.monotonic) -> None:
        self._drive = drive
        self._clock = clock
        self._report: tuple[BaseReport, float] | None = None
        self._fault: tuple[str, float] | None = None

    def tell(self, report: BaseReport) -> None:
        """Note the base's odometry."""
        self._report, self._fault = (report, self._clock()), None

    def tell_fault(self, reason: str) -> None:
        """Note that the bridge has no base, for this reason: earlier odometry no longer counts."""
        self._report, self._fault = None, (reason, self._clock())

    @property
    def fault(self) -> str | None:
        """Why the base cannot be driven; None: it can."""
        now_s, report, fault = self._clock(), self._report, self._fault
        if report is not None:
            age_s = now_s - report[1]
            return f"ROS has sent no odometry for {age_s:.1f} s" if age_s > FRESH_S else None
        return fault[0] if fault is not None and now_s - fault[1] <= LASTING_S else NEVER

    def open(self) -> None:
        """Nothing to open: the base may come and go."""

    def exchange(self, command: WheelCommand) -> WheelReading:  # noqa: ARG002 - it goes another way
        """The base's last odometry; the command reaches it through the daemon's control socket.

        Raises DeviceError when the base has not been heard of for `FRESH_S`.
        """
        fault, report = self.fault, self._report
        if fault is not None or report is None:
            raise DeviceError(fault or NEVER)
        speeds = wheel_command(report[0].twist, self._drive)
        return WheelReading(0.0, 0.0, speeds.left_rad_s, speeds.right_rad_s, pose=report[0].pose)

    def close(self) -> None:
        """Nothing to close."""
