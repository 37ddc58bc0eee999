"""The bridge without ROS and without sockets: what comes in, and what goes out on either side."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import pytest

from hvcpd.ports import PlaceGoal
from hvcpd.ros import topics
from hvcpd.ros.bridge import MAX_SAYS, NO_DAEMON, NOT_PRESSED, SILENT_S, TOO_MANY, Ask, Bridge, Log, Output, Publish
from hvcpd.ros.driving import Cancel, Go
from hvcpd.ros.messages import (
    Bool,
    DiagnosticArray,
    DiagnosticStatus,
    Header,
    Message,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Sentence,
    String,
    Task,
    TaskArray,
    TFMessage,
    Time,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from hvcpd.ros.parameters import Parameters
from hvcpd.ros.topics import Topic

STATUS: dict[str, Any] = {
    "name": "Rob",
    "team": "plant",
    "mode": "volunteer",
    "version": "1",
    "pid": 1,
    "uptime_s": 5.0,
    "wall_s": 0.0,
    "state": "ready",
    "doing": "is looking for work",
    "stopped": False,
    "now_s": 20.0,
    "task": {"number": 2, "name": "water the green rose"},
    "peers": [{"name": "Bot", "present": True}, {"name": "Max", "present": False}],
    "battery_v": 10.9,
    "sound": {"listening": True, "level_dbfs": -60.0, "floor_dbfs": -70.0, "mute": False, "lost": {}},
    "wheels": {"driver": "ros", "turning": False, "fault": None},
}
HEARD = {
    "event": "heard",
    "at_s": 21.0,
    "utterance": None,
    "listener": "Rob",
    "speaker": "Bot",
    "text": "Hi Rob, I am Bot, confirmed four",
    "confidence": 0.93,
    "snr_db": 30.0,
    "words": [["hi", 21.0, 21.3], ["four", 23.0, 23.4]],
}
AT_S, STAMP_S = 50.0, 1_000.25


class Talk:
    """A bridge, and what it put out."""

    def __init__(self, ros_drives: bool = True, parameters: Parameters | None = None) -> None:
        self.bridge = Bridge(ros_drives, parameters or Parameters())
        self.bridge.begin(AT_S)
        self.out: list[Output] = self.bridge.outputs()

    def answer(self, command: str, result: dict[str, Any] | None = None, **error: str) -> list[Output]:
        """The daemon replies to the last request of that command."""
        mark = [each.id for each in self.out if isinstance(each, Ask) and each.command == command][-1]
        reply = {"id": mark, "ok": not error, "result": result, "error": error}
        return self.daemon(reply)

    def daemon(self, line: dict[str, Any], now_s: float = AT_S) -> list[Output]:
        self.bridge.from_daemon(line, now_s, STAMP_S)
        return self._fetch()

    def ros(self, topic: Topic, message: Message, now_s: float = AT_S) -> list[Output]:
        self.bridge.from_ros(topic, message, now_s)
        return self._fetch()

    def tick(self, now_s: float) -> list[Output]:
        self.bridge.tick(now_s, STAMP_S)
        return self._fetch()

    def _fetch(self) -> list[Output]:
        new = self.bridge.outputs()
        self.out += new
        return new


def on(topic: Topic, outputs: list[Output]) -> list[Message]:
    return [each.message for each in outputs if isinstance(each, Publish) and each.topic == topic]


def asked(command: str, outputs: list[Output]) -> list[dict[str, Any]]:
    return [dict(each.arguments) for each in outputs if isinstance(each, Ask) and each.command == command]


def moving(linear: float, goal: int | None = None, stopped: bool = False) -> dict[str, Any]:
    to = None if goal is None else {"number": goal, "x_m": 3.0, "y_m": 4.0}
    return {"event": "drive", "at_s": 1.0, "linear_m_s": linear, "angular_rad_s": 0.5, "stopped": stopped, "goal": to}


def odometry(x_m: float, heading_rad: float) -> Odometry:
    pose = Pose(Point(x_m, 2.0, 0.0), Quaternion.about_z(heading_rad))
    speeds = Twist(Vector3(0.1), Vector3(z=-0.2))
    return Odometry(Header(frame_id="odom"), "base_link", PoseWithCovariance(pose), TwistWithCovariance(speeds))


@pytest.mark.parametrize(("ros_drives", "frequent"), [(True, "drive"), (False, "odom")])
def test_it_follows_what_it_needs_and_nothing_else_that_is_frequent(ros_drives: bool, frequent: str) -> None:
    (wanted,) = asked("subscribe", Talk(ros_drives).out)
    assert set(wanted["events"]) & {"drive", "odom", "level", "moved"} == {frequent}


def test_what_is_heard_is_told_as_a_sentence_and_with_all_that_is_known() -> None:
    talk = Talk()
    talk.answer("status", STATUS)
    out = talk.daemon(HEARD)
    assert on(topics.HEARD, out) == [String("Hi Rob, I am Bot, confirmed four")]
    (twin,) = on(topics.HEARD_SENTENCE, out)
    assert isinstance(twin, Sentence)
    assert (twin.speaker, twin.confidence) == ("Bot", 0.93)
    assert (twin.words[1].text, twin.words[1].begin_s) == ("four", 2.0)
    assert twin.duration_s == twin.words[-1].end_s == pytest.approx(2.4)
    assert twin.header.stamp == Time.of(STAMP_S + 1.0), "the daemon's clock stood at 20 s then"
    assert on(topics.SAID, out) == []
    (event,) = on(topics.EVENTS, out)
    assert isinstance(event, String)
    assert json.loads(event.data)["event"] == "heard"


def test_what_is_to_be_said_is_asked_for_and_a_refusal_is_told() -> None:
    talk = Talk()
    out = talk.ros(topics.SAY, String("make coffee"))
    assert asked("say", out) == [{"text": "make coffee"}]
    assert talk.answer("say", code="not_in_phrasebook", text="nobody says coffee") == [Log("say: nobody says coffee")]


def test_a_task_is_changed_and_what_is_no_change_is_told() -> None:
    talk = Talk()
    assert asked("task", talk.ros(topics.TASK, String("again 12"))) == [{"do": "again", "number": 12}]
    assert talk.answer("task", code="refused", text="there is no task 12") == [Log("task: there is no task 12")]
    added = talk.ros(topics.TASK, String('add {"number": 11, "name": "water the red tulip"}'))
    assert asked("task", added) == [{"do": "add", "task": {"number": 11, "name": "water the red tulip"}}]
    for wrong in "again and again", "add 11", 'add {"number"', "add " + "[" * 3000:
        (log,) = talk.ros(topics.TASK, String(wrong))
        assert isinstance(log, Log)
        assert "write 'again 3'" in log.text


def test_what_is_too_long_or_too_much_to_be_said_keeps_nothing_else_from_the_daemon() -> None:
    talk = Talk()
    (log,) = talk.ros(topics.SAY, String("x" * 10_000))
    assert isinstance(log, Log)
    assert "10000 characters" in log.text
    out = [each for _ in range(1000) for each in talk.ros(topics.SAY, String("hello"))]
    assert len(asked("say", out)) == MAX_SAYS
    assert [each.text for each in out if isinstance(each, Log)] == [TOO_MANY]
    talk.answer("say", {"text": "hello"})
    assert asked("say", talk.ros(topics.SAY, String("hello"))) == [{"text": "hello"}]


def test_speeds_reach_cmd_vel() -> None:
    (twist,) = on(topics.CMD_VEL, Talk().daemon(moving(0.15)))
    assert twist == Twist(Vector3(x=0.15), Vector3(z=0.5))


def test_a_base_that_ros_has_is_told_to_stand_before_anything_else() -> None:
    assert on(topics.CMD_VEL, Talk().tick(AT_S + 0.05)) == [Twist()]
    assert on(topics.CMD_VEL, Talk(ros_drives=False).tick(AT_S + 0.05)) == []


def test_estop_stands_at_once_and_no_older_word_moves_the_base_again() -> None:
    talk = Talk()
    talk.daemon(moving(0.2))
    out = talk.ros(topics.ESTOP, Bool(True))
    assert asked("stop", out) == [{}]
    assert on(topics.CMD_VEL, out) == [Twist()]
    assert talk.daemon(moving(0.2)) == []
    talk.answer("stop", {"stopped": True, "before": False})
    assert on(topics.CMD_VEL, talk.daemon(moving(0.2), AT_S + 0.1)) != []
    assert asked("resume", talk.ros(topics.ESTOP, Bool(False))) == [{}]


def test_a_stop_that_is_said_again_and_again_is_asked_for_once_at_a_time() -> None:
    talk = Talk()
    out = [each for _ in range(100) for each in talk.ros(topics.ESTOP, Bool(True))]
    assert len(asked("stop", out)) == 1
    assert len(asked("resume", talk.ros(topics.ESTOP, Bool(False)))) == 1
    assert len(asked("stop", talk.ros(topics.ESTOP, Bool(True)))) == 1
    talk.answer("stop", {})
    assert len(asked("stop", talk.ros(topics.ESTOP, Bool(True)))) == 1


def test_a_switch_that_nobody_presses_does_not_release_a_robot_that_was_stopped_by_voice() -> None:
    talk = Talk()
    talk.daemon({"event": "statechanged", "at_s": 1.0, "state": "stopped", "doing": "was told to stop", "task": None})
    out = [each for _ in range(100) for each in talk.ros(topics.ESTOP, Bool(False))]
    assert asked("resume", out) == []
    assert [each for each in out if isinstance(each, Log)] == [Log(NOT_PRESSED)]
    talk.ros(topics.ESTOP, Bool(True))
    out = [each for _ in range(100) for each in talk.ros(topics.ESTOP, Bool(False))]
    assert asked("resume", out) == [{}]


def test_odometry_reaches_the_daemon_but_no_faster_than_it_can_use_it() -> None:
    talk = Talk()
    (base,) = asked("base", talk.ros(topics.ODOM, odometry(1.5, 2.5)))
    assert base == pytest.approx({"x_m": 1.5, "y_m": 2.0, "heading_rad": 2.5, "linear_m_s": 0.1, "angular_rad_s": -0.2})
    talk.answer("base", {})
    assert asked("base", talk.ros(topics.ODOM, odometry(1.6, 2.5), AT_S + 0.01)) == []
    assert asked("base", talk.ros(topics.ODOM, odometry(1.7, 2.5), AT_S + 0.04))[0]["x_m"] == 1.7
    assert asked("base", talk.ros(topics.ODOM, odometry(1.8, 2.5), AT_S + 0.08)) == [], "the last is unanswered"
    assert asked("base", talk.ros(topics.ODOM, odometry(1.9, 2.5), AT_S + 1.2))[0]["x_m"] == 1.9


def test_odometry_that_is_no_number_counts_as_none() -> None:
    talk = Talk()
    assert talk.ros(topics.ODOM, odometry(math.nan, 0.0)) == []
    out = talk.tick(AT_S + SILENT_S + 0.1)
    assert "no odometry" in asked("base", out)[0]["fault"]


def test_a_robot_with_wheels_of_its_own_tells_odometry_and_tf() -> None:
    talk = Talk(False, Parameters(base_frame="base_footprint"))
    event = {"event": "odom", "at_s": 1.0, "x_m": 1.0, "y_m": -2.0, "heading_rad": math.pi / 2}
    out = talk.daemon(event | {"linear_m_s": 0.1, "angular_rad_s": 0.3})
    (told,) = on(topics.ODOM, out)
    assert isinstance(told, Odometry)
    assert (told.header.frame_id, told.child_frame_id) == ("odom", "base_footprint")
    assert (told.header.stamp.sec, told.header.stamp.nanosec) == (1000, 250_000_000)
    assert told.pose.pose.position == Point(1.0, -2.0)
    assert told.pose.pose.orientation.heading_rad == pytest.approx(math.pi / 2)
    assert (told.twist.twist.linear.x, told.twist.twist.angular.z) == (0.1, 0.3)
    (tf,) = on(topics.TF, out)
    assert isinstance(tf, TFMessage)
    (moved,) = tf.transforms
    assert (moved.header, moved.child_frame_id) == (told.header, "base_footprint")
    assert moved.transform.translation == Vector3(1.0, -2.0)
    assert moved.transform.rotation == told.pose.pose.orientation


def test_nobody_is_told_where_tf_is_not_wanted_and_cmd_vel_is_never_obeyed() -> None:
    talk = Talk(False, Parameters(publish_tf=False))
    event = {"event": "odom", "x_m": 1.0, "y_m": 0.0, "heading_rad": 0.0, "linear_m_s": 0.0, "angular_rad_s": 0.0}
    assert on(topics.TF, talk.daemon(event)) == []
    assert talk.ros(topics.CMD_VEL, Twist(Vector3(1.0))) == []
    for ros_drives in (False, True):
        assert topics.CMD_VEL not in topics.subscribed(ros_drives)


def test_a_goal_goes_to_navigation_and_its_end_to_the_daemon() -> None:
    talk = Talk()
    assert talk.daemon(moving(0.0, goal=7))[:1] == [Go(PlaceGoal(7, 3.0, 4.0))]
    talk.bridge.goal_progress(7, 1.25)
    (array,) = on(topics.DIAGNOSTICS, talk.answer("status", STATUS))
    assert isinstance(array, DiagnosticArray)
    assert ("distance to the goal, m", "1.25") in {(v.key, v.value) for s in array.status for v in s.values}
    talk.bridge.goal_ended(7, False, "aborted: no way")
    assert asked("base", talk.bridge.outputs()) == [{"goal": 7, "arrived": False, "reason": "aborted: no way"}]
    talk.bridge.goal_ended(7, True, "")
    assert talk.bridge.outputs() == []


def test_stop_cancels_the_goal() -> None:
    talk = Talk()
    talk.daemon(moving(0.0, goal=7))
    out = talk.daemon(moving(0.0, stopped=True) | {"angular_rad_s": 0.0})
    assert out[0] == Cancel(7)
    assert on(topics.CMD_VEL, out) == [Twist()]


def test_the_board_is_told_again_whenever_a_task_changes() -> None:
    talk = Talk()
    out = talk.daemon({"event": "taskchanged", "at_s": 1.0, "robot": "Rob", "task": 1, "state": "done", "owner": "Bot"})
    assert asked("tasks", out) == [{}]
    task = {"number": 1, "name": "sweep", "state": "done", "owner": "Bot", "place": {"x_m": 2.0, "y_m": -1.0}}
    (board,) = on(
        topics.TASKS, talk.answer("tasks", {"now_s": 1.0, "tasks": [task, task | {"owner": None, "place": None}]})
    )
    assert isinstance(board, TaskArray)
    assert board.tasks[0] == Task(1, "sweep", "done", "Bot", True, Point(2.0, -1.0))
    assert board.tasks[1] == Task(1, "sweep", "done")


def test_a_deactivated_node_stands_and_passes_nothing_but_a_stop() -> None:
    talk = Talk()
    talk.answer("status", STATUS)
    assert on(topics.CMD_VEL, talk.daemon(moving(0.2)))
    talk.bridge.deactivate(AT_S)
    out = talk.bridge.outputs()
    assert on(topics.CMD_VEL, out) == [Twist()]
    assert "deactivated" in asked("base", out)[0]["fault"]
    for event in (HEARD, moving(0.2)):
        assert not [each for each in talk.daemon(event) if isinstance(each, Publish) and each.message != Twist()]
    assert asked("say", talk.ros(topics.SAY, String("Hi all, I am Rob, who is here"))) == []
    assert asked("base", talk.ros(topics.ODOM, odometry(1.0, 0.0))) == []
    assert asked("resume", talk.ros(topics.ESTOP, Bool(False))) == []
    assert asked("stop", talk.ros(topics.ESTOP, Bool(True))) == [{}]
    talk.bridge.begin(AT_S)  # the daemon came back meanwhile
    assert asked("subscribe", talk.bridge.outputs()) == []


def test_an_activated_node_begins_anew_with_the_parameters_of_now() -> None:
    talk = Talk(ros_drives=False)
    talk.bridge.deactivate(AT_S)
    talk.bridge.outputs()
    talk.bridge.activate(Parameters(base_frame="base_footprint"), AT_S)
    out = talk.bridge.outputs()
    assert asked("subscribe", out)
    assert asked("tasks", out) == [{}]
    talk.bridge.activate(Parameters(base_frame="base_footprint"), AT_S)
    assert talk.bridge.outputs() == [], "it is active already"
    event = {"event": "odom", "at_s": 1.0, "x_m": 2.5, "y_m": -1.0, "heading_rad": 0.0}
    (told,) = on(topics.ODOM, talk.daemon(event | {"linear_m_s": 0.1, "angular_rad_s": 0.0}))
    assert isinstance(told, Odometry)
    assert told.child_frame_id == "base_footprint"


def test_whether_it_is_stopped_is_told_when_it_changes() -> None:
    talk = Talk()
    assert on(topics.STOPPED, talk.answer("status", STATUS)) == [Bool(False)]
    event = {"event": "statechanged", "at_s": 1.0, "robot": "Rob", "doing": "has stopped", "task": None}
    assert on(topics.STOPPED, talk.daemon(event | {"state": "stopped"})) == [Bool(True)]
    assert on(topics.STOPPED, talk.daemon(event | {"state": "stopped"})) == []
    assert on(topics.STOPPED, talk.daemon(event | {"state": "ready"})) == [Bool(False)]


def levels(outputs: list[Output]) -> dict[str, int]:
    (array,) = on(topics.DIAGNOSTICS, outputs)
    assert isinstance(array, DiagnosticArray)
    return {each.name.removeprefix("hvcpd: "): each.level for each in array.status}


def test_diagnoses_tell_each_part() -> None:
    ok, warn, error = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
    assert levels(Talk().answer("status", STATUS)) == {"robot": ok, "sound": ok, "wheels": ok, "battery": warn}
    bad = STATUS | {"stopped": True, "battery_v": None, "sound": STATUS["sound"] | {"listening": False}}
    bad["wheels"] = STATUS["wheels"] | {"fault": "no odometry"}
    assert levels(Talk().answer("status", bad)) == {"robot": warn, "sound": error, "wheels": error, "battery": ok}
    mute = STATUS | {"wheels": None, "sound": STATUS["sound"] | {"mute": True}}
    assert levels(Talk().answer("status", mute)) == {"robot": ok, "sound": warn, "wheels": ok, "battery": warn}


def test_a_lost_daemon_stops_the_base_and_is_told_of() -> None:
    talk = Talk()
    talk.answer("status", STATUS)
    talk.daemon(moving(0.2))
    talk.bridge.lost(AT_S + 0.1)
    assert on(topics.CMD_VEL, talk.bridge.outputs()) == [Twist()]
    out = talk.tick(AT_S + 1.5)
    (array,) = on(topics.DIAGNOSTICS, out)
    assert isinstance(array, DiagnosticArray)
    assert [(each.level, each.message) for each in array.status] == [(DiagnosticStatus.STALE, NO_DAEMON)]


def test_a_lost_master_stops_the_base_and_the_daemon_is_told_why() -> None:
    talk = Talk()
    talk.daemon(moving(0.2, goal=None))
    talk.bridge.master_lost("no ROS master", AT_S)
    out = talk.bridge.outputs()
    assert on(topics.CMD_VEL, out) == [Twist()]
    assert asked("base", out) == [{"fault": "no ROS master"}]


def test_the_same_refusal_of_odometry_is_told_once() -> None:
    talk = Talk()
    told = []
    for k in range(5):
        talk.ros(topics.ODOM, replace(odometry(0.0, 0.0)), AT_S + 0.1 * k)
        told += talk.answer("base", code="refused", text="hvcpd has the wheels")
    assert told == [Log("base: hvcpd has the wheels")]
