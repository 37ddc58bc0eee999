"""Places as goals of ROS's navigation: of move_base in ROS 1, of Nav2 in ROS 2."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from hvcpd.ports import PlaceGoal
from hvcpd.ros.convert import Dialect, to_ros
from hvcpd.ros.messages import Header, Point, Pose, PoseStamped, Time
from hvcpd.ros.port import Listener, Report


class Navigation:
    """One goal at a time, in the frame `frame`; what becomes of it is reported to the bridge.

    `make_client` makes the action's client (`action_topics.py`, `action_rclpy.py`), whose goals have their pose in
    `field`; `way_left_m` tells from a feedback and the goal how far it is still.
    """

    def __init__(
        self,
        make_client: Callable[[Listener], Any],
        field: str,
        frame: str,
        dialect: Dialect,
        report: Report,
        way_left_m: Callable[[Any, PlaceGoal], float],
    ) -> None:
        self.client = make_client(Listener(self._fed_back, self._ended))
        self._field = field
        self._frame = frame
        self._dialect = dialect
        self._report = report
        self._way_left_m = way_left_m
        self._goal = PlaceGoal(0, 0.0, 0.0)

    def go(self, goal: PlaceGoal, now_s: float, stamp_s: float) -> None:
        """Ask for a goal. The base may come to rest with any heading."""
        self._goal = goal
        target = PoseStamped(Header(Time.of(stamp_s), self._frame), Pose(Point(goal.x_m, goal.y_m)))
        pose = to_ros(target, self._dialect)
        self.client.ask(goal.number, lambda message: setattr(message, self._field, pose), now_s, stamp_s)

    def _fed_back(self, number: int, feedback: Any) -> None:
        way_left_m = self._way_left_m(feedback, self._goal)
        self._report(lambda bridge, _: bridge.goal_progress(number, way_left_m))

    def _ended(self, number: int, reason: str, _result: Any) -> None:
        self._report(lambda bridge, _: bridge.goal_ended(number, not reason, reason))


def move_base_left_m(feedback: Any, goal: PlaceGoal) -> float:
    """How far it is to a goal by move_base's feedback, which has the base's place."""
    here = feedback.base_position.pose.position
    return math.hypot(goal.x_m - here.x, goal.y_m - here.y)


def nav2_left_m(feedback: Any, _goal: PlaceGoal) -> float:
    """How far it is to the goal by Nav2's feedback."""
    return float(feedback.distance_remaining)
