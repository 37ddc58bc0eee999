"""The bridge and the base: speeds, stops, odometry and goals."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from hvcpd.ports import PlaceGoal
from hvcpd.ros import messages as m
from hvcpd.ros import topics
from hvcpd.ros.bridge import NOT_PRESSED, SILENT_S, Ask, Log
from hvcpd.ros.driving import Cancel, Go
from hvcpd.ros.parameters import Parameters
from tests.ros.talk import AT_S, STATUS, Talk, asked, moving, odometry, on


def test_speeds_reach_cmd_vel() -> None:
    (twist,) = on(topics.CMD_VEL, Talk().daemon(moving(0.15)))
    assert twist == m.Twist(m.Vector3(x=0.15), m.Vector3(z=0.5))


def test_a_base_that_ros_has_is_told_to_stand_before_anything_else() -> None:
    assert on(topics.CMD_VEL, Talk().tick(AT_S + 0.05)) == [m.Twist()]
    assert on(topics.CMD_VEL, Talk(ros_drives=False).tick(AT_S + 0.05)) == []


def test_estop_stands_at_once_and_no_older_word_moves_the_base_again() -> None:
    talk = Talk()
    talk.daemon(moving(0.2))
    out = talk.ros(topics.ESTOP, m.Bool(True))
    assert asked("stop", out) == [{}]
    assert on(topics.CMD_VEL, out) == [m.Twist()]
    assert talk.daemon(moving(0.2)) == []
    talk.answer("stop", {"stopped": True, "before": False})
    assert on(topics.CMD_VEL, talk.daemon(moving(0.2), AT_S + 0.1)) != []
    assert asked("resume", talk.ros(topics.ESTOP, m.Bool(False))) == [{}]


def test_a_stop_that_is_said_again_and_again_is_asked_for_once_at_a_time() -> None:
    talk = Talk()
    out = [each for _ in range(100) for each in talk.ros(topics.ESTOP, m.Bool(True))]
    assert len(asked("stop", out)) == 1
    assert len(asked("resume", talk.ros(topics.ESTOP, m.Bool(False)))) == 1
    assert len(asked("stop", talk.ros(topics.ESTOP, m.Bool(True)))) == 1
    talk.answer("stop", {})
    assert len(asked("stop", talk.ros(topics.ESTOP, m.Bool(True)))) == 1


def test_a_switch_that_stays_pressed_asks_only_while_the_robot_is_not_stopped() -> None:
    """One that repeats true ten times a second filled the daemon's log as often."""
    talk = Talk()
    talk.answer("status", STATUS)
    event = {"event": "statechanged", "at_s": 1.0, "doing": "", "task": None}
    for state, times in (("ready", 1), ("stopped", 0), ("ready", 1)):  # in the end somebody has said "resume"
        talk.daemon(event | {"state": state})
        asks = [len(asked("stop", talk.ros(topics.ESTOP, m.Bool(True)))) for _ in range(5)]
        assert sum(asks) == times
        if times:
            talk.answer("stop", {"stopped": True, "before": False})
    talk.daemon(event | {"state": "stopped"})
    talk.bridge.lost(AT_S)
    talk.begin()
    assert len(asked("stop", talk.ros(topics.ESTOP, m.Bool(True)))) == 1, "it may be another daemon"


def test_a_stop_without_a_daemon_stops_the_next_one_before_anything_else() -> None:
    """It was lost, and the robot drove as soon as its daemon had started."""
    talk = Talk()
    talk.bridge.lost(AT_S)
    talk.ros(topics.ESTOP, m.Bool(True))
    for answered in (False, False, True):
        first, *others = talk.begin()
        assert isinstance(first, Ask)
        assert first.command == "stop"
        assert asked("stop", others) == []
        if answered:
            talk.answer("stop", {"stopped": True, "before": False})
        talk.bridge.lost(AT_S)
    assert asked("stop", talk.begin()) == []


