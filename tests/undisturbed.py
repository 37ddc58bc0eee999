"""Tests in real time that must not be starved by others, whatever process they run in."""

from __future__ import annotations

import fcntl
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MOMENT = "hvcpd-tests-in-real-time.lock"
"""For a moment of heavy work, and for what it would starve: a robot's start, a command that drives."""
MISSION = "hvcpd-tests-on-stage.lock"
"""For a whole mission of real processes. It takes nearly a core, and on two weak cores two missions starved each other
until no robot heard anything."""


@contextmanager
def undisturbed(kind: str = MOMENT) -> Iterator[None]:
    """One of a kind at a time, in all processes of this computer."""
    with (Path(tempfile.gettempdir()) / kind).open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
