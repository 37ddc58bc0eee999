"""From a goal of several legs to wheel speeds: follows them in turn, backs off once from an obstacle. Pure.

A motion is renewed by readings of the wheels: without any for the length of its lease it stands still, since nobody
knows where the robot is, and without any for longer it has failed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hvcpd.hardware.kinematics import BURGER, Drive, twist_of, wrap_angle
from hvcpd.hardware.motion import Forward, Goal, GoTo, MotionController, MotionState, Turn
from hvcpd.hardware.stall import StallWatch
from hvcpd.ports import STANDSTILL, Pose, WheelCommand, WheelReading


@dataclass(frozen=True)
class Face:
    """Turn on the spot to a heading, by the shorter way."""

    heading_rad: float


@dataclass(frozen=True)
class Waypoints:
    """Go to these places (x, y in m) one after the other; the robot comes to rest at each."""

    places: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Dock:
    """Go back to a pose, for example the start, and turn to its heading."""

    pose: Pose


Journey = Goal | Face | Waypoints | Dock
Leg = Goal | Face

BACK_OFF_M = 0.05
"""Back from an obstacle: enough to be free of it, and little enough to hit nothing behind."""
BACK_OFF_RAD = math.radians(10.0)
"""Back from an obstacle met in turning."""
REST_S = 0.3
"""Rest of the wheels between hitting something and backing off: they come to a stand, and people see why."""
RAD_AS_M = 0.1
"""A radian of turning weighs as much as this way (half the wheels' separation, rounded up), for the progress."""
BLIND_LIMIT_S = 4.0
"""Time without a reading after which the motion has failed; as long as without progress."""


class Navigator:
    """Carries out one journey at a time. `step` at every block, with a reading of the wheels whenever there is one."""

    def __init__(self, drive: Drive = BURGER) -> None:
        self._drive = drive
        self._motion = MotionController(drive)
        self._retreat = MotionController(drive)
        self._stall = StallWatch()
        self._legs: list[Leg] = []
        self._weights: list[float] = []
        self._index = 0
        self.state = MotionState.IDLE
        """What has become of the last journey."""
        self.reason = ""
        """Why it failed; empty otherwise."""
        self._command = STANDSTILL
        self._seen_s: float | None = None
        self._stalls = 0
        self._rest_until_s: float | None = None

    @property
    def progress(self) -> float:
        """Done share of the journey, 0 to 1, never falling."""
        if self.state is MotionState.ARRIVED:
            return 1.0
        if not self._legs:
            return 0.0
        done = sum(self._weights[: self._index]) + self._weights[self._index] * self._motion.progress
        return done / sum(self._weights)

    def start(self, journey: Journey, pose: Pose) -> None:
        """Begin a journey from `pose`, in place of any other. Raises ValueError for one that is empty or no number."""
        self._legs = _legs(journey)
        if not self._legs:
            raise ValueError("a journey needs a place to go to")
        self._weights = _weights(self._legs, pose)
        self._index = 0
        self.state, self.reason = MotionState.MOVING, ""
        self._command = STANDSTILL
        self._seen_s = None
        self._stalls, self._rest_until_s = 0, None
        self._stall.clear()
        self._retreat.cancel()
        self._start_leg(pose)

    def cancel(self) -> None:
        """Forget the journey and stand still at once."""
        self._motion.cancel()
        self._retreat.cancel()
        self._legs, self.state, self._command = [], MotionState.IDLE, STANDSTILL

    def rest(self) -> None:
        """The wheels are made to stand, and the journey stays: it goes on with the next `step`, from zero speed.

        The caller's time must rest too: `now_s` of the next step is to follow that of the last one.
        """
        self._command = STANDSTILL
        self._stall.clear()
        self._motion.rest()
        self._retreat.rest()

    def step(self, pose: Pose, now_s: float, reading: WheelReading | None) -> WheelCommand:
        """The wheel speeds from now on; `reading` is None if the wheels were not read since the last step."""
        if self.state is not MotionState.MOVING:
            return STANDSTILL
        if self._seen_s is None or reading is not None:
            self._seen_s = now_s
        if now_s - self._seen_s > BLIND_LIMIT_S:
            return self._fail(f"the wheels have not answered for {BLIND_LIMIT_S:.0f} s")
        if reading is not None and self._stall.stalled(self._command, reading, now_s):
            self._met_obstacle(now_s)
        if self.state is MotionState.MOVING:
            self._command = self._go_on(pose, now_s, reading)
        return self._command

    def _go_on(self, pose: Pose, now_s: float, reading: WheelReading | None) -> WheelCommand:
        if self._rest_until_s is not None:
            if now_s < self._rest_until_s or reading is None:
                return STANDSTILL
            self._rest_until_s = None
            self._retreat.start(self._way_back, pose)
        retreating = self._retreat.state is MotionState.MOVING
        motion = self._retreat if retreating else self._motion
        if reading is not None:
            motion.renew(now_s)
        command = motion.step(pose, now_s)
        if retreating:
            return command
        if motion.state is MotionState.FAILED:
            return self._fail(motion.reason)
        if motion.state is MotionState.ARRIVED:
            return self._next_leg(pose)
        return command

    def _met_obstacle(self, now_s: float) -> None:
        self._stalls += 1
        self._stall.clear()
        self._motion.rest()  # afterwards speed rises from zero again
        if self._stalls > 1:
            self._fail("a wheel is blocked: something is in the way, and backing off did not help")
            return
        twist = twist_of(self._command, self._drive)
        turning = abs(twist.linear_m_s) < abs(twist.angular_rad_s) * RAD_AS_M
        self._way_back: Goal = (
            Turn(-math.copysign(BACK_OFF_RAD, twist.angular_rad_s))
            if turning
            else Forward(-math.copysign(BACK_OFF_M, twist.linear_m_s))
        )
        self._retreat.cancel()
        self._rest_until_s = now_s + REST_S

    def _next_leg(self, pose: Pose) -> WheelCommand:
        if self._index + 1 == len(self._legs):
            self.state = MotionState.ARRIVED
        else:
            self._index += 1
            self._start_leg(pose)
        return STANDSTILL

    def _start_leg(self, pose: Pose) -> None:
        leg = self._legs[self._index]
        self._motion.start(Turn(wrap_angle(leg.heading_rad - pose.heading_rad)) if isinstance(leg, Face) else leg, pose)

    def _fail(self, reason: str) -> WheelCommand:
        self.state, self.reason = MotionState.FAILED, reason
        self._command = STANDSTILL
        return STANDSTILL


def _legs(journey: Journey) -> list[Leg]:
    match journey:
        case Waypoints(places):
            return [GoTo(x_m, y_m) for x_m, y_m in places]
        case Dock(pose):
            return [GoTo(pose.x_m, pose.y_m), Face(pose.heading_rad)]
        case _:
            return [journey]


def _weights(legs: list[Leg], pose: Pose) -> list[float]:
    """The length of each leg in m, turns converted; never zero."""
    here = (pose.x_m, pose.y_m)
    weights = []
    for leg in legs:
        match leg:
            case GoTo(x_m, y_m):
                weights.append(math.dist(here, (x_m, y_m)))
                here = (x_m, y_m)
            case Forward(distance_m):
                weights.append(abs(distance_m))
            case Turn(angle_rad):
                weights.append(abs(angle_rad) * RAD_AS_M)
            case Face():
                weights.append(math.pi / 2.0 * RAD_AS_M)
    return [max(weight, 1e-3) for weight in weights]
