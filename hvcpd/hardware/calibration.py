"""The wheels' true dimensions, from where a robot ends up when its odometry says that it is back. Pure.

Method: UMBmark (Borenstein and Feng, "Measurement and Correction of Systematic Odometry Errors in Mobile Robots", IEEE
Transactions on Robotics and Automation 12(6), 1996): a square driven both ways round tells unequal wheels from a wrong
separation, and a straight line gives the scale. Angles are small; what is neglected is of their second order.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

from hvcpd.errors import HvcpdError
from hvcpd.hardware.kinematics import Drive, compose
from hvcpd.hardware.motion import Forward
from hvcpd.hardware.navigator import Face, Journey, Waypoints
from hvcpd.ports import Pose

SIDE_M = 1.0
"""Side of the squares, and length of the straight line."""

PLAUSIBLE = 0.1
"""A wheel is not further off its data sheet than a tenth; a larger result is a slip of the tape measure."""


class CalibrationError(HvcpdError):
    """The measurements cannot be right, or a run failed."""


@dataclass(frozen=True)
class Measured:
    """Where the robot stands after a run, by tape measure from its start: metres, x along its first heading, y left."""

    x_m: float
    y_m: float


def square_run(pose: Pose, left: bool) -> tuple[Journey, ...]:
    """Once round a square whose first side lies ahead, the others to the left or to the right, and back to `pose`."""
    side = math.copysign(SIDE_M, 1.0 if left else -1.0)
    corners = [(SIDE_M, 0.0), (SIDE_M, side), (0.0, side), (0.0, 0.0)]
    places = (compose(pose, Pose(x_m, y_m)) for x_m, y_m in corners)
    return Waypoints(tuple((place.x_m, place.y_m) for place in places)), Face(pose.heading_rad)


def calibrated(drive: Drive, straight: Measured, left: Measured, right: Measured) -> Drive:
    """The robot's true dimensions, from where it stood after the three runs driven with `drive`.

    Of a run's measurement the robot's own residual (where it believed to be, less where it should have been) must be
    taken away before. Raises CalibrationError for figures that no robot can have.
    """
    scale = math.hypot(straight.x_m, straight.y_m) / SIDE_M
    # Driving left round, each corner adds alpha and each side beta; right round, alpha adds and beta takes away.
    both_rad = (left.x_m - left.y_m) / (4.0 * SIDE_M)
    difference_rad = (right.x_m + right.y_m) / (4.0 * SIDE_M)
    corner_rad, side_rad = (both_rad + difference_rad) / 2.0, (both_rad - difference_rad) / 2.0
    separation_m = drive.separation_m * scale * (math.pi / 2.0) / (math.pi / 2.0 + corner_rad)
    half_m = separation_m / 2.0
    bend = 2.0 * math.sin(side_rad / 2.0) / (SIDE_M * scale)  # of a side that was meant to be straight, 1/m
    ratio = drive.radius_ratio * (1.0 + half_m * bend) / (1.0 - half_m * bend)
    result = dataclasses.replace(
        drive, wheel_radius_m=drive.wheel_radius_m * scale, separation_m=separation_m, radius_ratio=ratio
    )
    _check(drive, result)
    return result


def _check(before: Drive, after: Drive) -> None:
    for what, old, new in (
        ("wheel radius", before.wheel_radius_m, after.wheel_radius_m),
        ("wheels' separation", before.separation_m, after.separation_m),
        ("ratio of the wheels' radii", before.radius_ratio, after.radius_ratio),
    ):
        if not abs(new / old - 1.0) <= PLAUSIBLE:
            raise CalibrationError(
                f"the {what} would come out as {new:.4f} instead of {old:.4f}: measure again, in metres, from the "
                "point where the robot started, x along its first heading and y to its left"
            )


Perform = Callable[[Journey], None]
"""Drives a journey to its end; raises CalibrationError when it fails."""
Ask = Callable[[str], Measured]
"""Tells a person what to measure and returns it."""
Ready = Callable[[str], None]
"""Has a person mark the start of a run and say that it may begin."""


def calibrate(
    drive: Drive, believed: Callable[[], Pose], perform: Perform, ask: Ask, ready: Ready = lambda _name: None
) -> Drive:
    """Drive the three runs and ask after each. `believed` is the odometry's pose. Raises CalibrationError."""
    results = []
    for name in ("straight on", "a square to the left", "a square to the right"):
        ready(name)
        start = believed()
        run = (Forward(SIDE_M),) if name == "straight on" else square_run(start, left=name.endswith("left"))
        for journey in run:
            perform(journey)
        measured = ask(name)
        end = relative(believed(), start)
        wanted_m = SIDE_M if name == "straight on" else 0.0
        results.append(Measured(measured.x_m - (end.x_m - wanted_m), measured.y_m - end.y_m))
    return calibrated(drive, *results)


def relative(pose: Pose, start: Pose) -> Measured:
    """Where a pose is, measured from a start."""
    dx_m, dy_m = pose.x_m - start.x_m, pose.y_m - start.y_m
    cos, sin = math.cos(start.heading_rad), math.sin(start.heading_rad)
    return Measured(dx_m * cos + dy_m * sin, dy_m * cos - dx_m * sin)
