"""One finding of `hvcpctl doctor`."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum


class Grade(StrEnum):
    """The severity of a finding."""

    OK = "ok"
    NOTE = "note"
    """The robot works; it could work better."""
    WRONG = "wrong"


@dataclass(frozen=True)
class Diagnosis:
    """The result of one check: what was found, or what is wrong and what to do."""

    subject: str
    grade: Grade
    text: str
    figures: Mapping[str, float] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether the robot can work with this."""
        return self.grade is not Grade.WRONG


def fine(subject: str, text: str, **figures: float) -> Diagnosis:
    """All is well."""
    return Diagnosis(subject, Grade.OK, text, figures)


def note(subject: str, text: str, **figures: float) -> Diagnosis:
    """Return a finding that works, but deserves a note."""
    return Diagnosis(subject, Grade.NOTE, text, figures)


def wrong(subject: str, text: str, **figures: float) -> Diagnosis:
    """Return a finding that does not work; the text has the remedy."""
    return Diagnosis(subject, Grade.WRONG, text, figures)


RunCommand = Callable[[Sequence[str]], str | None]
"""Runs a command; returns its output, None if there is no such command."""


def run_command(command: Sequence[str]) -> str | None:
    """The command's output; None if it is missing or takes longer than 10 s."""
    try:
        done = subprocess.run(list(command), capture_output=True, text=True, check=False, timeout=10.0)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout
