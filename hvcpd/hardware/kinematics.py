"""Two driven wheels: from wheel angles to a place in the room, and from wanted motion to wheel speeds. Pure.

Source of the formulas: odometry of the differential drive by the mid-point rule, e.g. Siegwart, Nourbakhsh and
Scaramuzza, "Introduction to Autonomous Mobile Robots", section 5.2.4; units as REP-103.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hvcpd.config.settings import WheelSettings
from hvcpd.ports import Pose, WheelCommand, WheelReading


@dataclass(frozen=True)
class Drive:
    """Dimensions and limits of a robot with two driven wheels."""

    wheel_radius_m: float = 0.033
    """Mean of both wheels."""
    separation_m: float = 0.160
    """Between the points where the wheels touch the floor."""
    radius_ratio: float = 1.0
    """The right wheel's radius over the left one's."""
    max_wheel_rad_s: float = 61.0 * 2.0 * math.pi / 60.0
    """6.39 rad/s, 0.211 m/s at the rim."""

    @property
    def left_radius_m(self) -> float:
        """The left wheel's radius."""
        return 2.0 * self.wheel_radius_m / (1.0 + self.radius_ratio)

    @property
    def right_radius_m(self) -> float:
        """The right wheel's radius."""
        return self.radius_ratio * self.left_radius_m


BURGER = Drive()
"""TurtleBot3 Burger: ROBOTIS e-Manual, TurtleBot3, "Features"; the firmware limits its wheels to 61 rev/min."""


def drive_of(settings: WheelSettings) -> Drive:
    """The robot's dimensions by its settings."""
    return Drive(settings.wheel_radius_m, settings.separation_m, settings.radius_ratio)


@dataclass(frozen=True)
class Twist:
    """Wanted motion of the robot: forward speed and turning rate, counter-clockwise positive."""

    linear_m_s: float = 0.0
    angular_rad_s: float = 0.0


def wrap_angle(angle_rad: float) -> float:
    """Return the same direction within (-pi, pi]."""
    return math.pi - (math.pi - angle_rad) % (2.0 * math.pi)


def advance_pose(pose: Pose, left_rad: float, right_rad: float, drive: Drive = BURGER) -> Pose:
    """The pose after the wheels turned by these angles (rad, forward positive); heading within (-pi, pi]."""
    left_m, right_m = drive.left_radius_m * left_rad, drive.right_radius_m * right_rad
    distance_m = (right_m + left_m) / 2.0
    turn_rad = (right_m - left_m) / drive.separation_m
    middle_rad = pose.heading_rad + turn_rad / 2.0
    return Pose(
        pose.x_m + distance_m * math.cos(middle_rad),
        pose.y_m + distance_m * math.sin(middle_rad),
        wrap_angle(pose.heading_rad + turn_rad),
    )


def wheel_command(twist: Twist, drive: Drive = BURGER) -> WheelCommand:
    """Wheel speeds for a motion. Beyond the wheels' limit forward speed is reduced first, to keep the turning rate."""
    limit_m_s = drive.max_wheel_rad_s * min(drive.left_radius_m, drive.right_radius_m)
    half_m = drive.separation_m / 2.0
    angular_rad_s = min(max(twist.angular_rad_s, -limit_m_s / half_m), limit_m_s / half_m)
    room_m_s = limit_m_s - abs(angular_rad_s) * half_m
    linear_m_s = min(max(twist.linear_m_s, -room_m_s), room_m_s)
    return WheelCommand(
        (linear_m_s - angular_rad_s * half_m) / drive.left_radius_m,
        (linear_m_s + angular_rad_s * half_m) / drive.right_radius_m,
    )


def twist_of(command: WheelCommand, drive: Drive = BURGER) -> Twist:
    """The motion that these wheel speeds make."""
    left_m_s, right_m_s = drive.left_radius_m * command.left_rad_s, drive.right_radius_m * command.right_rad_s
    return Twist((right_m_s + left_m_s) / 2.0, (right_m_s - left_m_s) / drive.separation_m)


def compose(frame: Pose, pose: Pose) -> Pose:
    """A pose that is given in `frame`, as seen from where `frame` is given; heading within (-pi, pi]."""
    cos, sin = math.cos(frame.heading_rad), math.sin(frame.heading_rad)
    return Pose(
        frame.x_m + cos * pose.x_m - sin * pose.y_m,
        frame.y_m + sin * pose.x_m + cos * pose.y_m,
        wrap_angle(frame.heading_rad + pose.heading_rad),
    )


def frame_between(here: Pose, there: Pose) -> Pose:
    """The frame in which `there` is what is `here` outside: compose(frame, there) == here."""
    heading_rad = here.heading_rad - there.heading_rad
    turned = compose(Pose(0.0, 0.0, heading_rad), there)
    return Pose(here.x_m - turned.x_m, here.y_m - turned.y_m, wrap_angle(heading_rad))


RESUMED_RAD = 8.0
"""A wheel that turned no further than this since a kept reading still counts on from it (26 cm): a killed daemon's
robot rolls on for 0.4 to 0.7 s, 4.5 rad at most. Further, the motor has lost count: it lost its power."""


RESTARTED_M = 0.5
"""Jump from which on a base that keeps account itself has begun a new account: by REP-105 its frame does not jump, and
within the lease of 0.5 s a base of this size goes no further (1 m/s)."""
AT_ORIGIN = 1e-3
"""Largest deviation, m and rad, from the origin of its frame, where a base begins its account."""
TO_ORIGIN_M, TO_ORIGIN_RAD = 0.15, 0.6
"""Jump to there from which on it has begun a new one: between two of its words, 0.35 s apart at most, a robot drives
and turns less far (0.2 m/s, 1.5 rad/s)."""


class Odometry:
    """Adds up encoder readings to a pose. The first reading only sets the baseline.

    `last` is the reading that goes with `start`, if that was kept: what the wheels turned since then is added too.
    """

    def __init__(self, start: Pose, drive: Drive = BURGER, last: WheelReading | None = None) -> None:
        self.pose = start
        """Where the robot believes that it is."""
        self.drive = drive
        """The dimensions that it reckons with."""
        self.last: WheelReading | None = None
        """The reading that goes with the pose; None before the first."""
        self._kept = last
        self._frame: Pose | None = None

    def update(self, reading: WheelReading) -> Pose:
        """Add a reading; return the new pose."""
        before = self.last or self._kept
        if reading.pose is not None:
            self._follow(reading.pose)
        elif before is not None:
            left_rad = reading.left_rad - before.left_rad
            right_rad = reading.right_rad - before.right_rad
            if self.last is not None or max(abs(left_rad), abs(right_rad)) <= RESUMED_RAD:
                self.pose = advance_pose(self.pose, left_rad, right_rad, self.drive)
        self.last = reading
        return self.pose

    def _follow(self, given: Pose) -> None:
        """Follow a base with its own odometry; its first pose, also after a restart, is where the robot is now."""
        last = self.last.pose if self.last is not None else None
        if last is None or self._frame is None or _begins_anew(last, given):
            self._frame = frame_between(self.pose, given)
        self.pose = compose(self._frame, given)


def _begins_anew(last: Pose, given: Pose) -> bool:
    way_m = math.hypot(given.x_m - last.x_m, given.y_m - last.y_m)
    turn_rad = abs(wrap_angle(given.heading_rad - last.heading_rad))
    at_origin = max(abs(given.x_m), abs(given.y_m), abs(given.heading_rad)) < AT_ORIGIN
    return way_m > RESTARTED_M or (at_origin and (way_m > TO_ORIGIN_M or turn_rad > TO_ORIGIN_RAD))
