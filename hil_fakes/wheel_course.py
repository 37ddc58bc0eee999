"""Courses that end where they began, driven in virtual time: how far off is the robot in truth?"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hil_fakes.true_pose import TrueWheels
from hil_fakes.virtual_robot import Kind, VirtualRobot
from hvcpd.hardware.calibration import CalibrationError, Measured, calibrate, relative
from hvcpd.hardware.kinematics import Drive
from hvcpd.hardware.motion import MotionState
from hvcpd.hardware.navigator import Face, Journey, Waypoints

SQUARE: tuple[Journey, ...] = (Waypoints(((1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0))), Face(0.0))
"""Sides of 1 m."""

LOOP_M = 0.5
CORNERS = 12


def _loop(centre_y_m: float, way_round: float) -> list[tuple[float, float]]:
    """The corners of a polygon around (0, centre), from the origin on."""
    start_rad = -math.pi / 2 if centre_y_m > 0 else math.pi / 2
    angles = [start_rad + way_round * math.tau * (k + 1) / CORNERS for k in range(CORNERS)]
    return [(LOOP_M * math.cos(angle), centre_y_m + LOOP_M * math.sin(angle)) for angle in angles]


FIGURE_OF_EIGHT: tuple[Journey, ...] = (Waypoints((*_loop(LOOP_M, 1.0), *_loop(-LOOP_M, -1.0))), Face(0.0))
"""Two loops of 0.5 m radius, left round and right round, as polygons of twelve sides."""

TAPE_M = 0.001
"""A person reads a tape measure to the millimetre."""


@dataclass(frozen=True)
class CourseResult:
    """The robot's true distance from its start at the end, and the length of its path."""

    off_m: float
    way_m: float
    heading_deg: float

    @property
    def closing_share(self) -> float:
        """The closing error as a share of the path."""
        return self.off_m / self.way_m


def drive_course(
    course: tuple[Journey, ...], drive: Drive, truth: TrueWheels, seed: int, kind: Kind = "dynamixel"
) -> CourseResult:
    """Drive it once. Raises CalibrationError if a journey fails."""
    robot = VirtualRobot(kind, seed, drive, truth)
    robot.wheels.open()
    way_m = 0.0
    last = robot.pose

    def measure() -> None:
        nonlocal way_m, last
        way_m += math.hypot(robot.pose.x_m - last.x_m, robot.pose.y_m - last.y_m)
        last = robot.pose

    for journey in course:
        if robot.carry_out(journey, measure) is not MotionState.ARRIVED:
            raise CalibrationError(robot.navigator.reason)
    robot.wheels.close()
    heading_deg = math.degrees(math.remainder(robot.pose.heading_rad, math.tau))
    return CourseResult(math.hypot(robot.pose.x_m, robot.pose.y_m), way_m, heading_deg)


def calibrate_by_tape(drive: Drive, truth: TrueWheels, seed: int, kind: Kind = "dynamixel") -> Drive:
    """The result of `hvcpctl drive calibrate`, with the true pose read off to the millimetre as the tape measure."""
    robot = VirtualRobot(kind, seed, drive, truth)
    robot.wheels.open()
    start = robot.pose

    def perform(journey: Journey) -> None:
        nonlocal start
        if not isinstance(journey, Face):
            start = robot.pose
        if robot.carry_out(journey) is not MotionState.ARRIVED:
            raise CalibrationError(robot.navigator.reason)

    def ask(_name: str) -> Measured:
        place = relative(robot.pose, start)
        return Measured(round(place.x_m / TAPE_M) * TAPE_M, round(place.y_m / TAPE_M) * TAPE_M)

    result = calibrate(drive, lambda: robot.odometry.pose, perform, ask)
    robot.wheels.close()
    return result
