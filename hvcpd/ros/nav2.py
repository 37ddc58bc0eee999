"""A client of Nav2's action NavigateToPose, over rclpy's action client; the bridge's thread only."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from hvcpd.ports import PlaceGoal
from hvcpd.ros.convert import Dialect, to_ros
from hvcpd.ros.messages import Header, Point, Pose, PoseStamped, Quaternion, Time
from hvcpd.ros.port import Report

SUCCEEDED = 4
ENDS = {5: "canceled", 6: "aborted"}
"""action_msgs/GoalStatus: what a result can be."""
ANSWER_S = 3.0
"""A server that has not taken or refused a goal by then is not there."""


class Nav2:
    """One goal at a time; what becomes of it is reported to the bridge. `in_turn` has the bridge's thread do it."""

    def __init__(
        self,
        name: str,
        frame: str,
        client: Any,
        make_goal: Callable[[], Any],
        dialect: Dialect,
        in_turn: Callable[[Callable[[], None]], None],
        report: Report,
    ) -> None:
        self._name = name
        self._frame = frame
        self._client = client
        self._make_goal = make_goal
        self._dialect = dialect
        self._in_turn = in_turn
        self._report = report
        self._goal: PlaceGoal | None = None
        self._asked_s = -math.inf
        self._handle: Any = None

    def go(self, goal: PlaceGoal, now_s: float, stamp_s: float) -> None:
        """Ask for a goal; the base may come to rest with any heading."""
        self._goal, self._handle, self._asked_s = goal, None, now_s
        message = self._make_goal()
        pose = Pose(Point(goal.x_m, goal.y_m), Quaternion())
        message.pose = to_ros(PoseStamped(Header(Time.of(stamp_s), self._frame), pose), self._dialect)

        def progress(feedback: Any) -> None:
            way_left_m = float(feedback.feedback.distance_remaining)
            self._report(lambda bridge, _: bridge.goal_progress(goal.number, way_left_m))

        answered = self._client.send_goal_async(message, feedback_callback=progress)
        answered.add_done_callback(lambda done: self._in_turn(lambda: self._answered(goal, done.result())))

    def cancel(self, number: int) -> None:
        """Withdraw the goal of that number; one that is not yet taken is withdrawn as soon as it is."""
        if self._goal is not None and self._goal.number == number:
            handle, self._goal, self._handle = self._handle, None, None
            if handle is not None:
                handle.cancel_goal_async()

    def tick(self, now_s: float) -> None:
        """A server that is not there will not bring the base anywhere."""
        if self._goal is not None and self._handle is None and now_s - self._asked_s > ANSWER_S:
            self._end(self._goal, False, f"no action server answers at {self._name}; is Nav2 running?")

    def _answered(self, goal: PlaceGoal, handle: Any) -> None:
        if goal != self._goal:
            if handle.accepted:
                handle.cancel_goal_async()
        elif not handle.accepted:
            self._end(goal, False, "rejected")
        else:
            self._handle = handle
            ended = handle.get_result_async()
            ended.add_done_callback(lambda done: self._in_turn(lambda: self._ended(goal, done.result().status)))

    def _ended(self, goal: PlaceGoal, status: int) -> None:
        if goal == self._goal:
            how = "" if status == SUCCEEDED else ENDS.get(status, f"ended with status {status}")
            self._end(goal, status == SUCCEEDED, how)

    def _end(self, goal: PlaceGoal, arrived: bool, reason: str) -> None:
        self._goal, self._handle = None, None
        self._report(lambda bridge, _: bridge.goal_ended(goal.number, arrived, reason))
