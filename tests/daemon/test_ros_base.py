"""A base that ROS has: freshness, what the bridge is told, and what the robot leaves alone while there is no base."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from structlog.testing import capture_logs

from hvcpd.config.settings import WheelSettings
from hvcpd.daemon.base_request_handler import BaseRequestHandler
from hvcpd.daemon.devices import make_wheels
from hvcpd.daemon.wheel_service import WheelService
from hvcpd.errors import DeviceError
from hvcpd.hardware.goals import GoalNavigator
from hvcpd.hardware.kinematics import Twist
from hvcpd.hardware.motion import GoTo, MotionState
from hvcpd.hardware.ros_base import FRESH_S, LASTING_S, NEVER, BaseReport, RosBase
from hvcpd.ports import STANDSTILL, Pose, WheelReading
from tests.daemon.control_bench import ControlBench, Talk
from tests.daemon.hand_clock import Clock

ODOMETRY = {"x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0, "linear_m_s": 0.0, "angular_rad_s": 0.0}


def test_what_is_fresh_is_a_reading_and_what_is_old_is_a_fault() -> None:
    clock = Clock()
    base = RosBase(clock=clock)
    base.open()
    with pytest.raises(DeviceError, match="hvcpctl ros"):
        base.exchange(STANDSTILL)
    base.tell(BaseReport(Pose(1.0, 2.0, 0.5), Twist(0.1, 0.0)))
    clock.now_s += FRESH_S
    reading = base.exchange(STANDSTILL)
    assert reading.pose == Pose(1.0, 2.0, 0.5)
    assert reading.left_rad_s == pytest.approx(0.1 / 0.033)
    clock.now_s += 0.01
    with pytest.raises(DeviceError, match=r"no odometry for 0\.4 s"):
        base.exchange(STANDSTILL)


def test_the_bridge_tells_why_and_is_believed_for_a_while() -> None:
    clock = Clock()
    base = RosBase(clock=clock)
    base.tell(BaseReport(Pose(0.0, 0.0), Twist()))
    base.tell_fault("no master at port 11311")
    assert base.fault == "no master at port 11311"
    clock.now_s += LASTING_S + 0.1
    assert base.fault is not None
    assert "hvcpctl ros" in base.fault


def test_the_settings_make_such_a_base_without_a_port() -> None:
    assert isinstance(make_wheels(WheelSettings(driver="ros", port="/nowhere")), RosBase)


@asynccontextmanager
async def ros_bench(
    directory: Path, clock: Clock, navigator: GoalNavigator | None = None
) -> AsyncIterator[tuple[ControlBench, Talk]]:
    """A daemon whose base ROS has, and a bridge that follows `drive`."""
    bench = ControlBench(directory, **{"wheels.driver": "ros"})
    await bench.open(with_robot=False)
    bench.service.begin(bench.bench.robot)
    base = RosBase(clock=clock)
    bench.body.base, bench.body.wheels = BaseRequestHandler(base, navigator), WheelService(base, lost_s=float("inf"))
    try:
        talk = await bench.connect()
        await talk.ask("subscribe", events=["drive"])
        yield bench, talk
    finally:
        await bench.close()


async def told(talk: Talk, **odometry: object) -> dict[str, Any]:
    return await talk.ask("base", **(ODOMETRY | odometry))


async def until(talk: Talk, **fields: object) -> dict[str, Any]:
    """The next `drive` event with these fields."""
    while True:
        line = await talk.line()
        assert line is not None
        if line.get("event") == "drive" and all(line[key] == value for key, value in fields.items()):
            return line


async def test_without_a_base_nothing_that_drives_is_claimed_and_with_it_the_robot_drives(tmp_path: Path) -> None:
    clock = Clock()
    async with ros_bench(tmp_path, clock) as (bench, talk):
        robot = bench.bench.robot
        await bench.live(blocks=1200)
        assert robot.coordination.task is None
        assert robot.coordination.role.unable == {1}
        assert (await told(talk))["ok"]
        await drive_off(bench, talk)
        await bench.live(blocks=4)
        drive = await until(talk, stopped=False, goal=None)
        while drive["linear_m_s"] == 0.0:
            drive = await until(talk)
        assert drive["linear_m_s"] > 0.0
        assert drive["angular_rad_s"] == pytest.approx(0.0)


async def test_why_there_is_no_base_is_told_once(tmp_path: Path) -> None:
    with capture_logs() as logs:
        async with ros_bench(tmp_path, Clock()) as (bench, _):
            await bench.live(blocks=200)
    told = {line["event"]: line.get("reason") for line in logs}
    assert told["no base"] is None
    assert told["wheels failed"] == NEVER


async def drive_off(bench: ControlBench, talk: Talk) -> None:
    wheels = bench.body.wheels
    assert wheels is not None
    await told(talk)  # it stays fresh, for the clock is moved by hand
    while wheels.wanted == STANDSTILL:
        await bench.live(blocks=4)


async def test_when_the_odometry_stops_the_base_is_told_to_stand_and_the_task_is_free_again_later(
    tmp_path: Path,
) -> None:
    clock = Clock()
    async with ros_bench(tmp_path, clock) as (bench, talk):
        await drive_off(bench, talk)
        clock.now_s += FRESH_S + 0.01
        await bench.live(blocks=1)
        await until(talk, linear_m_s=0.0)
        robot = bench.bench.robot
        while "Rob" not in robot.coordination.board[1].failed_by:
            await bench.live()
        assert robot.coordination.role.unable == {1}
        await told(talk)
        await bench.live(blocks=2)
        assert robot.coordination.role.unable == frozenset()
        assert robot.coordination.board[1].failed_by == frozenset()
        assert bench.body.wheels is not None
        assert bench.body.wheels.fault is None


async def test_a_goal_is_told_while_there_is_a_base_and_its_end_is_taken(tmp_path: Path) -> None:
    clock, navigator = Clock(), GoalNavigator()
    navigator.start(GoTo(1.0, 2.0), Pose(0.0, 0.0))
    async with ros_bench(tmp_path, clock, navigator) as (bench, talk):
        reading = WheelReading(0.0, 0.0)
        navigator.step(Pose(0.0, 0.0), 0.0, reading)
        await bench.live(blocks=4)
        await until(talk, goal=None)
        await told(talk)
        await bench.live(blocks=1)
        await until(talk, goal={"number": 1, "x_m": 1.0, "y_m": 2.0})
        assert (await talk.ask("base", goal=1, arrived=False, reason="a wall"))["ok"]
        assert (navigator.state, navigator.reason) == (MotionState.FAILED, "a wall")
        await bench.live(blocks=1)
        await until(talk, goal=None)


async def test_stop_is_told_until_resume(tmp_path: Path) -> None:
    async with ros_bench(tmp_path, Clock()) as (bench, talk):
        await drive_off(bench, talk)
        robot = bench.bench.robot
        await talk.ask("stop")
        await bench.live(blocks=2)
        stopped = await until(talk, stopped=True)
        assert (stopped["linear_m_s"], stopped["angular_rad_s"]) == (0.0, 0.0)
        robot.coordination.resume(robot.now)
        await bench.live(blocks=4)
        await until(talk, stopped=False)


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ({"x_m": 1.0}, "bad_argument"),
        (ODOMETRY | {"x_m": 1e300}, "bad_argument"),
        (ODOMETRY | {"angular_rad_s": "fast"}, "bad_argument"),
        (ODOMETRY | {"wings": 2}, "bad_argument"),
    ],
)
async def test_what_is_no_odometry_is_refused(tmp_path: Path, arguments: dict[str, object], code: str) -> None:
    async with ros_bench(tmp_path, Clock()) as (_, talk):
        reply = await talk.ask("base", **arguments)
        assert reply["error"]["code"] == code


async def test_who_has_wheels_of_its_own_takes_no_odometry(tmp_path: Path) -> None:
    bench = ControlBench(tmp_path)
    await bench.open()
    try:
        talk = await bench.connect()
        reply = await told(talk)
        assert reply["error"]["code"] == "refused"
        await talk.ask("subscribe", events=["odom", "drive"])
        await bench.live(blocks=8)
        line = await talk.line()
        assert line is not None
        assert line["event"] == "odom"
        assert line["x_m"] == pytest.approx(bench.bench.robot.odometry.pose.x_m)
    finally:
        await bench.close()


async def test_a_reload_keeps_in_mind_that_there_is_no_base(tmp_path: Path) -> None:
    async with ros_bench(tmp_path, Clock()) as (bench, talk):
        await bench.live()
        (bench.file).write_text("mode: volunteer\npick: random\n")
        reply = await talk.ask("reload")
        assert reply["result"]["changed"]
        role = bench.bench.robot.coordination.role
        assert role == replace(role, nearest_first=False, unable=frozenset({1}))
