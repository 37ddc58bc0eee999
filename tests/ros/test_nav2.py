"""The client of Nav2's action, against a scripted action client: what becomes of goals, and of late answers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from hvcpd.ports import PlaceGoal
from hvcpd.ros.bridge import Bridge
from hvcpd.ros.nav2 import ANSWER_S, Nav2
from hvcpd.ros.parameters import Parameters
from tests.e2e import ros_robot
from tests.ros.test_bridge import moving
from tests.ros.test_ros1 import dialect

MISSING = ros_robot.missing()  # any ROS's geometry_msgs will do
pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


@dataclass
class Promise:
    """A future that the test keeps when it likes."""

    kept: list[Callable[[Any], None]] = field(default_factory=list)

    def add_done_callback(self, then: Callable[[Any], None]) -> None:
        self.kept.append(then)

    def keep(self, result: Any) -> None:
        for then in self.kept:
            then(SimpleNamespace(result=lambda: result))


class Handle:
    """A goal that the server has taken or refused."""

    def __init__(self, accepted: bool = True) -> None:
        self.accepted = accepted
        self.cancelled = 0
        self.result = Promise()

    def get_result_async(self) -> Promise:
        return self.result

    def cancel_goal_async(self) -> None:
        self.cancelled += 1


class Server:
    """Nav2's side, and the bridge behind the client."""

    def __init__(self) -> None:
        self.asked: list[tuple[Any, Callable[[Any], None], Promise]] = []
        self.bridge = Bridge(True, Parameters())
        self.bridge.begin(0.0)
        self.client = Nav2(
            "navigate_to_pose",
            "map",
            self,
            SimpleNamespace,
            dialect(),
            lambda happening: happening(),
            lambda happening: happening(self.bridge, 0.0),
        )

    def send_goal_async(self, goal: Any, feedback_callback: Callable[[Any], None]) -> Promise:
        self.asked.append((goal, feedback_callback, Promise()))
        return self.asked[-1][2]

    def go(self, number: int) -> None:
        """The daemon wants that goal, and the bridge asks for it."""
        self.bridge.from_daemon(moving(0.0, goal=number), 0.0, 0.0)
        self.client.go(PlaceGoal(number, 3.0, 4.0), 0.0, 7.5)

    def told(self) -> list[tuple[int, bool, str]]:
        """What the daemon was told of goals."""
        arguments = [getattr(each, "arguments", {}) for each in self.bridge.outputs()]
        return [(each["goal"], each["arrived"], each["reason"]) for each in arguments if "goal" in each]


def test_a_goal_is_asked_for_in_the_maps_frame_and_reached() -> None:
    server = Server()
    server.go(1)
    goal, progress, answer = server.asked[0]
    assert (goal.pose.header.frame_id, goal.pose.header.stamp.secs) == ("map", 7)
    assert (goal.pose.pose.position.x, goal.pose.pose.position.y, goal.pose.pose.orientation.w) == (3.0, 4.0, 1.0)
    handle = Handle()
    answer.keep(handle)
    progress(SimpleNamespace(feedback=SimpleNamespace(distance_remaining=1.5)))
    server.client.tick(100.0)
    assert server.told() == []
    handle.result.keep(SimpleNamespace(status=SUCCEEDED))
    assert server.told() == [(1, True, "")]


@pytest.mark.parametrize(
    ("status", "reason"), [(ABORTED, "aborted"), (CANCELED, "canceled"), (9, "ended with status 9")]
)
def test_a_goal_that_was_not_reached_is_told_with_the_reason(status: int, reason: str) -> None:
    server, handle = Server(), Handle()
    server.go(1)
    server.asked[0][2].keep(handle)
    handle.result.keep(SimpleNamespace(status=status))
    assert server.told() == [(1, False, reason)]


def test_a_refusal_and_a_silent_server_fail_the_goal() -> None:
    server = Server()
    server.go(1)
    server.asked[0][2].keep(Handle(accepted=False))
    assert server.told() == [(1, False, "rejected")]
    server.go(2)
    server.client.tick(ANSWER_S)
    assert server.told() == []
    server.client.tick(ANSWER_S + 0.1)
    assert [(number, arrived) for number, arrived, _ in server.told()] == [(2, False)]


def test_a_goal_is_withdrawn_even_before_it_is_taken_and_its_end_then_counts_no_more() -> None:
    server, early, late = Server(), Handle(), Handle()
    server.go(1)
    server.asked[0][2].keep(early)
    server.client.cancel(1)
    assert early.cancelled == 1
    server.go(2)
    server.client.cancel(2)
    server.asked[1][2].keep(late)
    assert late.cancelled == 1
    early.result.keep(SimpleNamespace(status=CANCELED))
    assert server.told() == []
