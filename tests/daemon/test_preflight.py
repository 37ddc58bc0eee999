"""What is looked for before anything opens."""

from __future__ import annotations

import os
from collections.abc import Callable
from datetime import date
from pathlib import Path

import pytest

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hvcpd.assembly.plan import MemoryPlan
from hvcpd.assembly.sound import make_sound
from hvcpd.config.quiet_hours import CLOCK_SET_S, QuietSettings
from hvcpd.config.settings import Settings, SpeechSettings, WheelSettings
from hvcpd.config.skill_settings import StopButtonSettings
from hvcpd.coordination.actions import Speech
from hvcpd.daemon.devices import Devices
from hvcpd.daemon.preflight import (
    examine,
    find_memory,
    find_port,
    find_quiet_hours,
    find_revoked,
    find_stop,
    find_stop_button,
)
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.errors import EX_CANTCREAT, EX_OK, EX_UNAVAILABLE, ConfigError
from hvcpd.hardware.groups import group_of
from hvcpd.memory.latch import Latched, Permit, StopLatch
from hvcpd.robot.own_voice import Acoustics
from hvcpd.security.keyring import KeyFile, fresh_entry
from hvcpd.synthesis.acoustic_net import WEIGHTS
from hvcpd.synthesis.likeness import name_fault


def test_a_robot_that_its_own_key_file_revokes_is_told() -> None:
    keys = KeyFile((fresh_entry(date(2026, 11, 29)),)).with_revoked("zoe")
    (finding,) = find_revoked("Zoe", keys)
    assert finding.doubtful
    assert "Zoe, is revoked" in finding.text
    assert not list(find_revoked("Rob", keys))


def test_a_fake_bus_is_a_port_like_any_other(tmp_path: Path) -> None:
    with FakeBus(turtlebot3_pair()) as bus:
        assert find_port(WheelSettings(port=bus.path), tmp_path).exit_status == EX_OK


def test_a_missing_port_names_those_there_are(tmp_path: Path) -> None:
    (tmp_path / "ttyACM0").touch()
    (tmp_path / "ttyUSB7").touch()
    finding = find_port(WheelSettings(port=str(tmp_path / "ttyUSB0")), tmp_path)
    assert finding.exit_status == EX_UNAVAILABLE
    assert f"set wheels.port to one of {tmp_path / 'ttyACM0'}, {tmp_path / 'ttyUSB7'}" in finding.text


def test_a_missing_port_without_any_other(tmp_path: Path) -> None:
    finding = find_port(WheelSettings(port=str(tmp_path / "ttyUSB0")), tmp_path)
    assert "plug in the motors' adapter" in finding.text


def test_each_port_is_named_once_by_the_name_that_lasts(tmp_path: Path) -> None:
    (tmp_path / "ttyACM0").touch()
    (tmp_path / "serial" / "by-id").mkdir(parents=True)
    (tmp_path / "serial" / "by-id" / "usb-OpenCR").symlink_to(tmp_path / "ttyACM0")
    assert find_port(WheelSettings(), tmp_path).text == f"will look at {tmp_path}/serial/by-id/usb-OpenCR"


def test_wheels_that_ros_has_need_no_port(tmp_path: Path) -> None:
    finding = find_port(WheelSettings(driver="ros", ros_mode="goal"), tmp_path)
    assert finding.exit_status == EX_OK
    assert "hvcpctl ros" in finding.text


