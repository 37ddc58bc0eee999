"""Two robots as real processes share out plants by voice alone, in real time: real devices, fake air and motors.

Nothing here looks inside: memories, transcripts, /proc, and where the motors truly brought the robots.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable
from itertools import permutations
from pathlib import Path

import pytest

from hil_fakes.motor_process import TrailPoint
from hil_fakes.sound_server import wait_until
from tests.e2e import network, parts
from tests.e2e.robot import STANDING_RAD_S, RobotProcess
from tests.e2e.stage import MISSION_S, TASKS, THREE, Stage, staged

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(parts.missing()), reason=parts.missing())]

NEAR_M = 0.03
"""So near to a plant counts as being there: the fakes' and the navigator's errors together stay below 15 mm."""
WATERING_S = 0.7
"""Of the second that watering takes; the trail has a point every 50 ms, or every 150 ms on a busy machine."""
TROUBLE_S = 60.0
"""Until a trouble is noticed, or over: seconds, on a machine with other work to do."""
NUMBERS = ("one", "two", "three", "four", "five")


def watered(robot: RobotProcess) -> list[int]:
    """The plants that it did, by its log."""
    return [int(event["task"]) for event in robot.events("performed")]


def reported(robot: RobotProcess, other: RobotProcess) -> set[str]:
    """The numbers, as words, of the tasks that it said it had completed, by its own transcript, the end of which is
    lost if it is killed, and by what the other robot heard."""
    heard = [
        record.text for record in other.transcript() if record.kind == "heard" and f"I am {robot.name}" in record.text
    ]
    told = (re.search(r"task (\w+)(?: and (\w+))? complete", text) for text in [*robot.said(), *heard])
    return {number for found in told if found for number in found.groups() if number}


def stood_longest_s(trail: Iterable[TrailPoint], place: tuple[float, float]) -> float:
    """The longest time that a robot truly stood at a place."""
    longest_s, since_s = 0.0, math.inf
    for point in trail:
        if math.dist((point.x_m, point.y_m), place) < NEAR_M and point.fastest_rad_s < STANDING_RAD_S:
            since_s = min(since_s, point.at_s)
            longest_s = max(longest_s, point.at_s - since_s)
        else:
            since_s = math.inf
    return longest_s


def assert_each_plant_done_once(stage: Stage[RobotProcess]) -> None:
    rob, bot = stage.robots
    assert Counter(watered(rob) + watered(bot)) == dict.fromkeys(stage.tasks, 1)
    assert rob.tasks() == bot.tasks()
    for robot in stage.robots:
        assert sorted(watered(robot)) == [n for n, (_, owner) in robot.tasks().items() if owner == robot.name]
    assert not reported(rob, bot) & reported(bot, rob)
    assert reported(rob, bot) | reported(bot, rob) == set(NUMBERS[: len(stage.tasks)])


def assert_driven_there(robot: RobotProcess) -> None:
    trail = robot.trail()
    for event in robot.events("performed"):
        _, place = TASKS[int(event["task"])]
        assert stood_longest_s(trail, place) > WATERING_S, event


def assert_at_rest(robot: RobotProcess) -> None:
    last = robot.trail()[-1]
    assert last.fastest_rad_s < STANDING_RAD_S
    assert last.torque == (0, 0)


def assert_no_way_but_sound(robot: RobotProcess) -> None:
    assert robot.daemon is not None
    pid = robot.daemon.pid
    assert network.socket_kinds(pid) == {network.UNIX}
    if parts.own_network():
        assert network.interfaces(pid) == {"lo": 0}
        assert network.routes(pid) == "", "the loopback is up"


def assert_leaves_in_order(robot: RobotProcess) -> None:
    assert robot.end_daemon() == 0
    assert robot.said()[-1].endswith("I am leaving")
    assert_at_rest(robot)


def skip_without_own_network() -> None:
    if not parts.own_network():
        pytest.skip("all of it held but one: unshare is not permitted, so the robots were not cut off from the network")


def test_two_processes_share_five_plants_by_voice_alone(tmp_path: Path, units: Path) -> None:
    with staged(tmp_path, units, RobotProcess) as stage:
        stage.start()
        for robot in stage.robots:
            assert_no_way_but_sound(robot)
        stage.wait_for_all_done()
        for robot, other in permutations(stage.robots):
            assert f"I am {robot.name}" in robot.said()[0]
            assert {record.speaker for record in robot.transcript() if record.kind == "heard"} == {other.name}
            assert watered(robot), "it left everything to the other"
            assert_no_way_but_sound(robot)
            assert_driven_there(robot)
        assert_each_plant_done_once(stage)
        for robot in stage.robots:
            assert_leaves_in_order(robot)
    skip_without_own_network()


def test_sound_server_daemon_and_port_die_in_mid_mission_and_every_plant_is_done_once(
    tmp_path: Path, units: Path
) -> None:
    with staged(tmp_path, units, RobotProcess, THREE) as stage:
        stage.start()
        stage.wait(lambda: any(map(watered, stage.robots)), MISSION_S, "the first plant is watered")
        kill_sound_server(stage)
        stage.wait(lambda: any(robot.drives for robot in stage.robots), MISSION_S, "somebody drives")
        victim, other = sorted(stage.robots, key=lambda robot: not robot.drives)
        kill_daemon(stage, victim)
        lose_port(stage, other)
        stage.wait_for_all_done()
        assert_each_plant_done_once(stage)
        for robot in stage.robots:
            assert_driven_there(robot)
            assert_no_way_but_sound(robot)
            assert_leaves_in_order(robot)
    skip_without_own_network()


def kill_sound_server(stage: Stage[RobotProcess]) -> None:
    """kill -9 and a restart; the robots stand still meanwhile, and go on by themselves."""
    before = [robot.daemon for robot in stage.robots]
    stage.server.kill()
    stage.wait(lambda: all(r.events("sound failed") for r in stage.robots), TROUBLE_S, "both notice it")
    stage.wait(lambda: not any(r.drives for r in stage.robots), TROUBLE_S, "both stand")
    stage.server.start()
    stage.wait(lambda: all(r.events("sound is back") for r in stage.robots), TROUBLE_S, "both hear again")
    assert [robot.daemon for robot in stage.robots] == before, "a daemon did not survive it"


def kill_daemon(stage: Stage[RobotProcess], victim: RobotProcess) -> None:
    """kill -9 and a restart; the motors stand still meanwhile, by themselves."""
    victim.kill_daemon()
    wait_until(lambda: not victim.drives, TROUBLE_S, "its motors stop by themselves")
    victim.start_daemon()


def lose_port(stage: Stage[RobotProcess], robot: RobotProcess) -> None:
    """The motors' adapter is pulled out and put back."""
    robot.command_motors("unplug")
    stage.wait(lambda: bool(robot.events("wheels failed")), TROUBLE_S, "it notices it")
    robot.command_motors("replug")
    stage.wait(lambda: bool(robot.events("wheels answer again")), TROUBLE_S, "its wheels answer again")
