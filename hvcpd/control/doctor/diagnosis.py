"""What the checks of `hvcpctl doctor` share: their findings in three grades, and what they look at."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hvcpd.daemon.preflight import Finding
from hvcpd.errors import EX_UNAVAILABLE
from hvcpd.hardware.temperature import THERMAL


def fine(subject: str, text: str, **figures: float) -> Finding:
    """All is well."""
    return Finding(subject, text, figures=figures)


def note(subject: str, text: str, **figures: float) -> Finding:
    """Return a finding that works, but could work better."""
    return Finding(subject, text, doubtful=True, figures=figures)


def wrong(subject: str, text: str, **figures: float) -> Finding:
    """Return a finding that does not work; the text has the remedy."""
    return Finding(subject, text, EX_UNAVAILABLE, figures=figures)


RunCommand = Callable[[Sequence[str]], str | None]
"""Runs a command; returns its output, None if there is no such command."""


def run_command(command: Sequence[str]) -> str | None:
    """The command's output; None if it is missing or takes longer than 10 s."""
    try:
        done = subprocess.run(list(command), capture_output=True, errors="replace", check=False, timeout=10.0)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout


@dataclass(frozen=True)
class Machine:
    """The folders, commands and clocks of the computer that the doctor looks at; tests pass others."""

    devices: Path = Path("/dev")
    thermal: Path = THERMAL
    throttled: Path = Path("/sys/devices/platform/soc/soc:firmware/get_throttled")
    boot: Path = Path("/boot/firmware/config.txt")
    proc: Path = Path("/proc")
    run: RunCommand = run_command
    wall_s: Callable[[], float] = time.time
    cpu_s: Callable[[], float] = time.thread_time
    may: Callable[[Path, int], bool] = os.access
