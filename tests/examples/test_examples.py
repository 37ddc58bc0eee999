"""Each example is sound, and runs: its files, its programs, and the greenhouse as a whole."""

from __future__ import annotations

import asyncio
import json
import os
import re
from dataclasses import asdict, replace
from functools import partial
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import SimpleNamespace

import pytest

from hil_fakes.bench import Bench, BenchPlan
from hil_fakes.ros_actions import ROS2_SUCCEEDED, RclpyServer
from hil_fakes.skills import FakeHost, FakePump, Pump, Tank, usual_devices
from hil_fakes.virtual_robot import PERIOD_S, VirtualRobot
from hvcpd.assembly.sound import make_phrasebook, make_sound
from hvcpd.config.settings import Settings
from hvcpd.config.settings_file import load_settings
from hvcpd.config.task_doubts import doubts
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import TaskDefinition, TaskRepository, Use
from hvcpd.control.cli import main
from hvcpd.hardware.navigator import Navigator
from hvcpd.ports import STANDSTILL, Pose
from hvcpd.reporting.events import Said, Skill, Summary, Switched
from hvcpd.reporting.html import page
from hvcpd.robot.performer import Outcome, Performer
from hvcpd.robot.records import SkillRecord
from hvcpd.ros.action_rclpy import RclpyAction
from hvcpd.ros.bridge import Ask, Bridge
from hvcpd.ros.command import wanted_by
from hvcpd.ros.parameters import Parameters
from hvcpd.ros.port import Listener
from hvcpd.ros.skills import Act, Skills, fill_message, values_of
from hvcpd.skills.checks import faults
from hvcpd.skills.life import Call
from hvcpd.skills.objects import Result, SkillCall
from hvcpd.skills.runners import FailedError, ProgramRunner

FOLDER = Path(__file__).parents[2] / "examples"
EXAMPLES = sorted(path.parent for path in FOLDER.glob("*/tasks.yaml"))


def read(example: Path) -> tuple[Settings, TaskRepository]:
    settings = load_settings(example / "hvcpd.yaml", environment={})
    return settings, load_tasks(settings.tasks)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_it_is_sound(example: Path) -> None:
    settings, tasks = read(example)
    assert list(faults(settings, tasks)) == []
    assert doubts(tasks) == ()
    make_phrasebook(settings.names, settings.teams, tasks)


def test_in_the_greenhouse_a_tank_runs_empty_and_the_robot_says_so(units: Path) -> None:
    _, tasks = read(FOLDER / "greenhouse")
    here = tuple(TaskDefinition(t.number, t.name, None, t.actions[1:]) for t in tasks.tasks)
    here = (*here[:2], replace(here[2], after=frozenset({1, 2})))
    pump = FakePump(Pump(Tank(0.3)), "litres", 0.05)
    plan = BenchPlan(("Rob",), TaskRepository(here, skills=tasks.skills), skills={"Rob": {"pour": pump}}, limit_s=200)
    record = Bench(plan, make_sound(cache_folder=units)).run()
    ends = [e for e in record.events if isinstance(e, Skill) and e.state in ("finished", "failed")]
    assert [e.state for e in ends] == ["finished", "failed"]
    assert (round(pump.pump.poured, 6), pump.is_on) == (0.3, False)
    assert sum(float(e.results["litres"]) for e in ends) == pytest.approx(0.3)
    said = [e.text for e in record.events if isinstance(e, Said)]
    assert any(text.endswith(f"task {number} failed, the tank is empty") for text in said for number in ("one", "two"))
    summary = next(e for e in record.events if isinstance(e, Summary))
    assert summary.lost == 2
    assert summary.virtual_s < 200.0  # it ends when nobody can do what is left
    switched = [e for e in record.events if isinstance(e, Switched)]
    assert [e.on for e in switched] == [True, False, True, False]
    assert switched[1].at_s - switched[0].at_s == pytest.approx(4.0, abs=0.1)  # 0.2 l, or as much as is left
    report = page(record)
    assert report.count('class="switched"') == 2
    assert 'data-head="Poured (l)">0.2<' in report
    assert "failed, the tank is empty" in report
    assert 'class="skill failed"' in report


