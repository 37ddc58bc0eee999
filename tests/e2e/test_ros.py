"""Two robots, each with its own real roscore, share out four plants by voice: seen from ROS alone."""

from __future__ import annotations

import math
from collections import Counter
from itertools import permutations
from pathlib import Path

import pytest

from tests.e2e import network, parts, ros_robot
from tests.e2e.ros_robot import MOVES, RosRobot
from tests.e2e.stage import FOUR, MISSION_S, Stage, staged

MISSING = parts.missing() or ros_robot.missing()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(MISSING), reason=MISSING)]

NEAR_M = 0.03
WATERING_S = 0.8
"""Of the second that watering takes; the trail has a point every 0.1 s."""
TROUBLE_S = 60.0


def knows_all_done(robot: RosRobot) -> bool:
    board = robot.board()
    return len(board) == len(FOUR) and all(state == "done" for state, _ in board.values())


def stood_longest_s(robot: RosRobot, place: tuple[float, float]) -> float:
    """The longest time that its base truly stood at a place."""
    longest_s, since_s = 0.0, math.inf
    for at_s, (x_m, y_m, _, linear, angular) in robot.seen("pose"):
        if math.dist((x_m, y_m), place) < NEAR_M and max(abs(linear), abs(angular)) < MOVES:
            since_s = min(since_s, at_s)
            longest_s = max(longest_s, at_s - since_s)
        else:
            since_s = math.inf
    return longest_s


def watered(robot: RosRobot) -> list[int]:
    return [event["task"] for _, event in robot.happened("performed")]


def heard_after(robot: RosRobot, at_s: float) -> list[str]:
    return [text for when_s, text in robot.seen("heard") if when_s > at_s]


def nodes_of(robot: RosRobot) -> set[str]:
    return robot.core.nodes() if robot.core is not None else set()


def kill_and_revive_a_master(stage: Stage[RosRobot]) -> tuple[RosRobot, float]:
    """The one of a robot that drives: it stands, goes on talking, and drives again when the master is back. The other
    robot, and when the master died (monotonic, s)."""
    stage.wait(lambda: any(robot.drives for robot in stage.robots), MISSION_S, "somebody drives")
    victim, other = sorted(stage.robots, key=lambda robot: not robot.drives)
    at_s = victim.seen("pose")[-1][0]
    assert victim.core is not None
    victim.core.kill_master()
    assert not victim.core.answers()
    stage.wait(lambda: not victim.drives, TROUBLE_S, "its base stands")
    stage.wait(lambda: bool(heard_after(other, at_s)), TROUBLE_S, "it goes on talking, and the other hears it")
    assert victim.seen("cmd_vel")[-1][1] == [0.0, 0.0]
    assert not victim.drives, "it drove without a master"
    victim.restart_ros()
    stage.wait(lambda: "/hvcpd" in nodes_of(victim), TROUBLE_S, "the bridge is back")
    return other, at_s


def test_two_robots_with_a_roscore_each_do_four_plants_though_a_master_dies(tmp_path: Path, units: Path) -> None:
    with staged(tmp_path, units, RosRobot, FOUR) as stage:
        stage.start()
        untroubled, died_s = kill_and_revive_a_master(stage)
        stage.wait(lambda: all(map(knows_all_done, stage.robots)), MISSION_S, "both know all as done")
        rob, bot = stage.robots
        assert Counter(watered(rob) + watered(bot)) == dict.fromkeys(FOUR, 1)
        assert rob.board() == bot.board()
        for robot, other in permutations(stage.robots):
            assert nodes_of(robot) == {"/rosout", "/base", "/hvcpd"}, "its master knows others"
            assert watered(robot), "it left everything to the other"
            if parts.own_network():
                assert robot.daemon is not None
                assert network.interfaces(robot.daemon.pid) == {"lo": 0}, "ROS has come into the daemon"
            assert all(stood_longest_s(robot, FOUR[number][1]) > WATERING_S for number in watered(robot))
            sentences = [sentence for _, sentence in robot.seen("heard/sentence")]
            assert {speaker for speaker, *_ in sentences} == {other.name}
            assert all(0.0 < sure <= 1.0 for *_, sure in sentences)
            if robot is untroubled:
                # Not from the beginning: it may speak before ROS has connected those that note its words.
                assert {text for _, text in robot.seen("said")} >= set(heard_after(other, died_s)) > set()
