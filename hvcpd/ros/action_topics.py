"""A client of a ROS 1 action, over the topics of the action (ROS wiki, "actionlib/DetailedDescription").

actionlib's own client waits in threads; the topics are all that it takes.
"""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from hvcpd.ros.convert import Dialect, ros_class, to_ros
from hvcpd.ros.messages import Header, Time
from hvcpd.ros.port import Listener

SUCCEEDED = 3
ENDS = {2: "preempted", 4: "aborted", 5: "rejected", 8: "recalled", 9: "lost"}
"""actionlib_msgs/GoalStatus: what a result can be beside SUCCEEDED."""
SILENT_S = 3.0
"""Silence after which there is no action server: it sends its status five times a second."""


@dataclass(frozen=True)
class Link:
    """The way to an action server: `send` and `withdraw` publish a goal and a cancel. Nothing is sent before
    `is_connected`: what is published to nobody is lost."""

    send: Callable[[Any], None]
    withdraw: Callable[[Any], None]
    is_connected: Callable[[], bool]


class TopicAction:
    """One goal at a time, for the action `name` of the type `kind` ("move_base_msgs/MoveBase"); `whose` server it is
    stands in what people are told."""

    def __init__(self, name: str, kind: str, link: Link, listener: Listener, dialect: Dialect, whose: str) -> None:
        self._name = name
        self._kind = kind
        self._link = link
        self._listener = listener
        self._dialect = dialect
        self._whose = whose
        self._run = secrets.token_hex(4)
        self._number: int | None = None
        self._unsent: Any = None
        self._heard_s = -math.inf
        self._serial = 0
        self._id = ""

    def ask(self, number: int, fill: Callable[[Any], None], now_s: float, stamp_s: float) -> None:
        """Ask for a goal, which `fill` writes into its message; the server forgets any other."""
        message = ros_class(f"{self._kind}ActionGoal")()
        fill(message.goal)
        self._number, self._heard_s = number, now_s
        self._serial += 1
        self._id = f"hvcpd-{self._run}-{self._serial}"
        stamp = Time.of(stamp_s)
        message.header = to_ros(Header(stamp), self._dialect)
        message.goal_id.stamp, message.goal_id.id = to_ros(stamp, self._dialect), self._id
        self._unsent = message
        self._send_if_connected()

    def cancel(self, number: int) -> None:
        """Withdraw the goal of that number."""
        if self._number == number:
            self.cancel_any()

    def cancel_any(self) -> None:
        """Withdraw the goal that there is."""
        if self._number is not None and self._unsent is None:
            message = ros_class("actionlib_msgs/GoalID")()
            message.id = self._id
            self._link.withdraw(message)
        self._number = self._unsent = None

    def take_status(self, _message: Any, now_s: float) -> None:
        """The server lives."""
        if self._unsent is None:
            self._heard_s = now_s

    def take_feedback(self, message: Any, now_s: float) -> None:
        """How far the server is by now."""
        self._heard_s = now_s
        if self._number is not None and message.status.goal_id.id == self._id:
            self._listener.fed_back(self._number, message.feedback)

    def take_result(self, message: Any, now_s: float) -> None:
        """The server has ended with a goal."""
        self._heard_s = now_s
        if self._number is None or message.status.goal_id.id != self._id:
            return
        number, self._number = self._number, None
        status = message.status.status
        how = ENDS.get(status, f"ended with status {status}")
        text = f"{how}: {message.status.text}" if message.status.text else how
        self._listener.ended(number, "" if status == SUCCEEDED else text, message.result)

    def tick(self, now_s: float) -> None:
        """A server that is not there will not do anything."""
        self._send_if_connected()
        if self._number is not None and now_s - self._heard_s > SILENT_S:
            number, self._number, self._unsent = self._number, None, None
            reason = f"no action server answers at {self._name}; is {self._whose} running?"
            self._listener.ended(number, reason, None)

    def _send_if_connected(self) -> None:
        if self._unsent is not None and self._link.is_connected():
            message, self._unsent = self._unsent, None
            self._link.send(message)
