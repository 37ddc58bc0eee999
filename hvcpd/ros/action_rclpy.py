"""A client of a ROS 2 action, over rclpy's action client; the bridge's thread only."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from hvcpd.ros.port import Listener

SUCCEEDED = 4
ENDS = {5: "canceled", 6: "aborted"}
"""action_msgs/GoalStatus: what a result can be."""
ANSWER_S = 3.0
"""A server that has not taken or refused a goal by then is not there; nor is one that ROS has not seen for so long."""


class RclpyAction:
    """One goal at a time, for the action `name`, by rclpy's client of it; `make_goal` makes a goal's message, `whose`
    server it is stands in what people are told, and `in_turn` has the bridge's thread do something."""

    def __init__(
        self,
        name: str,
        client: Any,
        make_goal: Callable[[], Any],
        listener: Listener,
        whose: str,
        in_turn: Callable[[Callable[[], None]], None],
    ) -> None:
        self._name = name
        self._client = client
        self._make_goal = make_goal
        self._listener = listener
        self._whose = whose
        self._in_turn = in_turn
        self._number: int | None = None
        self._there_s = -math.inf
        self._handle: Any = None

    def ask(self, number: int, fill: Callable[[Any], None], now_s: float, stamp_s: float = 0.0) -> None:  # noqa: ARG002
        """Ask for a goal, which `fill` writes into its message; ROS 2 stamps it by itself."""
        message = self._make_goal()
        fill(message)
        self._number, self._handle, self._there_s = number, None, now_s

        def progress(feedback: Any) -> None:
            self._listener.fed_back(number, feedback.feedback)

        answered = self._client.send_goal_async(message, feedback_callback=progress)
        answered.add_done_callback(lambda done: self._in_turn(lambda: self._answered(number, done.result())))

    def cancel(self, number: int) -> None:
        """Withdraw the goal of that number; one that is not yet taken is withdrawn as soon as it is."""
        if self._number == number:
            handle, self._number, self._handle = self._handle, None, None
            if handle is not None:
                handle.cancel_goal_async()

    def tick(self, now_s: float) -> None:
        """A server that is not there will not do anything."""
        if self._handle is not None and self._client.server_is_ready():
            self._there_s = now_s
        if self._number is not None and now_s - self._there_s > ANSWER_S:
            reason = f"no action server answers at {self._name}; is {self._whose} running?"
            self._end(self._number, reason)

    def _answered(self, number: int, handle: Any) -> None:
        if number != self._number:
            if handle.accepted:
                handle.cancel_goal_async()
        elif not handle.accepted:
            self._end(number, "rejected")
        else:
            self._handle = handle
            ended = handle.get_result_async()
            ended.add_done_callback(lambda done: self._in_turn(lambda: self._ended(number, done.result())))

    def _ended(self, number: int, answer: Any) -> None:
        if number == self._number:
            status = answer.status
            how = "" if status == SUCCEEDED else ENDS.get(status, f"ended with status {status}")
            self._end(number, how, getattr(answer, "result", None))

    def _end(self, number: int, reason: str, result: Any = None) -> None:
        self._number, self._handle = None, None
        self._listener.ended(number, reason, result)
