"""The addressees of a sentence, and greetings; as text they are what is said: "all", "team plant", "Rob"."""

from __future__ import annotations

from dataclasses import dataclass

GREETING = "hi"
"""The first word of most of robots' sentences."""
GREETINGS = (GREETING, "hello")
"""Those of people's."""
TO_ALL = "all"
FRIEND = "friend"
"""What robots call a person whose name they do not know, or who did not say it."""


@dataclass(frozen=True)
class ToAll:
    """Everybody within earshot."""

    def __str__(self) -> str:
        return TO_ALL


@dataclass(frozen=True)
class ToTeam:
    """Every member of a team."""

    team: str

    def __str__(self) -> str:
        return f"team {self.team}"


@dataclass(frozen=True)
class ToRobot:
    """One robot (or person), by its name as it is written."""

    name: str

    def __str__(self) -> str:
        return self.name


Addressee = ToAll | ToTeam | ToRobot
