"""Actions of ROS as skills: the bridge's part, both clients against fake servers, and a real node of ROS 1."""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from hil_fakes.ros_actions import (
    ABORTED,
    PREEMPTED,
    RECALLED,
    ROS2_ABORTED,
    ROS2_SUCCEEDED,
    SUCCEEDED,
    RclpyServer,
    TopicServer,
    Values,
)
from hil_fakes.sound_server import wait_until
from hvcpd.config.settings_file import load_settings
from hvcpd.config.skill_settings import RosSettings
from hvcpd.errors import ConfigError
from hvcpd.ros.action_rclpy import RclpyAction
from hvcpd.ros.action_topics import SILENT_S, Link, TopicAction
from hvcpd.ros.bridge import Ask, Bridge
from hvcpd.ros.command import wanted_by
from hvcpd.ros.convert import ros_class
from hvcpd.ros.parameters import Parameters
from hvcpd.ros.port import Listener
from hvcpd.ros.skills import Act, Leave, Skills, fill_message, filled, values_of
from hvcpd.skills.host import BEATS_MISSED_S
from tests.e2e import ros_robot
from tests.ros.live import SocketDaemon, bridge_to, daemon_at, running
from tests.ros.test_ros1 import dialect, through_bytes

GRIP = RosSettings(
    "gripper", "control_msgs/GripperCommand", {"command": {"position": "{width_m}", "note": "to {what}"}}
)
PERFORM = {
    "event": "perform",
    "call": 7,
    "task": 1,
    "skill": "grip",
    "arguments": {"width_m": 0.04, "what": "a book"},
    "limit_s": 20.0,
}
MISSING = ros_robot.missing()


def bridge() -> Bridge:
    made = Bridge(False, Parameters(), Skills({"grip": GRIP}))
    made.begin(0.0)
    offers = [each.arguments for each in made.outputs() if isinstance(each, Ask) and each.command == "offer"]
    assert offers == [{"skills": ["grip"]}]
    return made


def deeds(made: Bridge) -> list[Any]:
    """Goals, withdrawals, and what the daemon is told, in order."""
    kept: list[Any] = []
    for each in made.outputs():
        if isinstance(each, Act | Leave):
            kept.append(each)
        elif isinstance(each, Ask) and each.command in ("progress", "done", "failed"):
            kept.append((each.command, dict(each.arguments)))
    return kept


def test_a_call_becomes_a_goal_with_its_arguments_and_its_end_is_told() -> None:
    made = bridge()
    made.from_daemon(PERFORM, 1.0, 1.0)
    goal = Act(1, "grip", {"command": {"position": 0.04, "note": "to a book"}})
    assert deeds(made) == [("progress", {"call": 7}), goal]
    made.action_fed_back(1, {"position": 0.05, "effort": 1.0}, 1.1)
    made.action_fed_back(1, {"position": 0.04}, 1.2)  # too soon to be told
    assert deeds(made) == [("progress", {"call": 7, "text": "position 0.05, effort 1"})]
    made.action_ended(9, None, {})  # another goal's
    made.action_ended(1, None, {"position": 0.04})
    assert deeds(made) == [("done", {"call": 7, "results": {"position": 0.04}})]
    made.action_ended(1, None, {})
    assert deeds(made) == []


def test_a_failure_is_told_with_its_reason() -> None:
    made = bridge()
    made.from_daemon(PERFORM, 1.0, 1.0)
    made.action_ended(1, "aborted: it slipped", {})
    assert deeds(made)[2:] == [("failed", {"call": 7, "reason": "aborted: it slipped"})]


def test_a_cancel_a_stop_of_ros_and_a_daemon_that_ends_withdraw_the_goal() -> None:
    from hvcpd.ros import topics
    from hvcpd.ros.messages import Bool

    def cancelled(made: Bridge) -> None:
        made.from_daemon({"event": "cancel", "call": 7}, 1.1, 1.1)

    def stopped(made: Bridge) -> None:
        made.from_ros(topics.ESTOP, Bool(True), 1.1)

    def ends(made: Bridge) -> None:
        made.lost(1.1)

    for what in (cancelled, stopped, ends):
        made = bridge()
        made.from_daemon(PERFORM, 1.0, 1.0)
        deeds(made)
        what(made)
        assert deeds(made) == [Leave(1, "grip")], what
        made.action_ended(1, "preempted", {})
        assert deeds(made) == []


