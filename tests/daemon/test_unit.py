"""The systemd unit: accepted without a word by systemd's own check, and fit for sounddevice."""

from __future__ import annotations

import configparser
import shutil
import subprocess
from pathlib import Path

import pytest

from hvcpd.config.settings import STATE_DIR, SYSTEM_SETTINGS_PATH
from hvcpd.errors import EX_CONFIG, EX_USAGE

UNIT = Path(__file__).parents[2] / "systemd" / "hvcpd.service"


def service() -> configparser.SectionProxy:
    parser = configparser.RawConfigParser(strict=False)
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    parser.read_string(UNIT.read_text())
    return parser["Service"]


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed")
def test_systemd_accepts_it_without_a_word(tmp_path: Path) -> None:
    command = service()["ExecStart"]
    there = tmp_path / "hvcpd.service"  # the command itself need not be installed here
    there.write_text(UNIT.read_text().replace(f"ExecStart={command}", f"ExecStart={shutil.which('true')}"))
    result = subprocess.run(["systemd-analyze", "verify", there], capture_output=True, text=True, timeout=60)
    assert result.stderr == ""
    assert result.returncode == 0


def test_it_fits_the_settings_and_the_exit_statuses() -> None:
    unit = service()
    assert f"/var/lib/{unit['StateDirectory']}" == str(STATE_DIR)
    assert f"/etc/{unit['ConfigurationDirectory']}" == str(SYSTEM_SETTINGS_PATH.parent)
    assert unit["RestartPreventExitStatus"].split() == [str(EX_USAGE), str(EX_CONFIG)]
    assert unit["SupplementaryGroups"].split() == ["audio", "dialout"]


def test_sounddevice_can_make_its_callbacks() -> None:
    assert "MemoryDenyWriteExecute" not in service()
