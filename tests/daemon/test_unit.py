"""The systemd units: accepted without a word by systemd's own check, closed as far as sound allows, fit for hvcpd."""

from __future__ import annotations

import configparser
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from hvcpd.config.whereabouts import STATE_DIR, SYSTEM_SETTINGS_PATH
from hvcpd.daemon.main_loop import FAREWELL_WALL_S
from hvcpd.errors import EX_CONFIG, EX_USAGE

UNITS = ("hvcpd.service", "hvcpd@.service")
SKILLS = "hvcpd-skills.service"
SYSTEMD = Path(__file__).parents[2] / "systemd"
MOST_EXPOSED = 1.0
"""Of 10, by `systemd-analyze security`."""

needs_systemd = pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed")


def service() -> configparser.SectionProxy:
    parser = configparser.RawConfigParser(strict=False)
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    parser.read_string((SYSTEMD / "hvcpd.service").read_text())
    return parser["Service"]


@pytest.fixture
def units(tmp_path: Path) -> Path:
    """Both units as they are installed, but for the command, which need not be installed here."""
    for name in (*UNITS, SKILLS):
        text = (SYSTEMD / name).read_text()
        for command in ("/usr/bin/hvcpctl", "/usr/bin/hvcpd"):
            text = text.replace(command, str(shutil.which("true")))
        (tmp_path / name).write_text(text)
    return tmp_path


@needs_systemd
@pytest.mark.parametrize("unit", ["hvcpd.service", "hvcpd@rob.service", SKILLS])
def test_systemd_accepts_them_without_a_word(units: Path, unit: str) -> None:
    result = subprocess.run(["systemd-analyze", "verify", units / unit], capture_output=True, text=True, timeout=60)
    assert result.stderr == "", "an unknown key is told there, with exit status 0"
    assert result.returncode == 0


@needs_systemd
def test_systemd_accepts_the_users_own_service_without_a_word(tmp_path: Path) -> None:
    unit = tmp_path / "hvcpd.service"
    unit.write_text((SYSTEMD / "hvcpd-user.service").read_text().replace("/usr/bin/hvcpd", str(shutil.which("true"))))
    (tmp_path / "runtime").mkdir(mode=0o700)
    command = ["systemd-analyze", "--user", "verify", unit]
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path / "runtime"), "HOME": str(tmp_path)}
    result = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment)
    told = [line for line in result.stderr.splitlines() if "hvcpd" in line]
    assert told == []


@needs_systemd
def test_a_key_that_systemd_does_not_know_would_be_noticed(units: Path) -> None:
    unit = units / "hvcpd.service"
    unit.write_text(unit.read_text().replace("WatchdogSec=", "WatchdogSeconds="))
    result = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True, timeout=60)
    assert "WatchdogSeconds" in result.stderr


@needs_systemd
@pytest.mark.parametrize("unit", [*UNITS, SKILLS])
def test_they_are_hardly_exposed(units: Path, unit: str) -> None:
    command = ["systemd-analyze", "security", "--offline=yes", units / unit]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60)
    level = re.search(r"Overall exposure level for \S+: ([0-9.]+)", result.stdout)
    assert level is not None, result.stdout + result.stderr
    assert float(level[1]) <= MOST_EXPOSED


def test_one_of_several_differs_by_its_name_and_its_settings_alone() -> None:
    one, several = ((SYSTEMD / name).read_text().splitlines() for name in UNITS)
    assert len(one) == len(several)
    assert [line for line in several if line not in one] == [
        "Description=Robot %i that coordinates with others by speaking English",
        "ExecStart=/usr/bin/hvcpd --config /etc/hvcpd/%i.yaml",
    ]


def test_it_fits_the_settings_and_the_exit_statuses() -> None:
    unit = service()
    assert f"/var/lib/{unit['StateDirectory']}" == str(STATE_DIR)
    assert f"/etc/{unit['ConfigurationDirectory']}" == str(SYSTEM_SETTINGS_PATH.parent)
    assert unit["RestartPreventExitStatus"].split() == [str(EX_USAGE), str(EX_CONFIG)]


def test_the_farewell_has_its_time() -> None:
    assert float(service()["TimeoutStopSec"]) > FAREWELL_WALL_S


def test_the_user_of_the_unit_is_made_and_may_use_sound_wheels_and_pins() -> None:
    users = [line.split() for line in (SYSTEMD / "hvcpd.sysusers").read_text().splitlines() if line[0] != "#"]
    user = service()["User"]
    assert ["u", user] in [line[:2] for line in users]
    assert {line[2] for line in users if line[:2] == ["m", user]} == {"audio", "dialout", "gpio"}


def test_there_is_no_network() -> None:
    unit = service()
    assert unit["PrivateNetwork"] == "yes"
    assert unit["RestrictAddressFamilies"] == "AF_UNIX"


def test_no_memory_is_written_and_executed() -> None:
    assert service()["MemoryDenyWriteExecute"] == "yes"


def test_udev_accepts_the_rules() -> None:
    if shutil.which("udevadm") is None:
        pytest.skip("udevadm is not installed")
    command = ["udevadm", "verify", SYSTEMD / "60-hvcpd.rules"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60)
    if "verify" in result.stderr and result.returncode != 0 and "60-hvcpd" not in result.stderr + result.stdout:
        pytest.skip("this udevadm has no `verify` (systemd 254 and later have it)")
    assert result.returncode == 0, result.stdout + result.stderr
