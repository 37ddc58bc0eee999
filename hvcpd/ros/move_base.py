"""A client of ROS 1's move_base, over the topics of its action (ROS wiki, "actionlib/DetailedDescription").

actionlib's own client waits in threads; the topics are all that it takes.
"""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable
from typing import Any

from hvcpd.ports import PlaceGoal
from hvcpd.ros.convert import Dialect, ros_class, to_ros
from hvcpd.ros.messages import Header, Point, Pose, PoseStamped, Quaternion, Time

SUCCEEDED = 3
ENDS = {2: "preempted", 4: "aborted", 5: "rejected", 8: "recalled", 9: "lost"}
"""actionlib_msgs/GoalStatus: what a result can be beside SUCCEEDED."""
SILENT_S = 3.0
"""Silence after which there is no action server: it sends its status five times a second."""


class MoveBase:
    """One goal at a time. `send` and `withdraw` publish; `ended` and `progress` are told what becomes of it.

    Nothing is sent before `is_connected`: what is published to nobody is lost.
    """

    def __init__(
        self,
        name: str,
        frame: str,
        send: Callable[[Any], None],
        withdraw: Callable[[Any], None],
        is_connected: Callable[[], bool],
        ended: Callable[[int, bool, str], None],
        progress: Callable[[int, float], None],
        dialect: Dialect,
    ) -> None:
        self._name = name
        self._frame = frame
        self._send = send
        self._withdraw = withdraw
        self._is_connected = is_connected
        self._ended = ended
        self._progress = progress
        self._dialect = dialect
        self._run = secrets.token_hex(4)
        self._goal: PlaceGoal | None = None
        self._unsent: Any = None
        self._heard_s = -math.inf
        self._serial = 0
        self._id = ""

    def go(self, goal: PlaceGoal, now_s: float, stamp_s: float) -> None:
        """Ask for a goal; the server forgets any other. The base may come to rest with any heading."""
        self._goal, self._heard_s = goal, now_s
        self._serial += 1
        self._id = f"hvcpd-{self._run}-{self._serial}"
        stamp = Time.of(stamp_s)
        pose = Pose(Point(goal.x_m, goal.y_m), Quaternion())
        message = ros_class("move_base_msgs/MoveBaseActionGoal")()
        message.header = to_ros(Header(stamp), self._dialect)
        message.goal_id.stamp, message.goal_id.id = to_ros(stamp, self._dialect), self._id
        message.goal.target_pose = to_ros(PoseStamped(Header(stamp, self._frame), pose), self._dialect)
        self._unsent = message
        self._send_if_connected()

    def _send_if_connected(self) -> None:
        if self._unsent is not None and self._is_connected():
            message, self._unsent = self._unsent, None
            self._send(message)

    def cancel(self, number: int) -> None:
        """Withdraw the goal of that number."""
        if self._goal is not None and self._goal.number == number:
            self.cancel_any()

    def cancel_any(self) -> None:
        """Withdraw the goal that there is."""
        if self._goal is not None and self._unsent is None:
            message = ros_class("actionlib_msgs/GoalID")()
            message.id = self._id
            self._withdraw(message)
        self._goal = self._unsent = None

    def take_status(self, _message: Any, now_s: float) -> None:
        """The server lives."""
        if self._unsent is None:
            self._heard_s = now_s

    def take_feedback(self, message: Any, now_s: float) -> None:
        """Where the base is by now."""
        self._heard_s = now_s
        if self._goal is not None and message.status.goal_id.id == self._id:
            place = message.feedback.base_position.pose.position
            self._progress(self._goal.number, math.hypot(self._goal.x_m - place.x, self._goal.y_m - place.y))

    def take_result(self, message: Any, now_s: float) -> None:
        """The server has ended with a goal."""
        self._heard_s = now_s
        if self._goal is None or message.status.goal_id.id != self._id:
            return
        number, self._goal = self._goal.number, None
        status = message.status.status
        how = ENDS.get(status, f"ended with status {status}")
        self._ended(number, status == SUCCEEDED, "" if status == SUCCEEDED else f"{how}: {message.status.text}")

    def tick(self, now_s: float) -> None:
        """A server that is not there will not bring the base anywhere."""
        self._send_if_connected()
        if self._goal is not None and now_s - self._heard_s > SILENT_S:
            number, self._goal, self._unsent = self._goal.number, None, None
            self._ended(number, False, f"no action server answers at {self._name}; is move_base running?")