def test_a_switch_that_nobody_presses_does_not_release_a_robot_that_was_stopped_by_voice() -> None:
    talk = Talk()
    talk.daemon({"event": "statechanged", "at_s": 1.0, "state": "stopped", "doing": "was told to stop", "task": None})
    out = [each for _ in range(100) for each in talk.ros(topics.ESTOP, m.Bool(False))]
    assert asked("resume", out) == []
    assert [each for each in out if isinstance(each, Log)] == [Log(NOT_PRESSED)]
    talk.ros(topics.ESTOP, m.Bool(True))
    out = [each for _ in range(100) for each in talk.ros(topics.ESTOP, m.Bool(False))]
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
    assert isinstance(told, m.Odometry)
    assert (told.header.frame_id, told.child_frame_id) == ("odom", "base_footprint")
    assert (told.header.stamp.sec, told.header.stamp.nanosec) == (1000, 250_000_000)
    assert told.pose.pose.position == m.Point(1.0, -2.0)
    assert told.pose.pose.orientation.heading_rad == pytest.approx(math.pi / 2)
    assert (told.twist.twist.linear.x, told.twist.twist.angular.z) == (0.1, 0.3)
    (tf,) = on(topics.TF, out)
    assert isinstance(tf, m.TFMessage)
    (moved,) = tf.transforms
    assert (moved.header, moved.child_frame_id) == (told.header, "base_footprint")
    assert moved.transform.translation == m.Vector3(1.0, -2.0)
    assert moved.transform.rotation == told.pose.pose.orientation


def test_nobody_is_told_where_tf_is_not_wanted_and_cmd_vel_is_never_obeyed() -> None:
    talk = Talk(False, Parameters(publish_tf=False))
    event = {"event": "odom", "x_m": 1.0, "y_m": 0.0, "heading_rad": 0.0, "linear_m_s": 0.0, "angular_rad_s": 0.0}
    assert on(topics.TF, talk.daemon(event)) == []
    assert talk.ros(topics.CMD_VEL, m.Twist(m.Vector3(1.0))) == []
    for ros_drives in (False, True):
        assert topics.CMD_VEL not in topics.subscribed(ros_drives)


@pytest.mark.parametrize(
    ("feedback", "left_m"),
    [
        ({"distance_remaining": 1.25}, "1.25"),  # of Nav2
        ({"base_position.pose.position.x": 0.0, "base_position.pose.position.y": 0.0}, "5.00"),  # of move_base
        ({}, "nan"),  # what is no number is left out
    ],
)
def test_a_goal_goes_to_navigation_and_its_end_to_the_daemon(feedback: dict[str, float | str], left_m: str) -> None:
    talk = Talk()
    assert talk.daemon(moving(0.0, goal=7))[:1] == [Go(PlaceGoal(7, 3.0, 4.0))]
    talk.bridge.goal_fed_back(7, feedback)
    (array,) = on(topics.DIAGNOSTICS, talk.answer("status", STATUS))
    assert isinstance(array, m.DiagnosticArray)
    assert ("distance to the goal, m", left_m) in {(v.key, v.value) for s in array.status for v in s.values}
    talk.bridge.goal_ended(7, False, "aborted: no way")
    assert asked("base", talk.bridge.outputs()) == [{"goal": 7, "arrived": False, "reason": "aborted: no way"}]
    talk.bridge.goal_ended(7, True, "")
    assert talk.bridge.outputs() == []


def test_stop_cancels_the_goal() -> None:
    talk = Talk()
    talk.daemon(moving(0.0, goal=7))
    out = talk.daemon(moving(0.0, stopped=True) | {"angular_rad_s": 0.0})
    assert out[0] == Cancel(7)
    assert on(topics.CMD_VEL, out) == [m.Twist()]


def test_a_lost_master_stops_the_base_and_the_daemon_is_told_why() -> None:
    talk = Talk()
    talk.daemon(moving(0.2, goal=None))
    talk.bridge.master_lost("no ROS master", AT_S)
    out = talk.bridge.outputs()
    assert on(topics.CMD_VEL, out) == [m.Twist()]
    assert asked("base", out) == [{"fault": "no ROS master"}]


def test_the_same_refusal_of_odometry_is_told_once() -> None:
    talk = Talk()
    told = []
    for k in range(5):
        talk.ros(topics.ODOM, replace(odometry(0.0, 0.0)), AT_S + 0.1 * k)
        told += talk.answer("base", code="refused", text="hvcpd has the wheels")
    assert told == [Log("base: hvcpd has the wheels")]