def test_a_daemon_that_was_silent_for_too_long_is_told_that_its_call_was_withdrawn() -> None:
    """One that was busy for a moment waited for it until the call's time limit, a minute by default."""
    made = bridge()
    made.from_daemon(PERFORM, 1.0, 1.0)
    deeds(made)
    made.from_daemon({"event": "beat"}, 1.1, 1.1)
    made.tick(1.09 + BEATS_MISSED_S, 1.4)
    assert deeds(made) == []
    made.tick(1.11 + BEATS_MISSED_S, 1.5)
    assert deeds(made) == [Leave(1, "grip"), ("failed", {"call": 7, "reason": "it was cancelled"})]
    made.action_ended(1, "preempted", {})
    made.tick(2.0, 2.0)
    assert deeds(made) == []


def test_a_held_call_is_withdrawn_and_given_anew() -> None:
    made = bridge()
    made.from_daemon(PERFORM, 1.0, 1.0)
    deeds(made)
    made.from_daemon({"event": "pause", "call": 7}, 1.1, 1.1)
    made.action_ended(1, "preempted", {})
    assert deeds(made) == [Leave(1, "grip")]
    made.from_daemon({"event": "resume", "call": 7}, 1.2, 1.2)
    assert [(each.number, each.skill) for each in deeds(made)] == [(2, "grip")]


def test_a_message_is_filled_by_its_fields_types_and_faults_are_told() -> None:
    message = SimpleNamespace(command=SimpleNamespace(position=0.0, count=0, note=""), names=[])
    fill_message(message, {"command": {"position": 1, "count": 2.0, "note": "x"}, "names": ["a"]})
    assert (message.command.position, message.command.count, message.names) == (1.0, 2, ["a"])
    with pytest.raises(ValueError, match="the goal has no field 'positon'"):
        fill_message(message, {"command": {"positon": 1}})
    with pytest.raises(ValueError, match="'count' cannot be 'x'"):
        fill_message(message, {"command": {"count": "x"}})
    assert filled(["{a}", "{a} m", 3], {"a": 0.5}) == [0.5, "0.5 m", 3]
    assert filled("{a} {b} {c}", {"a": "{b}", "b": "x"}) == "{b} x {c}"  # an argument is no place for another
    assert values_of(Values(a=1, b="x", c=[1], d=float("nan"))) == {"a": 1.0, "b": "x"}
    assert values_of(Values(a=True, b="x" * 9000)) == {"a": 1.0, "b": "x" * 200}  # the daemon hung up on the bridge


def test_the_settings_name_it_in_one_line_and_faults_have_theirs(tmp_path: Path) -> None:
    file = tmp_path / "hvcpd.yaml"
    grip = (
        "{ros: {action: gripper, type: control_msgs/action/GripperCommand, goal: {command: {position: '{width_m}'}}}}"
    )
    file.write_text(f"name: Rob\nskills:\n  grip: {grip}\n")
    (skill,) = load_settings(file, environment={}).skills.values()
    assert skill.ros is not None
    values = {"action": skill.ros.action, "type": skill.ros.type, "goal": dict(skill.ros.goal)}
    wanted = wanted_by([{"key": "skills", "value": {"grip": {"run": [], "ros": values}, "pour": {"ros": None}}}])
    goal = {"command": {"position": "{width_m}"}}
    assert wanted.actions == {"grip": RosSettings("gripper", "control_msgs/GripperCommand", goal)}
    file.write_text("name: Rob\nskills:\n  grip: {ros: {action: gripper, type: GripperCommand}}\n")
    with pytest.raises(
        ConfigError, match=r"hvcpd.yaml:3: .*'GripperCommand' is not the type of an action; write for example"
    ):
        load_settings(file, environment={})


def test_a_goal_of_ros_2_is_taken_fed_back_and_ended() -> None:
    server, told = RclpyServer(), []
    listener = Listener(
        lambda number, feedback: told.append((number, values_of(feedback))),
        lambda number, reason, result: told.append((number, reason, values_of(result) if result else None)),
    )
    client = RclpyAction(
        "gripper", server, lambda: SimpleNamespace(position=0.0), listener, "the gripper", lambda happening: happening()
    )
    client.ask(1, partial(fill_message, fields={"position": 0.04}), 0.0)
    asked = server.asked[0]
    assert asked.goal.position == 0.04
    handle = asked.accept()
    asked.feed_back(effort=2.0)
    handle.end(ROS2_SUCCEEDED, position=0.05)
    client.ask(2, lambda _: None, 1.0)
    server.asked[1].accept().end(ROS2_ABORTED)
    assert told == [(1, {"effort": 2.0}), (1, "", {"position": 0.05}), (2, "aborted", {})]


