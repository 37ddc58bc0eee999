"""A joint as a skill: done, blocked, paused and cancelled; and in a daemon, from the claim to the gripper."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from hvcpd.config.settings_file import load_settings
from hvcpd.coordination.states import State
from hvcpd.daemon.skill_hosting import JointService
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.ports import STANDSTILL
from hvcpd.robot.records import PerformedRecord, SaidRecord
from hvcpd.skills.joints import JointRunner
from hvcpd.skills.life import Call
from hvcpd.skills.runners import FailedError
from tests.daemon.control_bench import ControlBench
from tests.hardware.test_joints import Bench, bench
from tests.robot.test_hold import BLOCK_S
from tests.skills.virtual_loop import pass_time, run_virtually


def call(**arguments: float | str) -> Call:
    return Call(1, 1, "grip", tuple(arguments.items()), 20.0)


class Scene:
    """A robot whose bus is served as a standing one's is, and its joint as a skill."""

    def __init__(self, **settings: Any) -> None:
        self.bench: Bench = bench(**settings)
        self.motion = JointRunner(self.bench.joint, lambda: None)
        self.told: list[tuple[float | None, str]] = []

    async def serve(self) -> None:
        while True:
            self.bench.wheels.exchange(STANDSTILL)
            await pass_time(0.1)

    def play(self, deeds: Any) -> Any:
        async def whole() -> Any:
            serving = asyncio.create_task(self.serve())
            try:
                return await deeds
            finally:
                serving.cancel()

        return run_virtually(whole(), self.bench.time)

    async def perform(self, what: Call) -> dict[str, Any]:
        return dict(await self.motion.perform(what, lambda share, text: self.told.append((share, text))))


def test_it_is_done_when_it_is_there() -> None:
    scene = Scene()
    results = scene.play(scene.perform(call(angle_deg=45.0)))
    assert results["angle_deg"] == pytest.approx(45.0, abs=2.0)
    assert scene.told == [(1.0, "")]


def test_what_is_in_its_way_is_a_failure_or_what_it_was_to_grip() -> None:
    scene = Scene(stopped="release")
    scene.bench.motor.obstacle_ticks = 2300
    with pytest.raises(FailedError, match="something is in the way"):
        scene.play(scene.perform(call(angle_deg=45.0)))
    scene.bench.run(0.2)
    assert scene.bench.item("torque_enable") == 0
    gripper = Scene(blocked="done", effort=0.4)
    gripper.bench.motor.obstacle_ticks = 2300
    results = gripper.play(gripper.perform(call(angle_deg=45.0)))
    assert results == {"angle_deg": pytest.approx(22.1, abs=0.5), "load": pytest.approx(0.4, abs=0.01)}
    assert gripper.bench.item("torque_enable") == 1


@pytest.mark.parametrize("wrong", [{"angle_deg": 400.0}, {"angle_deg": "wide"}, {}])
def test_a_wrong_angle_moves_nothing(wrong: dict[str, float | str]) -> None:
    scene = Scene()
    with pytest.raises(FailedError):
        scene.play(scene.perform(call(**wrong)))
    assert scene.bench.item("torque_enable") == 0


def test_it_is_held_and_goes_on_and_a_cancel_stops_it() -> None:
    scene = Scene()

    async def deeds() -> None:
        task = asyncio.create_task(scene.perform(call(angle_deg=80.0)))
        await pass_time(0.4)
        scene.motion.hold(True)
        await pass_time(1.0)
        place = scene.bench.item("present_position")
        await pass_time(3.0)
        assert abs(scene.bench.item("present_position") - place) < 25  # of 4096 in a turn
        assert not task.done()
        scene.motion.hold(False)
        await pass_time(0.2)
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
        await pass_time(1.0)
        place = scene.bench.item("present_position")
        await pass_time(2.0)
        assert abs(scene.bench.item("present_position") - place) < 25  # of 4096 in a turn
        assert place < 2048 + 70 / 0.088

    scene.play(deeds())


BOARD = """
skills:
  grip: {parameters: {angle_deg: {least: -20, most: 80}}, limit_s: 15}
tasks:
- {number: 1, name: water the green rose, actions: [{grip: 60}, {grip: 0}]}
"""


async def test_a_daemon_offers_its_joints_and_a_stop_ends_them(tmp_path: Path) -> None:
    skills = tmp_path / "skills.yaml"
    skills.write_text("name: Rob\nskills: {grip: {joint: {id: 3}}}\n")
    settings = load_settings(skills, {"state_dir": str(tmp_path / "state")}, environment={})
    model = bench(opened=False)
    service = JointService(settings, model.time)
    model.wheels = DynamixelWheels("virtual", clock=model.time, make_port=model.make_port, joints=service.joints)
    model.wheels.open()

    async def live(robot: ControlBench) -> None:
        await robot.live()
        robot.bench.records += robot.records
        model.time.advance(BLOCK_S)
        if robot.body.skills.under_way is not None:
            await asyncio.sleep(0.001)  # the motion looks at the joint by the real clock

    robot = ControlBench(tmp_path, BOARD)
    robot.wheels = model.wheels  # type: ignore[assignment]
    await robot.open()
    try:
        assert robot.body.wheels is not None
        service.begin(robot.body.wheels, model.wheels)
        while not any(isinstance(record, PerformedRecord) for record in robot.bench.records):
            assert robot.bench.robot.now < 300.0
            await live(robot)
        said = [record.text for record in robot.bench.records if isinstance(record, SaidRecord)]
        assert any("I will complete task one" in text or "i will complete" in text for text in said)
        robot.bench.robot.coordination.stop(robot.bench.robot.now)
        await live(robot)
        assert robot.bench.robot.coordination.state is State.STOPPED
    finally:
        await service.close()
        await robot.close()
    assert model.item("operating_mode") == 3
    assert abs(model.item("present_position") - 2048) < 30
