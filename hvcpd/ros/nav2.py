"""A client of Nav2's action NavigateToPose."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hvcpd.ports import PlaceGoal
from hvcpd.ros.action_rclpy import RclpyAction, Server
from hvcpd.ros.convert import Dialect, to_ros
from hvcpd.ros.messages import Header, Point, Pose, PoseStamped, Quaternion, Time
from hvcpd.ros.port import Listener, Report


class Nav2(RclpyAction):
    """One goal at a time, in the frame `frame`; what becomes of it is reported to the bridge."""

    def __init__(
        self,
        server: Server,
        frame: str,
        dialect: Dialect,
        in_turn: Callable[[Callable[[], None]], None],
        report: Report,
    ) -> None:
        def tell_way(number: int, feedback: Any) -> None:
            way_left_m = float(feedback.distance_remaining)
            report(lambda bridge, _: bridge.goal_progress(number, way_left_m))

        def tell_end(number: int, reason: str, _result: Any) -> None:
            report(lambda bridge, _: bridge.goal_ended(number, not reason, reason))

        super().__init__(server, Listener(tell_way, tell_end), in_turn)
        self._frame = frame
        self._dialect = dialect

    def go(self, goal: PlaceGoal, now_s: float, stamp_s: float) -> None:
        """Ask for a goal; the base may come to rest with any heading."""
        target = PoseStamped(Header(Time.of(stamp_s), self._frame), Pose(Point(goal.x_m, goal.y_m), Quaternion()))

        def fill(message: Any) -> None:
            message.pose = to_ros(target, self._dialect)

        self.ask(goal.number, fill, now_s)
