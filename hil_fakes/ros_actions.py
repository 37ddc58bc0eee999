"""Fake action servers: one that speaks ROS 1's action topics, and one behind rclpy's action client.

    python -m hil_fakes.ros_actions --action gripper --type move_base_msgs/MoveBase --takes-s 2 [--fails "it slipped"]

is a ROS 1 node of the first kind, beside the master that ROS_MASTER_URI names. Both take a goal at once, work on it for
`takes_s`, and then succeed, or abort with the reason they were given; a cancel ends a goal at once.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

PERIOD_S = 0.2
"""Between two words of status, as actionlib's server has it."""

ACTIVE, PREEMPTED, SUCCEEDED, ABORTED, RECALLED = 1, 2, 3, 4, 8
"""actionlib_msgs/GoalStatus."""
ROS2_SUCCEEDED, ROS2_CANCELED, ROS2_ABORTED = 4, 5, 6
"""action_msgs/GoalStatus."""


class TopicServer:
    """The server's side of a ROS 1 action's topics; `make` has a message by its type's name, `publish` takes the last
    part of a topic and a message. Time is passed in."""

    def __init__(
        self,
        kind: str,
        make: Callable[[str], Any],
        publish: Callable[[str, Any], None],
        takes_s: float = 1.0,
        fails: str = "",
        mark: Path | None = None,
    ) -> None:
        self._kind = kind
        self._make = make
        self._publish = publish
        self._takes_s = takes_s
        self._fails = fails
        self._mark = mark
        self._until_s = 0.0
        self._told_s = 0.0
        self._goal: Any = None
        self._recalled: set[str] = set()
        self.goals: list[Any] = []
        """All that were taken, the newest last."""
        self.ends: list[int] = []
        """The status with which each ended."""

    def take_goal(self, message: Any, now_s: float) -> None:
        """A goal; one that was under way is preempted."""
        self._end(PREEMPTED)
        self._goal, self._until_s = message, now_s + self._takes_s
        if message.goal_id.id in self._recalled:
            self._end(RECALLED)
            return
        if self._mark is not None:
            self._mark.touch()
        self.goals.append(message.goal)

    def take_cancel(self, message: Any) -> None:
        """Cancel the goal of that identifier, or whatever there is.

        A goal comes over another connection, and may be overtaken: the cancel is kept for it, as in actionlib's server
        (`ActionServer.internal_cancel_callback`)."""
        if self._goal is not None and message.id in ("", self._goal.goal_id.id):
            self._end(PREEMPTED)
        elif message.id:
            self._recalled.add(message.id)

    def tick(self, now_s: float) -> None:
        """Time passes."""
        if self._goal is not None and now_s >= self._until_s:
            self._end(ABORTED if self._fails else SUCCEEDED, self._fails)
        if now_s - self._told_s >= PERIOD_S:
            self._told_s = now_s
            self._publish("status", self._make("actionlib_msgs/GoalStatusArray"))
            if self._goal is not None:
                feedback = self._make(f"{self._kind}ActionFeedback")
                feedback.status.goal_id, feedback.status.status = self._goal.goal_id, ACTIVE
                self._publish("feedback", feedback)

    def _end(self, status: int, text: str = "") -> None:
        goal, self._goal = self._goal, None
        if goal is None:
            return
        if self._mark is not None:
            self._mark.unlink(missing_ok=True)
        self.ends.append(status)
        result = self._make(f"{self._kind}ActionResult")
        result.status.goal_id, result.status.status, result.status.text = goal.goal_id, status, text
        self._publish("result", result)


@dataclass
class Promise:
    """A future that is kept when the server likes."""

    waiting: list[Callable[[Any], None]] = field(default_factory=list)

    def add_done_callback(self, then: Callable[[Any], None]) -> None:
        self.waiting.append(then)

    def keep(self, result: Any) -> None:
        """The answer has come."""
        for then in self.waiting:
            then(SimpleNamespace(result=lambda: result))


@dataclass
class GoalHandle:
    """A goal that the server has taken or refused, as rclpy's client sees it."""

    accepted: bool = True
    cancelled: int = 0
    result: Promise = field(default_factory=Promise)

    def get_result_async(self) -> Promise:
        return self.result

    def cancel_goal_async(self) -> None:
        self.cancelled += 1

    def end(self, status: int, **values: object) -> None:
        """The server is done; `values` are the result's."""
        self.result.keep(SimpleNamespace(status=status, result=Values(**values)))


class Values:
    """A message with these fields, as rclpy's have them."""

    def __init__(self, **values: object) -> None:
        self.__dict__ |= values

    def get_fields_and_field_types(self) -> dict[str, str]:
        return dict.fromkeys(self.__dict__, "")


@dataclass
class Asked:
    """A goal that was asked for."""

    goal: Any
    feed: Callable[[Any], None]
    answer: Promise

    def accept(self) -> GoalHandle:
        """Take it."""
        handle = GoalHandle()
        self.answer.keep(handle)
        return handle

    def refuse(self) -> None:
        """Do not take it."""
        self.answer.keep(GoalHandle(accepted=False))

    def feed_back(self, **values: object) -> None:
        """Tell how far it is."""
        self.feed(SimpleNamespace(feedback=Values(**values)))


class RclpyServer:
    """Stands in for the server behind rclpy's ActionClient: nothing is answered before the test answers it."""

    def __init__(self) -> None:
        self.asked: list[Asked] = []
        self.is_there = True

    def server_is_ready(self) -> bool:
        """Whether ROS sees the server."""
        return self.is_there

    def send_goal_async(self, goal: Any, feedback_callback: Callable[[Any], None]) -> Promise:
        self.asked.append(Asked(goal, feedback_callback, Promise()))
        return self.asked[-1].answer


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve until the node is ended."""
    from hvcpd.ros.ros1 import class_of, find_rospy

    parser = argparse.ArgumentParser(prog="hil_fakes.ros_actions", description="A fake action server of ROS 1.")
    parser.add_argument("--action", required=True, metavar="NAME")
    parser.add_argument("--type", required=True, metavar="PACKAGE/NAME")
    parser.add_argument("--takes-s", type=float, default=1.0, metavar="S")
    parser.add_argument("--fails", default="", metavar="REASON")
    parser.add_argument("--mark", type=Path, metavar="FILE", help="is there while a goal is under way")
    options = parser.parse_args(arguments)
    if not find_rospy():
        raise SystemExit("rospy is not installed")
    import rospy  # type: ignore[import-not-found]

    rospy.init_node(f"fake_{options.action.replace('/', '_')}")
    kinds = {"status": "actionlib_msgs/GoalStatusArray"}
    kinds |= {part: f"{options.type}Action{part.capitalize()}" for part in ("feedback", "result")}
    publishers = {
        part: rospy.Publisher(f"{options.action}/{part}", class_of(kind), queue_size=10) for part, kind in kinds.items()
    }
    server = TopicServer(
        options.type,
        lambda kind: class_of(kind)(),
        lambda part, message: publishers[part].publish(message),
        options.takes_s,
        options.fails,
        options.mark,
    )
    goal, cancel = class_of(f"{options.type}ActionGoal"), class_of("actionlib_msgs/GoalID")
    rospy.Subscriber(f"{options.action}/goal", goal, lambda message: server.take_goal(message, rospy.get_time()))
    rospy.Subscriber(f"{options.action}/cancel", cancel, server.take_cancel)
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        server.tick(rospy.get_time())
        try:
            rate.sleep()
        except rospy.ROSInterruptException:
            break
    return 0


if __name__ == "__main__":
    sys.exit(main())
