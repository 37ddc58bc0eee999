"""Places that only one robot fits in: how the task file lists them, what is refused, and their geometry."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.config.shared_places import APART_M, SharedPlace
from hvcpd.config.task_file import load_tasks
from hvcpd.errors import ConfigError
from hvcpd.ports import Place
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.likeness import sounds_alike

TASKS = "tasks:\n  - {number: 1, name: water the green rose, actions: [{water: 5}]}\nplaces:\n"
CORRIDOR = "  - {name: corridor, corners: [{x_m: 1, y_m: 1}, {x_m: 0, y_m: -1}]}\n"
COORDINATES = st.floats(-5.0, 5.0)


def read(tmp_path: Path, places: str) -> tuple[SharedPlace, ...]:
    path = tmp_path / "tasks.yaml"
    path.write_text(TASKS + places)
    lexicon = Lexicon.load()
    return load_tasks(path, lambda a, b: sounds_alike(a, b, lexicon)).places


def test_a_rectangle_and_a_circle(tmp_path: Path) -> None:
    tap = "  - {name: tap, centre: {x_m: 4, y_m: 0}, radius_m: 0.5}\n"
    assert read(tmp_path, CORRIDOR + tap) == (
        SharedPlace("corridor", 0.0, -1.0, 1.0, 1.0),
        SharedPlace("tap", 4.0, 0.0, 4.0, 0.0, 0.5),
    )


@pytest.mark.parametrize(
    ("place", "fault"),
    [
        (CORRIDOR, "the place 'corridor' is listed in line 4 already; choose another name"),
        (
            "  - {name: tap, centre: {x_m: 1.5, y_m: 0}, radius_m: 1}\n",
            "overlaps 'corridor' in line 4; list both as one",
        ),
        ("  - {name: tap, centre: {x_m: 2, y_m: 0}, radius_m: 0.5}\n", "is 0.50 m from 'corridor' in line 4"),
        ("  - {name: tap}\n", "needs either `corners` or both `centre` and `radius_m`"),
        ("  - {name: tap, centre: {x_m: 4, y_m: 0}}\n", "needs either `corners` or both `centre` and `radius_m`"),
        ("  - {name: tap, corners: [{x_m: 4, y_m: 0}]}\n", "a rectangle has two opposite corners"),
        ("  - {name: tap, corners: [{x_m: 4, y_m: 0}, {x_m: 4, y_m: 1}]}\n", "a rectangle has two opposite corners"),
        ("  - {name: The Tap, centre: {x_m: 4, y_m: 0}, radius_m: 1}\n", "write for example 'tap'"),
        ("  - {name: tap 2, centre: {x_m: 4, y_m: 0}, radius_m: 1}\n", "write for example 'tap'"),
        ("  - {name: tap, centre: {x_m: 4, y_m: 0}, radius: 1}\n", "did you mean 'radius_m'?"),
        ("  - {name: tap, centre: {x_m: 51, y_m: 0}, radius_m: 1}\n", "out of range"),
    ],
)
def test_what_is_wrong_is_told_with_its_line_and_a_remedy(tmp_path: Path, place: str, fault: str) -> None:
    with pytest.raises(ConfigError, match=r"tasks\.yaml:5: ") as refused:
        read(tmp_path, CORRIDOR + place)
    assert fault in str(refused.value)


@pytest.mark.parametrize(
    ("x_m", "robots", "is_refused"), [(0.5, 2, True), (1.3, 2, True), (0.5, 1, False), (1.5, 2, False)]
)
def test_a_task_for_two_where_only_one_fits_in_is_refused(
    tmp_path: Path, x_m: float, robots: int, is_refused: bool
) -> None:
    """One stood inside and waited for the other, which waited outside, and so on for ever."""
    path = tmp_path / "tasks.yaml"
    there = f"place: {{x_m: {x_m}, y_m: 0}}, robots: {robots}"
    path.write_text(TASKS.replace("actions: [", f"{there}, actions: [go to place, ") + CORRIDOR)
    if is_refused:
        with pytest.raises(ConfigError, match="takes 2 robots, and only one fits in the place 'corridor' in line 4"):
            load_tasks(path)
    else:
        assert load_tasks(path).places


def test_names_that_would_be_mistaken_for_each_other(tmp_path: Path) -> None:
    tap, cap = (
        f"  - {{name: {name}, centre: {{x_m: {x_m}, y_m: 0}}, radius_m: 0.5}}\n"
        for name, x_m in (("tap", 4), ("cap", 9))
    )
    with pytest.raises(
        ConfigError, match=r"tasks\.yaml:5: the place 'cap' sounds like 'tap' in line 4; rename one of them"
    ):
        read(tmp_path, tap + cap)


def test_thirteen_places_are_too_many(tmp_path: Path) -> None:
    names = "oak ash elm yew fir lime larch rowan birch maple walnut cherry willow".split()
    places = [
        f"  - {{name: {name}, centre: {{x_m: {3 * n}, y_m: 0}}, radius_m: 0.5}}\n" for n, name in enumerate(names)
    ]
    with pytest.raises(ConfigError, match="at most 12 places may be listed, found 13; remove some"):
        read(tmp_path, "".join(places))


@given(COORDINATES, COORDINATES, COORDINATES, COORDINATES, st.floats(0.0, 1.0), st.booleans())
def test_a_way_meets_the_area_where_its_points_do(
    x0: float, y0: float, x1: float, y1: float, margin_m: float, round_: bool
) -> None:
    place = SharedPlace("here", 0.0, 0.0, 0.0, 0.0, 1.0) if round_ else SharedPlace("here", -1.0, -0.5, 1.0, 0.5)
    here, goal = Place(x0, y0), Place(x1, y1)
    way_m = place.way_m(here, goal, margin_m)
    shares = [n / 400 for n in range(401)]
    length_m = math.dist((x0, y0), (x1, y1))
    points = [(s, Place(x0 + s * (x1 - x0), y0 + s * (y1 - y0))) for s in shares]
    near = [s * length_m for s, point in points if place.distance_m(point) <= margin_m]
    if near:
        assert way_m is not None
        assert way_m <= near[0] + 1e-9
    if way_m is not None:
        share = way_m / length_m if length_m else 0.0
        assert place.distance_m(Place(x0 + share * (x1 - x0), y0 + share * (y1 - y0))) <= margin_m + 0.011


def test_a_robot_that_waits_for_one_place_is_in_no_other() -> None:
    a, b = SharedPlace("a", 0.0, 0.0, 1.0, 1.0), SharedPlace("b", 1.0 + APART_M, 0.0, 3.0, 1.0)
    assert a.apart_m(b) == pytest.approx(APART_M)
    between = Place(1.0 + APART_M / 2.0, 0.5)
    assert b.distance_m(between) == pytest.approx(a.distance_m(between))
