"""The addressees of a sentence."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ToAll:
    """Everybody within earshot."""


@dataclass(frozen=True)
class ToTeam:
    """Every member of a team."""

    team: str


@dataclass(frozen=True)
class ToRobot:
    """One robot (or person), by its name as it is written."""

    name: str


Addressee = ToAll | ToTeam | ToRobot
