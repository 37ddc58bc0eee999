"""A client of ROS 1's move_base."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from hvcpd.ports import PlaceGoal
from hvcpd.ros.action_topics import Link, TopicAction
from hvcpd.ros.convert import Dialect, to_ros
from hvcpd.ros.messages import Header, Point, Pose, PoseStamped, Quaternion, Time
from hvcpd.ros.port import Listener


class MoveBase(TopicAction):
    """One goal at a time, in the frame `frame`; `ended` and `progress` are called with its outcome and its progress."""

    def __init__(
        self,
        name: str,
        frame: str,
        link: Link,
        ended: Callable[[int, bool, str], None],
        progress: Callable[[int, float], None],
        dialect: Dialect,
    ) -> None:
        def tell_end(number: int, reason: str, _result: Any) -> None:
            ended(number, not reason, reason)

        listener = Listener(self._tell_way, tell_end)
        super().__init__(name, "move_base_msgs/MoveBase", link, listener, dialect, "move_base")
        self._frame = frame
        self._progress = progress
        self._to_ros = dialect
        self._place = (0.0, 0.0)

    def go(self, goal: PlaceGoal, now_s: float, stamp_s: float) -> None:
        """Ask for a goal. The base may come to rest with any heading."""
        self._place = goal.x_m, goal.y_m
        target = PoseStamped(Header(Time.of(stamp_s), self._frame), Pose(Point(*self._place), Quaternion()))

        def fill(message: Any) -> None:
            message.target_pose = to_ros(target, self._to_ros)

        self.ask(goal.number, fill, now_s, stamp_s)

    def _tell_way(self, number: int, feedback: Any) -> None:
        here = feedback.base_position.pose.position
        self._progress(number, math.hypot(self._place[0] - here.x, self._place[1] - here.y))
