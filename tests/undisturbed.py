"""Tests in real time that must not be starved by others' moments of heavy work, whatever process they run in."""

from __future__ import annotations

import fcntl
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LOCK = Path(tempfile.gettempdir()) / "hvcpd-tests-in-real-time.lock"


@contextmanager
def undisturbed() -> Iterator[None]:
    """One at a time, in all processes of this computer."""
    with LOCK.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
