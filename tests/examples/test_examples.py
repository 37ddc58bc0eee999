"""Each example is sound, and runs: its files, its programs, and the greenhouse as a whole."""

from __future__ import annotations

import asyncio
import importlib
import os
import sys
from pathlib import Path

import pytest

from hil_fakes.bench import Bench, BenchPlan
from hil_fakes.skills import FakePump, Pump, Tank
from hvcpd.assembly.make import make_phrasebook, make_sound
from hvcpd.config.settings import Settings, load_settings
from hvcpd.config.task_doubts import doubts
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import TaskDefinition, TaskRepository
from hvcpd.reporting.events import Said, Skill, Summary, Switched
from hvcpd.reporting.html import page
from hvcpd.skills.checks import faults
from hvcpd.skills.life import Call
from hvcpd.skills.objects import Result, SkillCall
from hvcpd.skills.runners import FailedError, Program

FOLDER = Path(__file__).parents[2] / "examples"
EXAMPLES = sorted(path.parent for path in FOLDER.glob("*/tasks.yaml"))


def read(example: Path) -> tuple[Settings, TaskRepository]:
    settings = load_settings(example / "hvcpd.yaml", environment={})
    return settings, load_tasks(settings.tasks)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_it_is_sound(example: Path) -> None:
    settings, tasks = read(example)
    assert list(faults(settings.skills, tasks, settings.wheels)) == []
    assert doubts(tasks) == ()
    make_phrasebook(settings.names, settings.teams, tasks)


def test_in_the_greenhouse_a_tank_runs_empty_and_the_robot_says_so(units: Path) -> None:
    _, tasks = read(FOLDER / "greenhouse")
    here = tuple(TaskDefinition(t.number, t.name, None, t.actions[1:]) for t in tasks.tasks[:2])
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
    assert summary.lost == 1
    assert summary.virtual_s < 200.0  # it ends when nobody can do what is left
    switched = [e for e in record.events if isinstance(e, Switched)]
    assert [e.on for e in switched] == [True, False, True, False]
    assert switched[1].at_s - switched[0].at_s == pytest.approx(4.0, abs=0.1)  # 0.2 l, or as much as is left
    report = page(record)
    assert report.count('class="switched"') == 2
    assert 'data-head="Poured (l)">0.2<' in report
    assert "failed, the tank is empty" in report
    assert 'class="skill failed"' in report


def test_the_camera_takes_a_picture_or_says_what_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings, _ = read(FOLDER / "camera")
    camera = Program(settings.skills["photograph"].run)
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


def test_the_gripper_is_moved_or_says_that_it_is_stuck(monkeypatch: pytest.MonkeyPatch) -> None:
    settings, _ = read(FOLDER / "library")
    gripper = Program(settings.skills["grip"].run, settings.skills["grip"].safe)

    async def grip() -> dict[str, object]:
        call = Call(1, 1, "grip", (("angle_deg", 60.0),), 15.0)
        return dict(await gripper.perform(call, lambda _share, _text: None))

    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=":")  # whose Python has gpiozero
    monkeypatch.setenv("GPIOZERO_PIN_FACTORY", "mock")
    monkeypatch.setenv("GPIOZERO_MOCK_PIN_CLASS", "mockpwmpin")
    assert asyncio.run(grip()) == {"angle_deg": 60.0}
    monkeypatch.setenv("GPIOZERO_PIN_FACTORY", "no-such-factory")
    with pytest.raises(FailedError, match="the gripper is stuck"):
        asyncio.run(grip())


def test_the_template_of_a_python_object_waves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(FOLDER / "wave"))
    module = importlib.import_module("hvcpd_wave")
    monkeypatch.setattr(module, "SWING_S", 0.0)
    told: list[float | None] = []
    call = SkillCall("wave", 1, {"times": 3.0}, lambda share, _text: told.append(share))
    assert asyncio.run(module.Wave().perform(call)) == Result(results={"waves": 3})
    assert told == [1 / 3, 2 / 3, 1.0]
