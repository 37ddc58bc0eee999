"""CONTRIBUTING.md names files that exist, and no first change needs more than three."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
FIRST = PAGE.split("## A first change in each room")[1].split("\n## ")[0]


def test_every_file_and_folder_that_is_named_exists() -> None:
    named = set(re.findall(r"`((?:hvcpd|hil_fakes|examples|docs|etc|tests)/[\w/.]*)`", PAGE))
    named -= {name for name in named if "NAME" in name}
    assert len(named) > 10
    assert {name for name in named if not (ROOT / name).exists()} == set()


def test_what_is_said_to_stand_in_a_file_stands_there() -> None:
    stands = {
        "hvcpd/language/messages.py": "class WhatDoing",
        "hvcpd/coordination/commands.py": "REACTIONS",
        "hvcpd/ports.py": "class Wheels",
        "hvcpd/config/settings.py": "class WheelSettings",
        "hvcpd/daemon/devices.py": "def make_wheels",
        "hvcpd/synthesis/voices.py": "VOICES",
        "hvcpd/config/names.py": "VoiceName",
        "hil_fakes/dynamixel/contract.py": "CHECKS",
        "hvcpd/hardware/motors.py": "MODELS",
    }
    assert {name for name, what in stands.items() if what not in (ROOT / name).read_text(encoding="utf-8")} == set()


def test_no_first_change_needs_more_than_three_files() -> None:
    parts = FIRST.split("\n### ")[1:]
    assert len(parts) == 5
    assert max(len(re.findall(r"^\d\. ", part, re.M)) for part in parts) == 3
