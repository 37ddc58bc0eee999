"""ROS 1's own message classes, without a master: conversion both ways, and the client of move_base."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given

from hvcpd import __version__
from hvcpd.errors import ConfigError
from hvcpd.ports import PlaceGoal
from hvcpd.ros.action_topics import SILENT_S, Link, TopicAction
from hvcpd.ros.convert import OWN, Dialect, definition, from_ros, ros_class, to_ros
from hvcpd.ros.mapping import way_left_m
from hvcpd.ros.messages import DiagnosticArray, Message, Odometry, TFMessage
from hvcpd.ros.parameters import Parameters
from hvcpd.ros.port import Listener, Report, RosPort, goal_listener
from hvcpd.ros.ros1 import find_rospy, read_parameters
from tests.e2e import ros_robot
from tests.ros.samples import MESSAGES, messages

MISSING = ros_robot.missing()
pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)


PACKAGES = Path(__file__).parents[2] / "release" / "ros"


def dialect() -> Dialect:
    import genpy  # type: ignore[import-not-found]

    return Dialect(time=genpy.Time, byte=int)


def through_bytes(message: Any) -> Any:
    """Serialised and read again by ROS's own code."""
    buffer = BytesIO()
    message.serialize(buffer)
    return type(message)().deserialize(buffer.getvalue())


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda kind: kind.__name__)
def test_every_default_passes_through_ros(kind: type[Message]) -> None:
    message = kind()
    assert repr(from_ros(through_bytes(to_ros(message, dialect())), kind)) == repr(message)  # NaN is no NaN's equal


@given(messages())
def test_every_message_passes_through_ros(message: Message) -> None:
    assert from_ros(through_bytes(to_ros(message, dialect())), type(message)) == message


def test_nothing_stays_on_the_disk_of_how_a_message_was_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bridge that started again with its master left five folders in /tmp each time."""
    dialect()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))  # Python's own setting: genpy takes no folder
    made = ros_class.__wrapped__("hvcpd_msgs/TaskArray")
    assert made._md5sum == ros_class("hvcpd_msgs/TaskArray")._md5sum
    assert list(tmp_path.iterdir()) == []


@cache
def noetic() -> Any:
    """The message definitions of ROS Noetic as rosbags has them, and the one of them that it lacks."""
    rosbags = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed: make setup-dev")
    store = rosbags.get_typestore(rosbags.Stores.ROS1_NOETIC)
    text = "geometry_msgs/TransformStamped[] transforms"
    store.register(rosbags.get_types_from_msg(text, "tf2_msgs/msg/TFMessage"))
    for file in (PACKAGES / "hvcpd_msgs" / "msg").glob("*.msg"):
        store.register(rosbags.get_types_from_msg(file.read_text(), f"hvcpd_msgs/msg/{file.stem}"))
    return store


def test_the_package_defines_our_messages_as_the_bridge_speaks_them() -> None:
    """ROS's checksum is that of a definition without its comments."""
    files = (PACKAGES / "hvcpd_msgs" / "msg").glob("*.msg")
    lines = {f"hvcpd_msgs/{each.stem}": [line.split("#")[0].split() for line in each.open()] for each in files}
    found = {name: [" ".join(line) for line in each if line] for name, each in lines.items()}
    assert found == {name: definition(plain).replace("hvcpd_msgs/", "").splitlines() for name, plain in OWN.items()}


