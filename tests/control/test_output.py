"""Where the output goes to the wrong place: a message, a true exit status, and never a traceback."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HVCPCTL = (sys.executable, "-m", "hvcpd.control.cli")


def shell(command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_a_full_disk_is_told() -> None:
    done = shell(f"{' '.join(HVCPCTL)} phrases > /dev/full")
    assert done.returncode == 2
    assert "cannot be written" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_closed_output_does_no_harm() -> None:
    done = shell(f"{' '.join(HVCPCTL)} phrases >&-")
    assert "Traceback" not in done.stderr
