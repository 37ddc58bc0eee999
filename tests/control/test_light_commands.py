"""What only asks a robot starts in a blink: no arithmetic library, no synthesizer, no ears."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = ("numpy", "hvcpd.synthesis", "hvcpd.recognition", "hvcpd.language.phrasebook", "soundfile")

PROGRAM = f"""
import sys
from hvcpd.control.cli import main
status = main(sys.argv[1:])
print(status, [name for name in sys.modules if name.startswith({HEAVY!r})])
"""


@pytest.mark.parametrize(
    "words",
    [
        ("stop",),
        ("status",),
        ("tasks",),
        ("task", "again", "3"),
        ("say", "Hi Rob, I am Bot, water the rose", "--name", "Bot"),
    ],
)
def test_a_command_that_only_asks_a_robot_loads_nothing_heavy(words: tuple[str, ...], tmp_path: Path) -> None:
    environment = {**os.environ, "HVCPD_STATE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", PROGRAM, *words]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=120)
    status, loaded = done.stdout.splitlines()[-1].split(" ", 1)
    assert status != "0", "no robot runs here"
    assert loaded == "[]"
