"""Statements about places with room for only one robot: requests, handovers, and that a robot is inside.

`place` is its name in the task file, in lower case.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PlaceWanted:
    """The speaker is about to enter, and asks the keeper for the place."""

    place: str


@dataclass(frozen=True)
class PlaceGiven:
    """The place is the addressee's from now on; only its last keeper says so."""

    place: str


@dataclass(frozen=True)
class PlaceTaken:
    """The speaker has the place; `stands`: it has stopped in it, and nobody can tell when it will leave."""

    place: str
    stands: bool = False


@dataclass(frozen=True)
class PlaceFree:
    """The speaker has left the place, and gives it to whichever robot asks."""

    place: str


PlaceStatement = PlaceWanted | PlaceGiven | PlaceTaken | PlaceFree

PLACE_FORMS: tuple[tuple[str, type[PlaceStatement], str, dict[str, object]], ...] = (
    ("i will use <place>", PlaceWanted, "I wait outside until somebody lets me in, or nobody answers.", {}),
    ("confirmed <place>", PlaceGiven, "I have left it: go in.", {}),
    ("i am in <place>", PlaceTaken, "I have it: wait outside.", {"stands": False}),
    ("i have stopped in <place>", PlaceTaken, "I stand in it: wait until I say that it is free.", {"stands": True}),
    ("<place> is free", PlaceFree, "I have left it.", {}),
)
"""Their wording after the opening, and their meaning; they exist only where the task file lists places."""
