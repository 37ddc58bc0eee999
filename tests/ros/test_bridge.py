"""The bridge without ROS and without sockets: what comes in, and what goes out on either side."""

from __future__ import annotations

import json

import pytest

from hvcpd.ros import messages as m
from hvcpd.ros import topics
from hvcpd.ros.bridge import MAX_SAYS, NO_DAEMON, TOO_MANY, Log, Output, Publish
from hvcpd.ros.parameters import Parameters
from tests.ros.talk import AT_S, HEARD, STAMP_S, STATUS, Talk, asked, moving, odometry, on


@pytest.mark.parametrize(("ros_drives", "frequent"), [(True, "drive"), (False, "odom")])
def test_it_follows_what_it_needs_and_nothing_else_that_is_frequent(ros_drives: bool, frequent: str) -> None:
    (wanted,) = asked("subscribe", Talk(ros_drives).out)
    assert set(wanted["events"]) & {"drive", "odom", "level", "moved"} == {frequent}


def test_what_is_heard_is_told_as_a_sentence_and_with_all_that_is_known() -> None:
    talk = Talk()
    talk.answer("status", STATUS)
    out = talk.daemon(HEARD)
    assert on(topics.HEARD, out) == [m.String("Hi Rob, I am Bot, confirmed four")]
    (twin,) = on(topics.HEARD_SENTENCE, out)
    assert isinstance(twin, m.Sentence)
    assert (twin.speaker, twin.confidence) == ("Bot", 0.93)
    assert (twin.words[1].text, twin.words[1].begin_s) == ("four", 2.0)
    assert twin.duration_s == twin.words[-1].end_s == pytest.approx(2.4)
    assert twin.header.stamp == m.Time.of(STAMP_S + 1.0), "the daemon's clock stood at 20 s then"
    assert on(topics.SAID, out) == []
    (event,) = on(topics.EVENTS, out)
    assert isinstance(event, m.String)
    assert json.loads(event.data)["event"] == "heard"


def test_what_is_to_be_said_is_asked_for_and_a_refusal_is_told() -> None:
    talk = Talk()
    out = talk.ros(topics.SAY, m.String("make coffee"))
    assert asked("say", out) == [{"text": "make coffee"}]
    assert talk.answer("say", code="not_in_phrasebook", text="nobody says coffee") == [Log("say: nobody says coffee")]


def test_a_task_is_changed_and_what_is_no_change_is_told() -> None:
    talk = Talk()
    assert asked("task", talk.ros(topics.TASK, m.String("again 12"))) == [{"do": "again", "number": 12}]
    assert talk.answer("task", code="refused", text="there is no task 12") == [Log("task: there is no task 12")]
    added = talk.ros(topics.TASK, m.String('add {"number": 11, "name": "water the red tulip"}'))
    assert asked("task", added) == [{"do": "add", "task": {"number": 11, "name": "water the red tulip"}}]
    for wrong in "again and again", "add 11", 'add {"number"', "add " + "[" * 3000:
        (log,) = talk.ros(topics.TASK, m.String(wrong))
        assert isinstance(log, Log)
        assert "write 'again 3'" in log.text


def test_what_is_too_long_or_too_much_to_be_said_keeps_nothing_else_from_the_daemon() -> None:
    talk = Talk()
    (log,) = talk.ros(topics.SAY, m.String("x" * 10_000))
    assert isinstance(log, Log)
    assert "10000 characters" in log.text
    out = [each for _ in range(1000) for each in talk.ros(topics.SAY, m.String("hello"))]
    assert len(asked("say", out)) == MAX_SAYS
    assert [each.text for each in out if isinstance(each, Log)] == [TOO_MANY]
    talk.answer("say", {"text": "hello"})
    assert asked("say", talk.ros(topics.SAY, m.String("hello"))) == [{"text": "hello"}]


def test_the_board_is_told_again_whenever_a_task_changes() -> None:
    talk = Talk()
    out = talk.daemon({"event": "taskchanged", "at_s": 1.0, "robot": "Rob", "task": 1, "state": "done", "owner": "Bot"})
    assert asked("tasks", out) == [{}]
    task = {"number": 1, "name": "sweep", "state": "done", "owner": "Bot", "place": {"x_m": 2.0, "y_m": -1.0}}
    (board,) = on(
        topics.TASKS, talk.answer("tasks", {"now_s": 1.0, "tasks": [task, task | {"owner": None, "place": None}]})
    )
    assert isinstance(board, m.TaskArray)
    assert board.tasks[0] == m.Task(1, "sweep", "done", "Bot", True, m.Point(2.0, -1.0))
    assert board.tasks[1] == m.Task(1, "sweep", "done")


