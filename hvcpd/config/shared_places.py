"""Places that only one robot fits in, as the task file lists them under `places:`: a corridor, a tap, a dock."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from hvcpd.config.document import KeyPath
from hvcpd.config.loading import Parts, between, checked
from hvcpd.config.names import MAX_WORD_LENGTH, plain_letters
from hvcpd.ports import Place

BODY_M = 0.15
"""From the middle of a robot to its outermost part, and some odometry: nearer to the area, it is in it."""
LINE_M = 0.4
"""From the area to the middle of a robot that waits for it."""
APART_M = 2.0 * LINE_M
"""Between two areas, at least: who waits for one is in no other, so that nobody holds one and waits for another."""
MAX_PLACES = 12
"""Of one task file: each name makes every listener's network larger."""
MAX_NAME_WORDS = 3
MAX_DISTANCE_M = 50
"""Bound of coordinates, distances and a radius; beyond, robots are out of each other's hearing (about 10 m) by far."""
WITHIN_ROOM = between(-MAX_DISTANCE_M, MAX_DISTANCE_M)
"""A coordinate's check."""
NEAR_M = 0.01
"""Distance from an edge within which a step along a way counts as there."""


@dataclass(frozen=True)
class SharedPlace:
    """A rectangle from its low to its high corner, m, and all that is within `radius_m` of it; a point has a circle."""

    name: str
    low_x_m: float
    low_y_m: float
    high_x_m: float
    high_y_m: float
    radius_m: float = 0.0

    def distance_m(self, point: Place) -> float:
        """From a point to the area; 0 or less within."""
        dx_m = max(self.low_x_m - point.x_m, 0.0, point.x_m - self.high_x_m)
        dy_m = max(self.low_y_m - point.y_m, 0.0, point.y_m - self.high_y_m)
        return math.hypot(dx_m, dy_m) - self.radius_m

    @property
    def corners(self) -> tuple[Place, Place]:
        """The lowest and the highest corner of the rectangle around the area."""
        low = Place(self.low_x_m - self.radius_m, self.low_y_m - self.radius_m)
        return low, Place(self.high_x_m + self.radius_m, self.high_y_m + self.radius_m)

    def way_m(self, here: Place, goal: Place, margin_m: float) -> float | None:
        """How far along the straight path from `here` to `goal` the area comes within `margin_m`, m; None: nowhere.

        The distance to a convex area changes no faster than the way along a line, so steps as long as it miss nothing
        (sphere tracing, Hart 1996).
        """
        length_m = here.distance_m(goal)
        way_m = 0.0
        while way_m <= length_m:
            share = way_m / length_m if length_m else 0.0
            left_m = self.distance_m(here.toward(goal, share)) - margin_m
            if left_m <= NEAR_M:
                return way_m
            way_m += left_m
        return None

    def apart_m(self, other: SharedPlace) -> float:
        """Between the edges of two areas; 0 or less where they meet."""
        dx_m = max(self.low_x_m - other.high_x_m, 0.0, other.low_x_m - self.high_x_m)
        dy_m = max(self.low_y_m - other.high_y_m, 0.0, other.low_y_m - self.high_y_m)
        return math.hypot(dx_m, dy_m) - self.radius_m - other.radius_m


def valid_place_name(name: str) -> str | None:
    """What is wrong with the name of a place, or None: a few lower-case words without "the", which is said before."""
    words = name.split(" ")
    good = all(word.isascii() and word.isalpha() and word.islower() and len(word) <= MAX_WORD_LENGTH for word in words)
    if good and len(words) <= MAX_NAME_WORDS and words[0] != "the":
        return None
    letters = "".join(c if c.isalpha() else " " for c in plain_letters(name).lower())
    tidy = " ".join(letters.split()[:MAX_NAME_WORDS]).removeprefix("the ")
    hint = f"write for example {tidy!r}" if tidy and tidy.isascii() else "write for example 'corridor'"
    rule = f"1 to {MAX_NAME_WORDS} words of the letters a-z with one space between, without 'the'"
    return f"the name {name[:40]!r} of a place is not {rule}; {hint}"


@dataclass(frozen=True)
class PointEntry:
    """A point as the task file has it."""

    x_m: float = field(metadata=WITHIN_ROOM)
    y_m: float = field(metadata=WITHIN_ROOM)

    def place(self) -> Place:
        """The point itself."""
        return Place(self.x_m, self.y_m)


def _valid_corners(corners: tuple[PointEntry, ...]) -> str | None:
    if not corners or (len(corners) == 2 and corners[0].x_m != corners[1].x_m and corners[0].y_m != corners[1].y_m):
        return None
    return "a rectangle has two opposite corners; write for example [{x_m: 0, y_m: -1}, {x_m: 1, y_m: 1}]"


@dataclass(frozen=True)
class PlaceEntry:
    """A place as the task file has it: two opposite corners, or a centre and a radius."""

    name: str = field(metadata=checked(valid_place_name))
    corners: tuple[PointEntry, ...] = field(default=(), metadata=checked(_valid_corners))
    centre: PointEntry | None = None
    radius_m: float = field(default=0.0, metadata=between(0, MAX_DISTANCE_M))

    def place(self) -> SharedPlace:
        """The place itself."""
        points = self.corners or ((self.centre,) if self.centre is not None else ())
        xs, ys = [point.x_m for point in points], [point.y_m for point in points]
        return SharedPlace(self.name, min(xs), min(ys), max(xs), max(ys), self.radius_m)


def check_places(parts: Parts, sounds_alike: Callable[[str, str], bool] | None) -> None:
    """Each has one area and a name of its own by ear, is far enough from all others for a robot to wait between, and
    has no task for several robots in it."""
    seen: list[tuple[PlaceEntry, KeyPath]] = []
    for at in parts.elements(("places",)):
        entry = parts.get(at, PlaceEntry)
        if entry is None:
            continue
        if bool(entry.corners) == (entry.centre is not None) or (entry.centre is not None) != (entry.radius_m > 0.0):
            parts.fault(
                at, f"the place {entry.name!r} needs either `corners` or both `centre` and `radius_m`; write one"
            )
            continue
        for other, path in seen:
            line = parts.where(path, at)
            apart_m = entry.place().apart_m(other.place())
            if entry.name == other.name:
                parts.fault((*at, "name"), f"the place {entry.name!r} is listed in {line} already; choose another name")
            elif sounds_alike is not None and sounds_alike(entry.name, other.name):
                text = f"the place {entry.name!r} sounds like {other.name!r} in {line}; rename one of them"
                parts.fault((*at, "name"), text)
            elif apart_m < APART_M:
                near = "overlaps" if apart_m < 0.0 else f"is {apart_m:.2f} m from"
                remedy = f"list both as one, or leave {APART_M:g} m between for a robot that waits"
                parts.fault(at, f"the place {entry.name!r} {near} {other.name!r} in {line}; {remedy}")
        seen.append((entry, at))
    for task in parts.elements(("tasks",)):
        _check_room(parts, task, seen)


def _check_room(parts: Parts, at: KeyPath, places: Sequence[tuple[PlaceEntry, KeyPath]]) -> None:
    """A task for several robots is in none of the places."""
    point, robots = parts.get((*at, "place"), PointEntry), parts.get((*at, "robots"), int) or 1
    if point is None or robots <= 1:
        return
    for entry, path in places:
        if entry.place().distance_m(point.place()) < LINE_M:
            line = parts.where(path, at)
            text = f"the task takes {robots} robots, and only one fits in the place {entry.name!r} in {line}"
            parts.fault((*at, "robots"), f"{text}; write 1, or move one of the two")
