"""From a goal to wheel speeds, closed over the odometry's pose. Pure: every call brings its own time.

Each motion is bounded in way and time, its speed follows a trapezoid, and it is leased: without `renew` the wheels
stand within half a second, so that a program that hangs does not drive. Distances run along the robot's heading,
turns count counter-clockwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from hvcpd.hardware.kinematics import BURGER, Drive, Twist, wheel_command, wrap_angle
from hvcpd.ports import STANDSTILL, Pose, WheelCommand


@dataclass(frozen=True)
class GoTo:
    """Drive to a place in the odometry's frame, whatever the heading there."""

    x_m: float
    y_m: float


@dataclass(frozen=True)
class Forward:
    """Drive straight on by a distance; backward if it is negative."""

    distance_m: float


@dataclass(frozen=True)
class Turn:
    """Turn on the spot; more than one whole turn is possible."""

    angle_rad: float


Goal = GoTo | Forward | Turn


class MotionState(Enum):
    """The state of the last goal."""

    IDLE = "idle"
    MOVING = "moving"
    ARRIVED = "arrived"
    FAILED = "failed"


# Limits and tolerances of a Burger on a classroom floor; gentler than ROBOTIS's own, against slipping wheels.
SPEED_M_S = 0.2
"""Top speed; the wheels allow 0.211 m/s, and the rest is left for steering."""
ACCELERATION_M_S2 = 0.25
TURN_RATE_RAD_S = 1.5
TURN_ACCELERATION_RAD_S2 = 3.0
"""ROBOTIS's navigation parameters for the Burger allow 2.5 m/s² and 3.2 rad/s²."""
LAG_S = 0.25
"""Braking starts this much earlier. Twice the motors' lag of about 0.1 s and a control period of up to 50 ms, so
that the approach is well damped (0.8 for a first-order motor)."""
TOLERANCE_M = 0.03
TOLERANCE_RAD = math.radians(2.0)
"""Arrival is within these."""
SETTLE_M = 0.002
SETTLE_RAD = math.radians(0.2)
"""What the controller aims at; an encoder's flicker over the wheel base allows nothing nearer."""
SETTLE_TIME_S = 1.0
"""Within tolerance for this long is arrived too, if friction keeps the wheels from the last millimetres."""
AIM_RAD = math.radians(20.0)
"""With the target further off the bow than this, turn on the spot first."""
AIMED_RAD = math.radians(1.0)
"""Turning on the spot ends when the target is this near the bow."""
LEASE_S = 0.25
"""Silence of `renew` after which the wheels are told to stand; from top speed they take up to 0.23 s for that."""
PATIENCE_S = 4.0
"""Without progress for this long the motion has failed."""
SLACK = 3.0
"""Factor by which a motion may take longer, beside PATIENCE_S, before it has failed."""
STEP_LIMIT_S = 0.1
"""Longest time that one step counts for the ramps; after a longer pause speed still rises gently."""

STEER_GAIN_PER_S = 2.0
"""Turning rate per radian of heading error while driving: the error halves every 0.35 s, slow against the lag."""

PROGRESS_SHARE = 0.25
"""A new best that is this share of the tolerance better counts as progress."""