def test_a_deactivated_node_stands_and_passes_nothing_but_a_stop() -> None:
    talk = Talk()
    talk.answer("status", STATUS)
    assert on(topics.CMD_VEL, talk.daemon(moving(0.2)))
    talk.bridge.deactivate(AT_S)
    out = talk.bridge.outputs()
    assert on(topics.CMD_VEL, out) == [m.Twist()]
    assert "deactivated" in asked("base", out)[0]["fault"]
    for event in (HEARD, moving(0.2)):
        assert not [each for each in talk.daemon(event) if isinstance(each, Publish) and each.message != m.Twist()]
    assert asked("say", talk.ros(topics.SAY, m.String("Hi all, I am Rob, who is here"))) == []
    assert asked("base", talk.ros(topics.ODOM, odometry(1.0, 0.0))) == []
    assert asked("resume", talk.ros(topics.ESTOP, m.Bool(False))) == []
    assert asked("stop", talk.ros(topics.ESTOP, m.Bool(True))) == [{}]
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
    assert isinstance(told, m.Odometry)
    assert told.child_frame_id == "base_footprint"


def test_whether_it_is_stopped_is_told_when_it_changes() -> None:
    talk = Talk()
    assert on(topics.STOPPED, talk.answer("status", STATUS)) == [m.Bool(False)]
    event = {"event": "statechanged", "at_s": 1.0, "robot": "Rob", "doing": "has stopped", "task": None}
    assert on(topics.STOPPED, talk.daemon(event | {"state": "stopped"})) == [m.Bool(True)]
    assert on(topics.STOPPED, talk.daemon(event | {"state": "stopped"})) == []
    assert on(topics.STOPPED, talk.daemon(event | {"state": "ready"})) == [m.Bool(False)]


def levels(outputs: list[Output]) -> dict[str, int]:
    (array,) = on(topics.DIAGNOSTICS, outputs)
    assert isinstance(array, m.DiagnosticArray)
    return {each.name.removeprefix("hvcpd: "): each.level for each in array.status}


def test_diagnoses_tell_each_part() -> None:
    ok, warn, error = m.DiagnosticStatus.OK, m.DiagnosticStatus.WARN, m.DiagnosticStatus.ERROR
    assert levels(Talk().answer("status", STATUS)) == {"robot": ok, "sound": ok, "wheels": ok, "battery": warn}
    bad = STATUS | {"stopped": True, "battery_v": None, "sound": STATUS["sound"] | {"listening": False}}
    bad["wheels"] = STATUS["wheels"] | {"fault": "no odometry"}
    assert levels(Talk().answer("status", bad)) == {"robot": warn, "sound": error, "wheels": error, "battery": ok}
    mute = STATUS | {"wheels": None, "sound": STATUS["sound"] | {"mute": True}}
    assert levels(Talk().answer("status", mute)) == {"robot": ok, "sound": warn, "wheels": ok, "battery": warn}


def test_a_bridge_that_does_not_drive_publishes_only_what_it_has_announced_when_the_daemon_ends() -> None:
    """It told the base to stand, for which it has no publisher, and ended with a traceback."""
    talk = Talk(False)
    talk.answer("status", STATUS)
    talk.bridge.lost(AT_S)
    out = [*talk.bridge.outputs(), *talk.tick(AT_S + 1.5)]
    assert {each.topic for each in out if isinstance(each, Publish)} <= set(topics.published(False))


def test_a_lost_daemon_stops_the_base_and_is_told_of() -> None:
    talk = Talk()
    talk.answer("status", STATUS)
    talk.daemon(moving(0.2))
    talk.bridge.lost(AT_S + 0.1)
    assert on(topics.CMD_VEL, talk.bridge.outputs()) == [m.Twist()]
    out = talk.tick(AT_S + 1.5)
    (array,) = on(topics.DIAGNOSTICS, out)
    assert isinstance(array, m.DiagnosticArray)
    assert [(each.level, each.message) for each in array.status] == [(m.DiagnosticStatus.STALE, NO_DAEMON)]
