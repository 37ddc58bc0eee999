"""Ways that somebody else finds: the place of a task becomes a goal of ROS's navigation. Pure.

Turning on the spot and driving straight on stay our own: they need no map.
"""

from __future__ import annotations

from hvcpd.hardware.kinematics import BURGER, Drive
from hvcpd.hardware.motion import GoTo, MotionState
from hvcpd.hardware.navigator import BLIND_LIMIT_S, Journey, Navigator
from hvcpd.ports import STANDSTILL, PlaceGoal, Pose, WheelCommand, WheelReading


class GoalNavigator(Navigator):
    """A navigator whose `GoTo` is carried out elsewhere: `goal` is what is wanted now, `tell` what has become of it."""

    def __init__(self, drive: Drive = BURGER) -> None:
        super().__init__(drive)
        self._place: GoTo | None = None
        self._goal: PlaceGoal | None = None
        self._last_number = 0
        self._outcome = MotionState.MOVING
        self._why = ""
        self._read_s: float | None = None

    @property
    def goal(self) -> PlaceGoal | None:
        """Where the base is to go just now; None: it is to leave that to the wheels' speeds."""
        return self._goal

    @property
    def state(self) -> MotionState:
        """What has become of the last journey."""
        return self._outcome if self._place is not None else super().state

    @property
    def reason(self) -> str:
        """Why it failed; empty otherwise."""
        return self._why if self._place is not None else super().reason

    def start(self, journey: Journey, pose: Pose) -> None:
        """Begin a journey in place of any other, as `Navigator.start`."""
        super().cancel()
        self._place, self._goal = None, None
        if isinstance(journey, GoTo):
            self._place, self._outcome, self._why, self._read_s = journey, MotionState.MOVING, "", None
        else:
            super().start(journey, pose)

    def cancel(self) -> None:
        """Forget the journey; the goal is withdrawn."""
        super().cancel()
        self._place, self._goal = None, None

    def rest(self) -> None:
        """Withdraw the goal; the next `step` sends it again."""
        self._goal = None
        super().rest()

    def tell(self, number: int, arrived: bool, reason: str = "") -> None:
        """The goal of that number has been reached, or never will be; one that was withdrawn matters no more."""
        if self._goal is None or self._goal.number != number:
            return
        self._goal = None
        self._outcome, self._why = (MotionState.ARRIVED if arrived else MotionState.FAILED), reason

    def step(self, pose: Pose, now_s: float, reading: WheelReading | None) -> WheelCommand:
        """As `Navigator.step`; standstill while somebody else drives."""
        if self._place is None:
            return super().step(pose, now_s, reading)
        if self._outcome is not MotionState.MOVING:
            return STANDSTILL
        if self._read_s is None or reading is not None:
            self._read_s = now_s
        if now_s - self._read_s > BLIND_LIMIT_S:
            self._goal = None
            self._outcome, self._why = MotionState.FAILED, f"the base has not answered for {BLIND_LIMIT_S:.0f} s"
        elif self._goal is None:
            self._last_number += 1
            self._goal = PlaceGoal(self._last_number, self._place.x_m, self._place.y_m)
        return STANDSTILL
