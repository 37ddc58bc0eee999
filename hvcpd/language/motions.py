"""Motions that people order by voice, each with a bound."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ComeBack:
    """Drive to where you started."""


@dataclass(frozen=True)
class MoveBy:
    """Drive straight on (or back) by a distance in metres."""

    distance_m: float
    back: bool = False


@dataclass(frozen=True)
class TurnBy:
    """Turn on the spot by an angle in degrees, counter-clockwise positive (REP-103)."""

    angle_deg: float


Motion = ComeBack | MoveBy | TurnBy


@dataclass(frozen=True)
class WillMove:
    """The speaker will make this motion: the read-back of its order."""

    motion: Motion