def test_a_file_is_no_port(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert "is no serial port" in find_port(WheelSettings(port=str(tmp_path / "file")), tmp_path).text


def test_a_stop_button_without_pins_is_found_before_anything_opens(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("GPIOZERO_PIN_FACTORY", raising=False)
    assert not [*find_stop_button(StopButtonSettings(), tmp_path)]
    (finding,) = find_stop_button(StopButtonSettings(17), tmp_path)
    assert finding.exit_status == EX_UNAVAILABLE
    assert "pin 17 cannot be used: this computer has no pins" in finding.text
    (tmp_path / "gpiochip0").touch()
    (finding,) = find_stop_button(StopButtonSettings(17), tmp_path)
    assert (finding.exit_status, finding.text) == (EX_OK, "pin 17, pressed while its switch is open")


def may_only(mode: int) -> Callable[[Path, int], bool]:
    """What `os.access` says to somebody who may do only this (tests may run as the superuser, who may do all)."""
    return lambda _, wanted: wanted & ~mode == 0


def test_a_port_without_permission_names_the_group(tmp_path: Path) -> None:
    with FakeBus(turtlebot3_pair()) as bus:
        assert find_port(WheelSettings(port=bus.path), tmp_path, may_only(os.R_OK | os.W_OK)).exit_status == EX_OK
        finding = find_port(WheelSettings(port=bus.path), tmp_path, may_only(os.R_OK))
        group = group_of(bus.path)
    assert finding.exit_status == EX_UNAVAILABLE
    assert f"usermod -aG {group}" in finding.text


def test_quiet_hours_need_a_clock() -> None:
    night = QuietSettings("22:00-07:00")
    assert not list(find_quiet_hours(Settings("Rob"), CLOCK_SET_S))
    (kept,) = find_quiet_hours(Settings("Rob", quiet=night), CLOCK_SET_S)
    assert (kept.ok, kept.doubtful) == (True, False)
    assert "10 dB softer" in kept.text
    (never,) = find_quiet_hours(Settings("Rob", quiet=night, clock=False), CLOCK_SET_S)
    assert (never.ok, never.doubtful) == (True, True)
    assert "no clock" in never.text
    (unset,) = find_quiet_hours(Settings("Rob", quiet=night), CLOCK_SET_S - 1.0)
    assert (unset.ok, unset.doubtful) == (True, True)
    assert "never set" in unset.text


def test_memory_that_is_there_or_can_be_made(tmp_path: Path) -> None:
    assert find_memory(tmp_path).exit_status == EX_OK
    finding = find_memory(tmp_path / "a" / "b")
    assert finding.exit_status == EX_OK
    assert "will be made" in finding.text
    assert not (tmp_path / "a").exists()


def test_memory_below_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert find_memory(tmp_path / "file" / "state").exit_status == EX_CANTCREAT


@pytest.mark.parametrize(("line", "doubtful"), [(b"fre", True), (b"", True), (Latched(Permit.STOPPED, 7).line, False)])
def test_a_latch_that_keeps_the_robot_stopped_is_told(line: bytes, doubtful: bool, tmp_path: Path) -> None:
    """`--check` said that all was well, and then the robot stood."""
    (tmp_path / "rob.latch").write_bytes(line)
    preflight = examine(Settings(name="Rob", names=("Rob", "Bot"), state_dir=tmp_path), Devices())
    found = next(finding for finding in preflight.findings if finding.subject == "stop")
    assert (found.ok, found.doubtful) == (True, doubtful)
    assert str(tmp_path / "rob.latch") in found.text
    assert found.text.endswith('once it runs, say "resume", or: hvcpctl resume')


def test_a_latch_that_is_missing_beside_a_memory_is_told(tmp_path: Path) -> None:
    latch, memory = StopLatch(tmp_path / "rob.latch"), tmp_path / "rob.sqlite3"
    assert not list(find_stop(latch, memory))
    memory.touch()
    assert [finding.doubtful for finding in find_stop(latch, memory)] == [True]
    latch.write(Latched(Permit.FREE, 7))
    latch.close()
    assert not list(find_stop(latch, memory))


def test_memory_on_a_disk_that_is_not_mounted(tmp_path: Path) -> None:
    """It was to be made, and then the daemon failed for a "File exists"."""
    (tmp_path / "state").symlink_to(tmp_path / "usb" / "state")
    finding = find_memory(tmp_path / "state")
    assert finding.exit_status == EX_CANTCREAT
    assert "is a link to nothing; mount its disk" in finding.text


def test_memory_in_a_read_only_directory(tmp_path: Path) -> None:
    assert "cannot be written" in find_memory(tmp_path, may_only(os.R_OK | os.X_OK)).text
    finding = find_memory(tmp_path / "state", may_only(os.R_OK | os.X_OK))
    assert finding.exit_status == EX_CANTCREAT
    assert f"cannot be made in {tmp_path}" in finding.text


def wiring(tmp_path: Path, **more: object) -> Wiring:
    return wire_up(Settings(**({"name": "Rob", "state_dir": tmp_path} | more)))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("mode", "coordinator", "volunteer"),
    [("volunteer", False, True), ("coordinate", True, False), ("follow", False, False)],
)
def test_the_mode_makes_the_role(mode: str, coordinator: bool, volunteer: bool, tmp_path: Path) -> None:
    role = wiring(tmp_path, mode=mode).plan().role
    assert (role.coordinator, role.volunteer) == (coordinator, volunteer)


def test_the_plan_follows_the_settings(tmp_path: Path) -> None:
    speech = SpeechSettings("slow", 2)
    made = wiring(
        tmp_path, names=("rob", "Bot"), pick="nearest", seed=7, team="garden", teams=("garden",), speech=speech
    )
    plan = made.plan(MemoryPlan({1: ("done", "Bot")}), 0.1)
    assert plan.team.names == ("Rob", "Bot")
    assert plan.seed == 7
    assert plan.role.nearest_first
    assert plan.role.speech == Speech(slowly=True, times=2)
    assert plan.role.team == "garden"
    assert plan.memory.tasks == {1: ("done", "Bot")}
    assert plan.hearing.acoustics == Acoustics(latency_s=0.1)
    assert made.settings.memory_path == tmp_path / "rob.sqlite3"


def test_without_a_seed_every_start_differs(tmp_path: Path) -> None:
    made = wiring(tmp_path)
    assert made.plan().seed != made.plan().seed


def test_names_that_cannot_be_told_from_the_phrasebook() -> None:
    assert name_fault("Stop") is not None
    assert name_fault("Ann") is not None
    assert name_fault("Rob") is None


def test_faults_of_lexicon_and_tasks_are_told_together(tmp_path: Path) -> None:
    (tmp_path / "lexicon.txt").write_text("rob R QQ B\n")
    (tmp_path / "tasks.yaml").write_text("tasks: []\n")
    with pytest.raises(ConfigError) as fault:
        wiring(tmp_path, lexicon=tmp_path / "lexicon.txt", tasks=tmp_path / "tasks.yaml")
    assert "lexicon.txt:1" in str(fault.value)
    assert "tasks.yaml:1" in str(fault.value)


@pytest.mark.parametrize(
    ("folder", "remedy"),
    [("/usr/lib/hvcpd/hvcpd", "sudo apt install ./hvcpd-natural_*_all.deb"), ("/home/rob", "pip install")],
)
def test_natural_voices_without_their_weights_tell_what_to_install(folder: str, remedy: str) -> None:
    with pytest.raises(ConfigError) as error:
        make_sound().made_natural(Path(folder) / "nowhere.npz")
    assert remedy in str(error.value)
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize("data", [b"other weights", WEIGHTS.read_bytes()[:-9]], ids=["other", "cut"])
def test_weights_of_which_the_peers_would_not_know_the_sound_are_refused(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "net.npz").write_bytes(data)
    with pytest.raises(ConfigError, match="damaged or of another version: pip install"):
        make_sound().made_natural(tmp_path / "net.npz")


def test_a_clash_of_the_vocabulary_is_a_fault(tmp_path: Path) -> None:
    (tmp_path / "tasks.yaml").write_text("tasks:\n- {number: 1, name: say again slowly, actions: [{wait: 1}]}\n")
    with pytest.raises(ConfigError, match=r"tasks\.yaml:2: the task 'say again slowly' can be mistaken"):
        wiring(tmp_path, tasks=tmp_path / "tasks.yaml")


def test_a_name_that_clashes_is_told_with_its_setting_and_not_with_the_tasks(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as fault:
        wiring(tmp_path, names=("Rob", "please"))
    assert str(fault.value).startswith("names: 'please' is a word of the phrasebook")