def test_who_has_too_little_water_says_so_and_another_one_takes_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The page promises it, and with equal tanks it came to depend on who claimed what."""
    settings, tasks = tmp_path / "hvcpd.yaml", tmp_path / "tasks.yaml"
    settings.write_text((FOLDER / "greenhouse" / "hvcpd.yaml").read_text())
    all_three = (FOLDER / "greenhouse" / "tasks.yaml").read_text()
    here, _, _ = re.sub(" +place: .*\n|go to place, ", "", all_three).partition("  - number: 3")
    tasks.write_text(here)
    words = ["simulate", "--config", str(settings), "--tank", "Bot=0.04", "--room", "open", "--json"]
    assert main(words) == 0
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    calls = [(event["robot"], event["state"]) for event in events if event["event"] == "skill"]
    assert ("Bot", "failed") in calls
    assert calls.count(("Rob", "finished")) == 2


def test_the_camera_takes_a_picture_or_says_what_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings, _ = read(FOLDER / "camera")
    camera = ProgramRunner(settings.skills["photograph"].run)
    monkeypatch.setenv("PICTURES", str(tmp_path / "pictures"))
    monkeypatch.setenv("CAMERA", "touch --")
    told: list[tuple[float | None, str]] = []

    async def take() -> dict[str, object]:
        call = Call(1, 1, "photograph", (("what", "door"),), 20.0)
        return dict(await camera.perform(call, lambda share, text: told.append((share, text))))

    assert asyncio.run(take()) == {"picture": "door.jpg"}
    assert told == [(0.5, "the shutter is open")]
    assert os.listdir(tmp_path / "pictures") == ["door.jpg"]  # noqa: PTH208
    monkeypatch.setenv("CAMERA", "no-such-camera -o")
    with pytest.raises(FailedError, match="the camera is missing"):
        asyncio.run(take())


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_all_its_tasks_can_be_done_on_the_fakes(example: Path) -> None:
    """One robot does them one after the other, without a word."""
    settings, tasks = read(example)
    robot, performer, host = (
        VirtualRobot(seed=1),
        Performer(Navigator(), Pose(0.0, 0.0)),
        FakeHost(usual_devices(tasks, settings.skills)),
    )
    robot.wheels.open()
    performer.offer(frozenset(host.devices))
    for task in tasks.tasks:
        performer.begin(task.actions, task.number)
        outcome, wheels, until_s = Outcome.GOING_ON, STANDSTILL, robot.time.now_s + 300.0
        while outcome is Outcome.GOING_ON:
            assert robot.time.now_s < until_s
            reading = robot.cycle(wheels, PERIOD_S)
            host.live(robot.time.now_s, performer.tell)
            progress = performer.step(robot.odometry.pose, robot.time.now_s, reading)
            host.take(performer.take_orders(), robot.time.now_s)
            outcome, wheels = progress.outcome, progress.wheels
        assert outcome is Outcome.DONE, task.name
    records = [record for record in performer.take_records(0.0) if isinstance(record, SkillRecord)]
    calls = {record.call.number: (record.call, record.report) for record in records}
    assert len(calls) == sum(isinstance(action, Use) for task in tasks.tasks for action in task.actions)
    if example.name == "library":
        assert [dict(report.results) for _, report in calls.values()] == [
            {"angle_deg": 40.0, "load": 0.4},
            {"angle_deg": 0.0, "load": 0.0},
        ]


def test_tidying_up_asks_the_gripper_of_ros_2_and_tells_what_it_did() -> None:
    settings, _ = read(FOLDER / "tidy_up")
    wanted = wanted_by([{"key": "skills", "value": {name: asdict(skill) for name, skill in settings.skills.items()}}])
    bridge, gripper, told = Bridge(False, Parameters(), Skills(wanted.actions)), RclpyServer(), []
    client = RclpyAction(
        "gripper",
        gripper,
        GripperGoal,
        Listener(
            lambda number, feedback: bridge.action_fed_back(number, values_of(feedback), 1.0),
            lambda number, reason, result: bridge.action_ended(number, reason or None, values_of(result)),
        ),
        "the gripper",
        lambda happening: happening(),
    )
    call = {"event": "perform", "call": 1, "task": 1, "skill": "grip", "arguments": {"width_m": 0.03}, "limit_s": 20.0}
    bridge.from_daemon(call, 0.0, 0.0)
    for output in bridge.outputs():
        if isinstance(output, Act):
            client.ask(output.number, partial(fill_message, fields=output.fields), 0.0)
    assert (gripper.asked[0].goal.command.position, gripper.asked[0].goal.command.max_effort) == (0.03, 10.0)
    gripper.asked[0].accept().end(ROS2_SUCCEEDED, position=0.031, stalled=True)
    told = [(each.command, dict(each.arguments)) for each in bridge.outputs() if isinstance(each, Ask)]
    assert told == [("done", {"call": 1, "results": {"position": 0.031, "stalled": 1.0}})]


class GripperGoal:
    """As control_msgs/action/GripperCommand has it."""

    def __init__(self) -> None:
        self.command = SimpleNamespace(position=0.0, max_effort=0.0)


def test_the_template_of_a_python_object_waves() -> None:
    spec = spec_from_file_location("hvcpd_wave", FOLDER / "wave" / "hvcpd_wave.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    told: list[float | None] = []
    call = SkillCall("wave", 1, {"times": 3.0}, lambda share, _text: told.append(share))
    assert asyncio.run(module.Wave(swing_s=0.0).perform(call)) == Result(results={"waves": 3})
    assert told == [1 / 3, 2 / 3, 1.0]
