"""Other programs' output, for `doctor` and `calibrate`."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence

RunCommand = Callable[[Sequence[str]], str | None]
"""Runs a command; its output, None if there is no such command."""


def run_command(command: Sequence[str]) -> str | None:
    """What the command prints; None if it is not there or takes longer than 10 s."""
    try:
        done = subprocess.run(list(command), capture_output=True, text=True, check=False, timeout=10.0)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout
