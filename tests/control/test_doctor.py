"""`hvcpctl doctor` on machines that are well and on those that are not."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from structlog.testing import capture_logs

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.paced import PacedPort
from hvcpd.control.cli import make_parser
from hvcpd.control.doctor.diagnosis import Machine
from hvcpd.control.doctor.doctor import run
from hvcpd.control.doctor.doctor_machine import look_at_service
from hvcpd.control.doctor.doctor_sound import judge
from hvcpd.control.doctor.self_hearing import SelfHearing
from hvcpd.errors import EX_FAILURE
from hvcpd.hardware.acoustics import Echo
from tests.control.echo_room import EchoRoom
from tests.daemon.running import RunningRobot
from tests.hardware.fake_card import FakeCard

GOOD = Echo(0.1, -25.0, 0.4, 40.0)


def options(tmp_path: Path, *more: str) -> argparse.Namespace:
    config = tmp_path / "hvcpd.yaml"
    if not config.exists():
        config.write_text(f"name: Rob\nstate_dir: {tmp_path / 'state'}\nwheels: {{driver: none}}\n")
    return make_parser().parse_args(["doctor", "--config", str(config), "--json", *more])


def machine(tmp_path: Path, systemctl: str | None = None, decoding_s: float = 0.0, **more: Any) -> Machine:
    """A computer, no Raspberry Pi, without a sound card, by whose clock decoding the benchmark's sound, some 9 s, takes
    so long."""
    times = iter([0.0, decoding_s])
    (tmp_path / "dev" / "snd").mkdir(parents=True, exist_ok=True)
    (tmp_path / "temp").write_text("51200\n")

    def command(_command: Sequence[str]) -> str | None:
        return systemctl

    dev, temp, none = (tmp_path / name for name in ("dev", "temp", "none"))
    return Machine(dev, temp, none, none, none, command, cpu_s=lambda: next(times), **more)


def found(capsys: pytest.CaptureFixture[str]) -> dict[str, dict[str, Any]]:
    return {line["subject"]: line for line in map(json.loads, capsys.readouterr().out.splitlines())}


@pytest.mark.slow
def test_a_robot_that_is_well(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(options(tmp_path), EchoRoom().devices, machine(tmp_path)) == 0
    told = found(capsys)
    assert told["loopback"]["grade"] == "ok"
    assert "understood 'Hi, I am Rob, I am free'" in told["loopback"]["text"]
    assert told["noise"]["floor_dbfs"] == pytest.approx(-60.0, abs=0.5)
    assert told["microphone"]["text"].startswith("'USB Headset: Audio (hw:1,0)': 16, 48 kHz")
    assert told["heat"]["text"] == "51 °C"
    assert told["verdict"]["ok"]


def test_a_robot_that_runs_now_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its own talk counted as noise, and its port as in use by some program."""
    with capture_logs(), RunningRobot(tmp_path):
        run(options(tmp_path, "--only", "wheels"))
        assert "Rob runs now, and uses the card and the port: end it" in found(capsys)["hvcpd"]["text"]
    run(options(tmp_path, "--only", "wheels"))
    told = found(capsys)
    assert "hvcpd" not in told
    assert told["verdict"]["text"] == "1 check passed"


