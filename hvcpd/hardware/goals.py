"""Navigation by ROS: the place of a task becomes a goal of its planner. Pure.

Turning on the spot and driving straight on stay our own: they need no map.
"""

from __future__ import annotations

from hvcpd.hardware.kinematics import BURGER, Drive
from hvcpd.hardware.motion import GoTo, MotionState
from hvcpd.hardware.navigator import BLIND_LIMIT_S, Journey, Navigator
from hvcpd.ports import STANDSTILL, PlaceGoal, Pose, WheelCommand, WheelReading


class GoalNavigator(Navigator):
    """A navigator whose `GoTo` is carried out by ROS: `goal` is the present goal, `tell` reports its result."""

    def __init__(self, drive: Drive = BURGER) -> None:
        super().__init__(drive)
        self.goal: PlaceGoal | None = None
        """Where the base is to go just now; None: it is to leave that to the wheels' speeds."""
        self._place: GoTo | None = None
        self._last_number = 0

    def start(self, journey: Journey, pose: Pose) -> None:
        """Begin a journey in place of any other, as `Navigator.start`."""
        self.cancel()
        if isinstance(journey, GoTo):
            self._place, self.state, self.reason, self._seen_s = journey, MotionState.MOVING, "", None
        else:
            super().start(journey, pose)

    def cancel(self) -> None:
        """Forget the journey; the goal is withdrawn."""
        super().cancel()
        self._place = self.goal = None

    def rest(self) -> None:
        """Withdraw the goal; the next `step` sends it again."""
        self.goal = None
        super().rest()

    def tell(self, number: int, arrived: bool, reason: str = "") -> None:
        """Report that the goal of that number was reached, or failed; a withdrawn goal is ignored."""
        if self.goal is not None and self.goal.number == number:
            self.goal = None
            self.state, self.reason = (MotionState.ARRIVED if arrived else MotionState.FAILED), reason

    def step(self, pose: Pose, now_s: float, reading: WheelReading | None) -> WheelCommand:
        """As `Navigator.step`; standstill while ROS drives."""
        if self._place is None:
            return super().step(pose, now_s, reading)
        if self.state is not MotionState.MOVING:
            return STANDSTILL
        if self._seen_s is None or reading is not None:
            self._seen_s = now_s
        if now_s - self._seen_s > BLIND_LIMIT_S:
            self.goal = None
            return self._fail(f"the base has not answered for {BLIND_LIMIT_S:.0f} s")
        if self.goal is None:
            self._last_number += 1
            self.goal = PlaceGoal(self._last_number, self._place.x_m, self._place.y_m)
        return STANDSTILL
