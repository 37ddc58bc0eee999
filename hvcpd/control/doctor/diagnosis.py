"""What the checks of `hvcpctl doctor` share: their findings in three grades, and commands of the system."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence

from hvcpd.daemon.preflight import Finding
from hvcpd.errors import EX_UNAVAILABLE


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