class MotionController:
    """Carries out one goal at a time. Call `step` at 20 to 50 Hz, and `renew` while the motion is wanted."""

    def __init__(self, drive: Drive = BURGER) -> None:
        self._drive = drive
        self._goal: Goal | None = None
        self.state = MotionState.IDLE
        """The state of the last goal."""
        self.reason = ""
        """Why the motion failed; empty otherwise."""
        self._renewed_s = -math.inf
        self._twist = Twist()
        self._last_s: float | None = None
        self._clear()

    def _clear(self) -> None:
        self._turned_rad = 0.0
        self._origin = Pose(0.0, 0.0)
        self._last_heading_rad = 0.0
        self._aiming = False
        self._total = 1.0
        self.progress = 0.0
        """Done share of the goal, 0 to 1, never falling."""
        self._driven_s = 0.0
        self._best = math.inf
        self._best_s: float | None = None
        self._near_since_s: float | None = None
        self._settled_since_s: float | None = None

    def start(self, goal: Goal, pose: Pose) -> None:
        """Begin a motion from `pose`, in place of any other. Raises ValueError for a goal that is no number."""
        if not all(math.isfinite(value) for value in vars(goal).values()):
            raise ValueError(f"a goal must be finite: {goal}")
        self._clear()
        self._goal = goal
        self.state = MotionState.MOVING
        self.reason = ""
        self._origin = pose
        self._last_heading_rad = pose.heading_rad
        self._aiming = isinstance(goal, GoTo)
        self._total = max(abs(self._remaining(goal, pose)), 1e-9)

    def cancel(self) -> None:
        """Forget the goal and stand still at once."""
        self._goal = None
        self.state = MotionState.IDLE
        self._twist = Twist()

    def rest(self) -> None:
        """The wheels were made to stand, and the goal stays: from here on speed rises from zero again."""
        self._twist = Twist()

    def renew(self, now_s: float) -> None:
        """The motion is still wanted."""
        self._renewed_s = now_s

    @property
    def limit_s(self) -> float:
        """The longest time that the motion may drive: a multiple of its way at top speed."""
        turning = isinstance(self._goal, Turn)
        top = TURN_RATE_RAD_S if turning else SPEED_M_S
        turn_s = math.pi / TURN_RATE_RAD_S if isinstance(self._goal, GoTo) else 0.0
        return PATIENCE_S + SLACK * (self._total / top + turn_s)

    def step(self, pose: Pose, now_s: float) -> WheelCommand:
        """The wheel speeds from now on. Standstill without a goal, at its end, and when the lease has run out."""
        dt_s = 0.0 if self._last_s is None else min(max(now_s - self._last_s, 0.0), STEP_LIMIT_S)
        self._last_s = now_s
        self._turned_rad += wrap_angle(pose.heading_rad - self._last_heading_rad)
        self._last_heading_rad = pose.heading_rad
        if self._goal is None or self.state is not MotionState.MOVING:
            return self._stand_still()
        if now_s - self._renewed_s > LEASE_S:
            self._best_s = None
            return self._stand_still()
        if self._arrived(self._goal, pose, now_s):
            self.state = MotionState.ARRIVED
            self.progress = 1.0
            return self._stand_still()
        self._driven_s += dt_s
        if self._stuck(self._goal, pose, now_s):
            self.state = MotionState.FAILED
            return self._stand_still()
        self._twist = self._ramp(self._wanted(self._goal, pose), dt_s)
        return wheel_command(self._twist, self._drive)

    def _stand_still(self) -> WheelCommand:
        self._twist = Twist()
        return STANDSTILL

    def _remaining(self, goal: Goal, pose: Pose) -> float:
        """What is left, with its sign: metres ahead, or radians to turn."""
        match goal:
            case Turn(angle_rad):
                return angle_rad - self._turned_rad
            case Forward(distance_m):
                dx_m, dy_m = pose.x_m - self._origin.x_m, pose.y_m - self._origin.y_m
                course_rad = self._origin.heading_rad
                return distance_m - (dx_m * math.cos(course_rad) + dy_m * math.sin(course_rad))
            case GoTo(x_m, y_m):
                return math.hypot(x_m - pose.x_m, y_m - pose.y_m)

    def _bearing(self, goal: GoTo, pose: Pose) -> float:
        """Direction of the place, counted from the bow."""
        return wrap_angle(math.atan2(goal.y_m - pose.y_m, goal.x_m - pose.x_m) - pose.heading_rad)

    def _wanted(self, goal: Goal, pose: Pose) -> Twist:
        """The motion that leads to the goal, before the ramps."""
        remaining = self._remaining(goal, pose)
        match goal:
            case Turn():
                return Twist(0.0, self._turn_rate(remaining))
            case Forward():
                error_rad = wrap_angle(self._origin.heading_rad - pose.heading_rad)
                return Twist(self._speed(remaining), STEER_GAIN_PER_S * error_rad)
            case GoTo():
                return self._towards(self._bearing(goal, pose), remaining)

    def _towards(self, bearing_rad: float, distance_m: float) -> Twist:
        """Turn on the spot until the place lies ahead, then drive and steer."""
        near = distance_m <= TOLERANCE_M
        if not self._aiming and not near and abs(bearing_rad) > AIM_RAD:
            self._aim(True)
        elif self._aiming and (near or abs(bearing_rad) < AIMED_RAD):
            self._aim(False)
        if self._aiming:
            return Twist(0.0, self._turn_rate(bearing_rad))
        steer_rad_s = 0.0 if near else STEER_GAIN_PER_S * bearing_rad  # close by, the bearing swings too fast
        return Twist(self._speed(distance_m * math.cos(bearing_rad)), steer_rad_s)

    def _aim(self, aiming: bool) -> None:
        """Change between turning and driving; progress is then measured in other units."""
        self._aiming = aiming
        self._best_s = None

    def _speed(self, ahead_m: float) -> float:
        return _profile(ahead_m, SPEED_M_S, ACCELERATION_M_S2, LAG_S)

    def _turn_rate(self, left_rad: float) -> float:
        return _profile(left_rad, TURN_RATE_RAD_S, TURN_ACCELERATION_RAD_S2, LAG_S)

    def _ramp(self, wanted: Twist, dt_s: float) -> Twist:
        """Change speed no faster than the accelerations allow."""
        return Twist(
            _slew(self._twist.linear_m_s, wanted.linear_m_s, ACCELERATION_M_S2 * dt_s),
            _slew(self._twist.angular_rad_s, wanted.angular_rad_s, TURN_ACCELERATION_RAD_S2 * dt_s),
        )

    def _arrived(self, goal: Goal, pose: Pose, now_s: float) -> bool:
        remaining = self._remaining(goal, pose)
        turning = isinstance(goal, Turn)
        tolerance = TOLERANCE_RAD if turning else TOLERANCE_M
        settled = SETTLE_RAD if turning else SETTLE_M
        if isinstance(goal, GoTo) and not self._aiming:
            ahead_m = remaining * math.cos(self._bearing(goal, pose))
        else:
            ahead_m = remaining
        self._near_since_s = _since(self._near_since_s, abs(remaining) <= tolerance, now_s)
        self._settled_since_s = _since(self._settled_since_s, abs(ahead_m) <= settled, now_s)
        if self._near_since_s is None:
            return False
        if self._settled_since_s is not None and now_s - self._settled_since_s >= LAG_S:
            return True  # it stayed there, so the wheels have come to rest
        return now_s - self._near_since_s > SETTLE_TIME_S

    def _stuck(self, goal: Goal, pose: Pose, now_s: float) -> bool:
        """Keep the record of progress; True (with the reason) if there was none for too long."""
        remaining = abs(self._remaining(goal, pose))
        self.progress = max(self.progress, min(1.0 - remaining / self._total, 1.0))
        turning = isinstance(goal, Turn) or self._aiming
        unit = TOLERANCE_RAD if turning else TOLERANCE_M
        measure = abs(self._bearing(goal, pose)) if isinstance(goal, GoTo) and self._aiming else remaining
        if self._best_s is None or measure < self._best - PROGRESS_SHARE * unit:
            self._best, self._best_s = measure, now_s
        if self._driven_s > self.limit_s:
            self.reason = f"not there after {self.limit_s:.0f} s of driving: do the wheels slip?"
            return True
        if now_s - self._best_s <= PATIENCE_S:
            return False
        self.reason = f"no progress for {PATIENCE_S:.0f} s: are the wheels blocked?"
        return True


def _profile(left: float, top: float, acceleration: float, lag_s: float) -> float:
    """Speed from which one can still brake to zero over the way `left`, after `lag_s` of the same speed; signed.

    Solves left = v lag + v²/(2 a) for v.
    """
    reach = acceleration * lag_s
    speed = math.sqrt(reach * reach + 2.0 * acceleration * abs(left)) - reach
    return math.copysign(min(speed, top), left)


def _slew(now: float, wanted: float, step: float) -> float:
    return now + min(max(wanted - now, -step), step)


def _since(since_s: float | None, holds: bool, now_s: float) -> float | None:
    """Since when a condition holds, None if it does not."""
    if not holds:
        return None
    return now_s if since_s is None else since_s