@pytest.mark.filterwarnings("ignore::DeprecationWarning:catkin_pkg", "ignore::DeprecationWarning:pyparsing")
@pytest.mark.parametrize("name", ["hvcpd", "hvcpd_msgs"])
@pytest.mark.parametrize(("version", "build"), [("1", "catkin"), ("2", "ament_cmake")])
def test_the_packages_are_well_formed_in_either_ros_and_have_hvcpds_version(
    name: str, version: str, build: str
) -> None:
    from catkin_pkg.package import parse_package  # type: ignore[import-not-found]

    warnings: list[str] = []
    package = parse_package(str(PACKAGES / name), warnings=warnings)
    package.evaluate_conditions({"ROS_VERSION": version})
    assert (warnings, package.name, package.version) == ([], name, __version__)
    assert package.get_build_type() == build
    listed = (PACKAGES / name / "CMakeLists.txt").read_text()
    assert f"project({name}" in listed
    if name == "hvcpd_msgs":
        assert {file.stem for file in (PACKAGES / name / "msg").glob("*.msg")} <= set(listed.replace(")", " ").split())


@given(messages())
def test_another_implementation_reads_the_same_from_the_bytes(message: Message) -> None:
    buffer = BytesIO()
    to_ros(message, dialect()).serialize(buffer)
    package, name = type(message).ROS_TYPE.split("/")
    assert from_ros(noetic().deserialize_ros1(buffer.getvalue(), f"{package}/msg/{name}"), type(message)) == message


def test_fields_are_where_ros_has_them() -> None:
    odometry = to_ros(Odometry(child_frame_id="base_link"), dialect())
    assert odometry.child_frame_id == "base_link"
    assert len(odometry.pose.covariance) == 36
    assert to_ros(TFMessage(), dialect()).transforms == []
    assert to_ros(DiagnosticArray(), dialect()).status == []


def test_rospy_of_another_python_is_not_used(tmp_path: Path) -> None:
    assert find_rospy()
    path: list[str] = []
    (tmp_path / "elsewhere").mkdir()
    assert find_rospy(path, tmp_path / "elsewhere"), "it is on the path already"
    assert path == []


class ParameterServer:
    """What a master keeps for one node, as rospy tells it."""

    def __init__(self, **kept: object) -> None:
        self.kept = dict(kept)

    def get_name(self) -> str:
        return "/hvcpd"

    def get_param(self, _: str, default: object) -> object:
        return dict(self.kept) or default

    def delete_param(self, name: str) -> None:
        del self.kept[name.removeprefix("~")]


def test_a_wrong_parameter_of_a_command_line_is_wrong_only_once() -> None:
    master = ParameterServer(base_frme="x", map_frame="hall")
    with pytest.raises(ConfigError, match="did you mean 'base_frame'"):
        read_parameters(master, ["heard:=ears", "_base_frme:=x"])
    assert read_parameters(master, []).map_frame == "hall"


def test_of_a_wrong_parameter_that_others_left_it_is_said_where_it_is() -> None:
    with pytest.raises(ConfigError, match="`rosparam delete /hvcpd` forgets them"):
        read_parameters(ParameterServer(base_frme="x"), [])


class NavigationPort(RosPort):
    """A ROS with no more than the client of navigation's action, which is made by `make`."""

    fault = None
    publish = log = close = lambda *_: None  # type: ignore[assignment]

    def __init__(self, report: Report, make: Callable[[Listener], Any], field: str) -> None:
        super().__init__(report)
        self.parameters, self._dialect, self._goal_field = Parameters(), dialect(), field
        self.now_s = 0.0
        self.client = self._navigation = make(goal_listener(report))

    def stamp_s(self) -> float:
        return self.now_s


class Server:
    """move_base's side of the topics, and what the client made of its answers."""

    def __init__(self) -> None:
        self.goals: list[Any] = []
        self.cancels: list[Any] = []
        self.ended: list[tuple[int, bool, str]] = []
        self.left_m: list[float] = []
        self.connected = True
        link = Link(self.goals.append, self.cancels.append, lambda: self.connected)
        self.port = NavigationPort(
            lambda happening: happening(self, 0.0),  # type: ignore[arg-type]
            lambda listener: TopicAction(
                "move_base", "move_base_msgs/MoveBase", link, listener, dialect(), "move_base"
            ),
            "target_pose",
        )
        self.client = self.port.client

    def goal_ended(self, *how: Any) -> None:
        """As the bridge has it."""
        self.ended.append(how)

    def goal_fed_back(self, _number: int, values: Any) -> None:
        """As the bridge has it."""
        self.left_m.append(way_left_m(values, PlaceGoal(1, 3.0, 4.0)))

    def result(self, status: int, text: str = "", which: int = -1) -> None:
        message = ros_class("move_base_msgs/MoveBaseActionResult")()
        message.status.goal_id.id, message.status.status = self.goals[which].goal_id.id, status
        message.status.text = text
        self.client.take_result(through_bytes(message), 1.0)


