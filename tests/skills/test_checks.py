"""What is wrong with a robot's skills is told before any device opens: once, with its line and its remedy."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from hil_fakes.pins import FOLDER_VARIABLE
from hvcpd.config.settings_file import load_with_sources
from hvcpd.config.task_file import load_tasks
from hvcpd.control.cli import main
from hvcpd.control.live.skills import serve
from hvcpd.errors import DeviceError
from hvcpd.skills.checks import faults

BOARD = """
skills:
  pour: {parameters: {litres: {least: 0.1, most: 2}, what: {type: text, default: rose}}, failures: [the tank is empty]}
  grip: {parameters: {angle_deg: {least: -20, most: 60}, free: {default: 0}}}
tasks:
- {number: 1, name: water the green rose, actions: [{pour: {litres: 0.5}}]}
"""


def told(folder: Path, *skills: str, more: str = "") -> list[str]:
    (folder / "tasks.yaml").write_text(BOARD)
    lines = "".join(f"  {skill}\n" for skill in skills)
    (folder / "hvcpd.yaml").write_text(f"name: Rob\ntasks: tasks.yaml\n{more}skills:\n{lines}")
    loaded = load_with_sources(folder / "hvcpd.yaml", environment={})
    found = faults(loaded.settings, load_tasks(loaded.settings.tasks), skill_places=loaded.skill_places)
    return [text.removeprefix(f"{folder}/") for text in found]


@pytest.mark.parametrize(
    ("skill", "text"),
    [
        ("por: {run: [sh]}", "skills.por: the task file declares no such skill; did you mean 'pour'?"),
        ('pour: {run: [sh, "{litre}"]}', "skills.pour: it has no parameter 'litre'; did you mean 'litres'?"),
        ("pour: {run: [no-such-program]}", "skills.pour: there is no program 'no-such-program'; install it, or give"),
        ("pour: {run: [./hvcpd.yaml]}", "hvcpd.yaml is not executable; run `chmod +x` on it"),
        ("pour: {gpio: {pin: 17, amount: what}}", "skills.pour.gpio: amount: 'what' is not one of its numbers"),
        ("pour: {gpio: {pin: 17, amount: litres, empty_pin: 17}}", "skills.pour.gpio: skill 'pour' has pin 17 already"),
        (
            "pour: {gpio: {pin: 17, amount: litres, per_s: 0.008}}",
            "task 1 needs 62.5 s at `per_s: 0.008`, and the skill's limit_s is 60; raise one of the two",
        ),
        (
            "pour: {gpio: {pin: 17, amount: litres, empty_pin: 27, empty_reason: the tank is out}}",
            "empty_reason: 'the tank is out' is none of the skill's `failures` in the task file; did you mean 'the",
        ),
        ("grip: {joint: {id: 2}}", "skills.grip.joint: the right wheel has ID 2 already; give each motor its own"),
        (
            "grip: {joint: {id: 3, most_deg: 50}}",
            "the task file allows -20 to 60 for 'angle_deg', and this joint turns",
        ),
        ("grip: {joint: {id: 3, angle: free}}", "the task file allows -inf to inf for 'free', and this joint turns"),
        (
            'grip: {ros: {action: grip, type: a_msgs/Grip, goal: {a: [{b: "{angle}"}]}}}',
            "skills.grip: it has no parameter 'angle'; did you mean 'angle_deg'?",
        ),
    ],
)
def test_each_fault_has_its_line_and_its_remedy(tmp_path: Path, skill: str, text: str) -> None:
    (found,) = told(tmp_path, skill)
    assert found.startswith("hvcpd.yaml:4: ")
    assert text in found


def test_joints_need_the_wheels_bus(tmp_path: Path) -> None:
    (found,) = told(tmp_path, "grip: {joint: {id: 3}}", more="wheels: {driver: none}\n")
    assert found.endswith("it is on the wheels' bus, and wheels.driver is none; set that to dynamixel or auto")


def test_joints_need_the_control_socket(tmp_path: Path) -> None:
    (found,) = told(tmp_path, "grip: {joint: {id: 3}}", more="control: {enabled: false}\n")
    assert found.endswith("skills.grip.joint: it is offered by the control socket; set control.enabled to true")


def test_what_is_right_is_not_told(tmp_path: Path) -> None:
    pour = "pour: {gpio: {pin: 17, amount: litres, empty_pin: 27}}"
    assert told(tmp_path, pour, "grip: {joint: {id: 3}}") == []


@pytest.mark.parametrize(
    ("joint", "text"),
    [
        ("{id: 3, least_deg: 20, most_deg: 10}", "least_deg 20 is not below most_deg 10"),
        ("{id: 3, zero_deg: 30}", "from zero_deg 30 the motor would leave its one turn"),
        ("{id: 300}", "253"),
    ],
)
def test_a_joint_that_cannot_be_is_told_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], joint: str, text: str
) -> None:
    (tmp_path / "tasks.yaml").write_text(BOARD)
    (tmp_path / "hvcpd.yaml").write_text(f"name: Rob\ntasks: tasks.yaml\nskills:\n  grip: {{joint: {joint}}}\n")
    assert main(["skills", "--check", "--config", str(tmp_path / "hvcpd.yaml")]) == 2
    told = capsys.readouterr().err
    assert "hvcpd.yaml:" in told
    assert text in told or "252" in told


def test_the_stop_button_keeps_its_pin(tmp_path: Path) -> None:
    (text,) = told(tmp_path, "pour: {gpio: {pin: 17, amount: litres}}", more="stop_button: {pin: 17}\n")
    assert text == "hvcpd.yaml:5: skills.pour.gpio: the stop button has pin 17 already; give each its own"


def test_the_variable_of_the_fake_pins_is_no_setting(tmp_path: Path) -> None:
    """The documented command ended at once: what begins with HVCPD_ is a setting, and there is none of that name."""
    (tmp_path / "hvcpd.yaml").write_text("name: Rob\n")
    load_with_sources(tmp_path / "hvcpd.yaml", environment={FOLDER_VARIABLE: "/tmp/pins"})


def test_a_python_skill_that_cannot_be_imported_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It passed the check, and then each of its calls failed with "its process has ended"."""
    package = tmp_path / "packages" / "grip-1.dist-info"
    package.mkdir(parents=True)
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: grip\nVersion: 1\n")
    (package / "entry_points.txt").write_text("[hvcpd.skills]\ngrip = nowhere_to_be_found:Grip\n")
    monkeypatch.syspath_prepend(str(package.parent))
    monkeypatch.setenv("PYTHONPATH", str(package.parent))
    (tmp_path / "tasks.yaml").write_text(BOARD)
    (tmp_path / "hvcpd.yaml").write_text("name: Rob\ntasks: tasks.yaml\n")
    assert main(["skills", "--check", "--config", str(tmp_path / "hvcpd.yaml")]) == 2
    told = capsys.readouterr().err
    assert "skill 'grip': ModuleNotFoundError: No module named 'nowhere_to_be_found'; fix the package" in told


