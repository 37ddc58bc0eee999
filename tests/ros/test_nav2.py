"""The client of Nav2's action, against a scripted action client: what becomes of goals, and of late answers."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace

import pytest

from hil_fakes.ros_actions import ROS2_ABORTED, ROS2_CANCELED, ROS2_SUCCEEDED, Asked, RclpyServer
from hvcpd.ports import PlaceGoal
from hvcpd.ros.action_rclpy import ANSWER_S, RclpyAction
from hvcpd.ros.bridge import Bridge
from hvcpd.ros.parameters import Parameters
from hvcpd.ros.port import Listener
from tests.e2e import ros_robot
from tests.ros.talk import moving
from tests.ros.test_ros1 import NavigationPort

MISSING = ros_robot.missing()  # any ROS's geometry_msgs will do
needs_messages = pytest.mark.skipif(bool(MISSING), reason=MISSING)


def nav2_client(nav2: RclpyServer, listener: Listener) -> RclpyAction:
    goal = partial(SimpleNamespace, pose=None)
    return RclpyAction("navigate_to_pose", nav2, goal, listener, "Nav2", lambda happening: happening())


class Scene:
    """Nav2's side, and the bridge behind the client."""

    def __init__(self) -> None:
        self.nav2 = RclpyServer()
        self.bridge = Bridge(True, Parameters())
        self.bridge.begin(0.0)
        self.port = NavigationPort(
            lambda happening: happening(self.bridge, 0.0), lambda listener: nav2_client(self.nav2, listener), "pose"
        )
        self.port.now_s = 7.5
        self.client = self.port.client

    def go(self, number: int) -> Asked:
        """The daemon wants that goal, and the bridge asks for it."""
        self.bridge.from_daemon(moving(0.0, goal=number), 0.0, 0.0)
        self.port.go(PlaceGoal(number, 3.0, 4.0), 0.0)
        return self.nav2.asked[-1]

    def told(self) -> list[tuple[int, bool, str]]:
        """What the daemon was told of goals."""
        arguments = [getattr(each, "arguments", {}) for each in self.bridge.outputs()]
        return [(each["goal"], each["arrived"], each["reason"]) for each in arguments if "goal" in each]


@needs_messages
def test_a_goal_is_asked_for_in_the_maps_frame_and_reached() -> None:
    scene = Scene()
    asked = scene.go(1)
    goal = asked.goal
    assert (goal.pose.header.frame_id, goal.pose.header.stamp.secs) == ("map", 7)
    assert (goal.pose.pose.position.x, goal.pose.pose.position.y, goal.pose.pose.orientation.w) == (3.0, 4.0, 1.0)
    handle = asked.accept()
    asked.feed_back(distance_remaining=1.5)
    scene.client.tick(100.0)
    assert scene.told() == []
    handle.end(ROS2_SUCCEEDED)
    assert scene.told() == [(1, True, "")]


@needs_messages
@pytest.mark.parametrize(
    ("status", "reason"), [(ROS2_ABORTED, "aborted"), (ROS2_CANCELED, "canceled"), (9, "ended with status 9")]
)
def test_a_goal_that_was_not_reached_is_told_with_the_reason(status: int, reason: str) -> None:
    scene = Scene()
    scene.go(1).accept().end(status)
    assert scene.told() == [(1, False, reason)]


@needs_messages
def test_a_refusal_and_a_silent_server_fail_the_goal() -> None:
    scene = Scene()
    scene.go(1).refuse()
    assert scene.told() == [(1, False, "rejected")]
    scene.go(2)
    scene.client.tick(ANSWER_S)
    assert scene.told() == []
    scene.client.tick(ANSWER_S + 0.1)
    assert [(number, arrived) for number, arrived, _ in scene.told()] == [(2, False)]


@needs_messages
def test_a_goal_is_withdrawn_even_before_it_is_taken_and_its_end_then_counts_no_more() -> None:
    scene = Scene()
    early = scene.go(1).accept()
    scene.client.cancel(1)
    assert early.cancelled == 1
    second = scene.go(2)
    scene.client.cancel(2)
    assert second.accept().cancelled == 1
    early.end(ROS2_CANCELED)
    assert scene.told() == []


def test_a_server_that_ends_with_a_goal_under_way_fails_it() -> None:
    """Where Nav2 was killed on the way the robot waited for it for ever, and kept its task from the others."""
    nav2, ended = RclpyServer(), list[tuple[int, str]]()
    listener = Listener(lambda _number, _feedback: None, lambda number, reason, _result: ended.append((number, reason)))
    client = nav2_client(nav2, listener)
    client.ask(1, lambda _goal: None, 0.0)
    nav2.asked[0].accept()
    client.tick(100.0)
    nav2.is_there = False
    client.tick(100.0 + ANSWER_S)
    assert not ended
    client.tick(100.1 + ANSWER_S)
    assert ended == [(1, "no action server answers at navigate_to_pose; is Nav2 running?")]