def test_a_goal_has_the_place_in_the_maps_frame_and_its_result_is_told() -> None:
    server = Server()
    server.port.now_s = 99.5
    server.port.go(PlaceGoal(4, 1.0, 2.0), 0.0)
    sent = through_bytes(server.goals[0])
    target = sent.goal.target_pose
    assert (target.header.frame_id, target.header.stamp.secs) == ("map", 99)
    assert (target.pose.position.x, target.pose.position.y, target.pose.orientation.w) == (1.0, 2.0, 1.0)
    server.result(3)
    assert server.ended == [(4, True, "")]


@pytest.mark.parametrize(
    ("status", "word"), [(2, "preempted"), (4, "aborted"), (5, "rejected"), (9, "lost"), (77, "77")]
)
def test_a_goal_that_was_not_reached_is_told_with_the_reason(status: int, word: str) -> None:
    server = Server()
    server.port.go(PlaceGoal(4, 1.0, 2.0), 0.0)
    server.result(status, "wall")
    ((number, arrived, reason),) = server.ended
    assert (number, arrived) == (4, False)
    assert word in reason
    assert "wall" in reason


def test_results_of_other_goals_do_not_count() -> None:
    server = Server()
    server.port.go(PlaceGoal(1, 0.0, 0.0), 0.0)
    server.port.go(PlaceGoal(2, 0.0, 0.0), 0.0)
    server.result(2, which=0)
    assert server.ended == []
    server.client.cancel(1)
    assert server.cancels == []
    server.client.cancel(2)
    assert [each.id for each in server.cancels] == [server.goals[1].goal_id.id]
    server.result(2)
    assert server.ended == []


def test_feedback_tells_how_far_it_is_and_a_silent_server_fails() -> None:
    server = Server()
    server.port.go(PlaceGoal(1, 3.0, 4.0), 0.0)
    message = ros_class("move_base_msgs/MoveBaseActionFeedback")()
    message.status.goal_id.id = server.goals[0].goal_id.id
    server.client.take_feedback(message, 2.0)
    assert server.left_m == [5.0]
    server.client.take_status(None, 3.0)
    server.client.tick(3.0 + SILENT_S)
    assert server.ended == []
    server.client.tick(3.1 + SILENT_S)
    assert server.ended == [(1, False, "no action server answers at move_base; is move_base running?")]


def test_nothing_is_sent_to_a_server_that_is_not_connected_yet() -> None:
    server = Server()
    server.connected = False
    server.port.go(PlaceGoal(1, 3.0, 4.0), 0.0)
    server.client.tick(0.1)
    assert server.goals == []
    server.client.cancel(1)
    server.port.go(PlaceGoal(2, 1.0, 1.0), 0.2)
    server.connected = True
    server.client.tick(0.3)
    server.client.tick(0.4)
    assert [each.goal.target_pose.pose.position.x for each in server.goals] == [1.0]
    assert server.cancels == []


def test_a_server_that_never_connects_fails_the_goal_though_its_status_is_heard() -> None:
    server = Server()
    server.connected = False
    server.port.go(PlaceGoal(1, 3.0, 4.0), 0.0)
    server.client.take_status(None, SILENT_S)
    server.client.tick(SILENT_S + 0.1)
    assert [(number, arrived) for number, arrived, _ in server.ended] == [(1, False)]