def test_the_check_names_what_carries_each_skill_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "tasks.yaml").write_text(BOARD)
    (tmp_path / "hvcpd.yaml").write_text("name: Rob\ntasks: tasks.yaml\nskills:\n  grip: {run: [echo, grip]}\n")
    assert main(["skills", "--check", "--config", str(tmp_path / "hvcpd.yaml")]) == 0
    assert capsys.readouterr().out == "ok  grip: by the program echo\n"


def test_a_script_without_its_interpreter_is_told(tmp_path: Path) -> None:
    """It passed the check, and then each of its calls failed with "Exec format error"."""
    script = tmp_path / "pour.sh"
    script.write_text("echo pour\n")
    script.chmod(0o755)
    (found,) = told(tmp_path, "pour: {run: [./pour.sh]}")
    assert found.endswith("pour.sh does not say what runs it; begin its first line with `#!`, for example `#!/bin/sh`")
    script.write_text("#!/bin/sh\necho pour\n")
    assert told(tmp_path, "pour: {run: [./pour.sh]}") == []


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (b"#!/bin/sh\r\necho pour\r\n", "has the line ends of Windows; run `sed -i 's/\\r$//'` on it"),
        (b"#!/usr/bin/env python3\r\n", "has the line ends of Windows; run `sed -i 's/\\r$//'` on it"),
        (b"#! /nowhere/sh -e\n", "is to be run by /nowhere/sh, which does not exist; correct its first line"),
    ],
)
def test_a_script_whose_interpreter_cannot_be_found_is_told(text: bytes, fault: str, tmp_path: Path) -> None:
    """It passed the check, and then each of its calls failed with "No such file or directory"."""
    script = tmp_path / "pour.sh"
    script.write_bytes(text)
    script.chmod(0o755)
    (found,) = told(tmp_path, "pour: {run: [./pour.sh]}")
    assert found.endswith(f"pour.sh {fault}")


def test_a_pin_that_cannot_be_had_is_told_with_the_line_of_its_skill(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GPIOZERO_PIN_FACTORY", "none")
    told(tmp_path, "pour: {gpio: {pin: 17, amount: litres}}")
    loaded = load_with_sources(tmp_path / "hvcpd.yaml", environment={})
    tasks = load_tasks(loaded.settings.tasks)
    with pytest.raises(DeviceError, match=r"hvcpd\.yaml:4: skills\.pour: pin 17 cannot be used: "):
        asyncio.run(serve(tmp_path / "rob.sock", loaded.settings, tasks, loaded.skill_places))


@pytest.mark.parametrize(
    ("example", "status", "said"),
    [
        ("library", 0, "ok  grip: by joint 3, which hvcpd itself moves"),
        ("tidy_up", 0, "ok  grip: by the action gripper_controller/gripper_cmd, through `hvcpctl ros`"),
        ("wave", 2, "there is no skill to offer here: name wave under `skills:` in the settings"),
    ],
)
def test_who_has_a_skill_is_told(example: str, status: int, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    config = str(Path(__file__).parents[2] / "examples" / example / "hvcpd.yaml")
    assert main(["skills", "--check", "--config", config]) == status
    assert said in "".join(capsys.readouterr())
    assert main(["skills", "--config", config]) == 2
    assert "there is no skill to offer here: " in capsys.readouterr().err


def test_a_pin_that_cannot_be_is_found_by_the_check(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if list(Path("/dev").glob("gpiochip*")):
        pytest.skip("this computer has pins")
    monkeypatch.delenv("GPIOZERO_PIN_FACTORY", raising=False)
    config = str(Path(__file__).parents[2] / "examples" / "greenhouse" / "hvcpd.yaml")
    assert main(["skills", "--check", "--config", config]) == 2
    assert f"{config}:7: skills.pour.gpio: pin 17 cannot be used: this computer has no pins" in capsys.readouterr().err
    monkeypatch.setenv("GPIOZERO_PIN_FACTORY", "files")
    assert main(["skills", "--check", "--config", config]) == 0