@pytest.mark.skipif(bool(MISSING), reason=MISSING)
@pytest.mark.parametrize(("fails", "end"), [("", SUCCEEDED), ("it slipped", ABORTED)])
def test_a_goal_of_ros_1_goes_over_the_topics_and_back(fails: str, end: int) -> None:
    kind, told = "move_base_msgs/MoveBase", []
    take: dict[str, Any] = {}

    def publish(part: str, message: Any) -> None:
        take[part](through_bytes(message), 1.0)

    server = TopicServer(kind, lambda name: ros_class(name)(), publish, 1.0, fails)
    link = Link(
        lambda message: server.take_goal(through_bytes(message), 0.0),
        lambda message: server.take_cancel(through_bytes(message)),
        lambda: True,
    )
    listener = Listener(
        lambda number, _: told.append((number, "fed back")), lambda number, reason, _: told.append((number, reason))
    )
    client = TopicAction("go", kind, link, listener, dialect(), "the arm")
    take |= {"status": client.take_status, "feedback": client.take_feedback, "result": client.take_result}
    fields = {"target_pose": {"pose": {"position": {"x": 2}}}}
    client.ask(4, partial(fill_message, fields=fields), 0.0, 9.0)
    server.tick(0.5)
    server.tick(1.0)
    assert server.goals[0].target_pose.pose.position.x == 2.0
    assert told == [(4, "fed back"), (4, f"aborted: {fails}" if fails else "")]
    client.ask(5, lambda _: None, 1.0, 9.0)
    client.cancel(5)
    assert server.ends == [end, PREEMPTED]
    client.ask(6, lambda _: None, 2.0, 9.0)
    client.tick(2.1 + SILENT_S)
    assert told[-1] == (6, "no action server answers at go; is the arm running?")


@pytest.mark.skipif(bool(MISSING), reason=MISSING)
def test_a_cancel_that_overtakes_its_goal_of_ros_1_still_ends_it(tmp_path: Path) -> None:
    """They come over two connections; the fake server went on with the goal to its end."""
    kind, mark = "move_base_msgs/MoveBase", tmp_path / "under way"
    sent: list[Any] = []
    server = TopicServer(kind, lambda name: ros_class(name)(), lambda *_: None, 60.0, mark=mark)
    listener = Listener(lambda *_: None, lambda *_: None)
    client = TopicAction("go", kind, Link(sent.append, sent.append, lambda: True), listener, dialect(), "the arm")
    client.ask(1, lambda _: None, 0.0, 9.0)
    client.cancel(1)
    goal, cancel = map(through_bytes, sent)
    server.take_cancel(cancel)
    server.take_goal(goal, 1.0)
    assert server.ends == [RECALLED]
    assert not mark.exists()
    client.ask(2, lambda _: None, 2.0, 9.0)
    server.take_goal(through_bytes(sent[2]), 2.0)
    assert mark.exists()


@pytest.mark.slow
@pytest.mark.skipif(bool(MISSING), reason=MISSING)
def test_a_real_node_of_ros_1_carries_out_a_skill_and_is_cancelled(tmp_path: Path) -> None:
    fields = {"target_pose": {"header": {"frame_id": "{what}"}, "pose": {"position": {"x": "{x_m}"}}}}
    ros = {"action": "arm", "type": "move_base_msgs/MoveBase", "goal": fields}
    core = ros_robot.Roscore(tmp_path, "core")
    try:
        with daemon_at(tmp_path / "d.sock", "cmd_vel", "none") as daemon:
            daemon.settings.append({"key": "skills", "value": {"reach": {"run": [], "ros": ros}}})
            wait_until(core.answers, 30.0, "there is a master")
            words = ("--action", "arm", "--type", "move_base_msgs/MoveBase", "--takes-s", "0.3")
            fake = [sys.executable, "-m", "hil_fakes.ros_actions", *words]
            command = (sys.executable, "-m", "hvcpd.control.cli", "ros", "--socket", str(daemon.path), "--ros", "1")
            with running(fake, core.environment, tmp_path / "fake.log") as server:
                with bridge_to(daemon, core.environment, command):
                    _reach(daemon)
                server.terminate()
    finally:
        core.close()


def _reach(daemon: SocketDaemon) -> None:
    wait_until(lambda: bool(daemon.arguments("offer")), 30.0, "the bridge offers it")
    call = {"event": "perform", "call": 1, "task": 1, "skill": "reach", "arguments": {"x_m": 1.5, "what": "map"}}
    daemon.tell(call)
    _until(daemon, lambda: bool(daemon.arguments("done")), "the server has done it")
    daemon.tell(call | {"call": 2, "arguments": {"x_m": "far", "what": "map"}})
    _until(daemon, lambda: bool(daemon.arguments("failed")), "a goal of a wrong type fails")
    assert "'x' cannot be 'far'" in json.dumps(daemon.arguments("failed")[0])


def _until(daemon: SocketDaemon, holds: Any, what: str) -> None:
    """Beat, as a daemon does, until something holds."""

    def beaten() -> bool:
        daemon.tell({"event": "beat"})
        return bool(holds())

    wait_until(beaten, 30.0, what)