def test_a_verdict_on_one_check_is_singular(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    absent = ("--driver", "dynamixel", "--port", str(tmp_path / "absent"))
    assert run(options(tmp_path, "--only", "wheels", *absent)) == EX_FAILURE
    assert found(capsys)["verdict"]["text"] == "1 of 1 check failed; the remedy is above"


@pytest.mark.slow
def test_a_robot_that_does_not_hear_itself_is_told_what_to_look_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(options(tmp_path, "--only", "sound"), EchoRoom(gain=0.0).devices) == 1
    told = found(capsys)
    assert "does not hear itself" in told["loopback"]["text"]
    assert not told["verdict"]["ok"]


@pytest.mark.slow
def test_silent_plays_nothing_and_still_measures_the_noise(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(options(tmp_path, "--only", "sound", "--silent"), EchoRoom(noise_rms=0.02).devices) == 0
    told = found(capsys)
    assert "loopback" not in told
    assert told["noise"]["grade"] == "note"


@pytest.mark.slow
def test_without_any_hardware_it_says_so_in_a_few_lines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    room = EchoRoom(card=FakeCard([]))
    assert run(options(tmp_path, "--only", "sound"), room.devices) == 1
    told = found(capsys)
    assert "there is no microphone on this machine; connect one" in told["microphone"]["text"]
    assert "noise" not in told


@pytest.mark.parametrize(
    ("heard", "subject", "grade"),
    [
        (SelfHearing(-120.0, 0.0, 0), "noise", "wrong"),
        (SelfHearing(-60.0, 0.05, 0), "clipping", "note"),
        (SelfHearing(-60.0, 0.0, 800), "stream", "note"),
        (SelfHearing(-60.0, 0.0, 0, "Hi", GOOD, False), "loopback", "wrong"),
        (SelfHearing(-60.0, 0.0, 0, "Hi", Echo(0.1, -52.0, 0.1, 8.0), True, 0.9), "loopback", "note"),
        (SelfHearing(-60.0, 0.0, 0, "Hi", GOOD, True, 0.9), "loopback", "ok"),
    ],
)
def test_what_was_heard_is_judged(heard: SelfHearing, subject: str, grade: str) -> None:
    assert {diagnosis.subject: diagnosis.grade for diagnosis in judge(heard)}[subject] == grade


@pytest.mark.parametrize(
    ("systemctl", "grade", "part"),
    [
        (None, "ok", "no systemd"),
        ("LoadState=not-found\nActiveState=inactive\n", "note", "not installed"),
        ("LoadState=masked\nActiveState=inactive\n", "note", "is masked"),
        ("LoadState=loaded\nActiveState=active\nSubState=running\nNRestarts=2\n", "ok", "2 restarts"),
        ("LoadState=loaded\nActiveState=active\nSubState=running\nNRestarts=1\n", "ok", "active (running), 1 restart"),
        ("LoadState=loaded\nActiveState=failed\nSubState=failed\nResult=exit-code\n", "wrong", "journalctl -u hvcpd"),
        ("LoadState=loaded\nActiveState=activating\nSubState=auto-restart\nNRestarts=57\n", "wrong", "57 restarts"),
    ],
)
def test_the_service_is_looked_at(tmp_path: Path, systemctl: str | None, grade: str, part: str) -> None:
    told = look_at_service(machine(tmp_path, systemctl))
    assert (told.grade, part in told.text) == (grade, True)
    assert "1 restarts" not in told.text


@pytest.mark.slow
def test_a_slow_processor_a_wrong_clock_and_missing_groups(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ill = machine(tmp_path, decoding_s=30.0, wall_s=lambda: 0.0, may=lambda path, _: "snd" not in str(path))
    (tmp_path / "dev" / "snd" / "pcmC0D0c").touch()
    assert run(options(tmp_path, "--only", "machine"), machine=ill) == 1
    told = found(capsys)
    assert "too slow" in told["processor"]["text"]
    assert told["clock"]["grade"] == "note"
    assert "tasks that recur, quiet hours" in told["clock"]["text"], "it said that only the transcript needs the clock"
    assert "usermod -aG audio" in told["permissions"]["text"]  # never root, who owns it here


def test_the_wheels_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with FakeBus(turtlebot3_pair()) as bus:
        asked = options(tmp_path, "--only", "wheels", "--port", bus.path, "--driver", "auto")
        assert run(asked, make_port=lambda *port: PacedPort(bus, *port)) == 0
    assert "two DYNAMIXEL motors" in found(capsys)["wheels"]["text"]
    with FakeBus([FakeMotor(1, voltage_v=9.5), FakeMotor(5)]) as bus:
        asked = options(tmp_path, "--only", "wheels", "--port", bus.path, "--driver", "auto")
        assert run(asked, make_port=lambda *port: PacedPort(bus, *port)) == 1
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    text = " ".join(line["text"] for line in lines)
    assert "only 9.5 V" in text
    assert "right motor (ID 2): no answer" in text
    assert [line["ok"] for line in lines if line["subject"] == "wheels"] == [False, False]
