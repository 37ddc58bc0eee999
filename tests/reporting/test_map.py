"""The map from above: its labels can be read, and places are where they are."""

from __future__ import annotations

import random
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.config.shared_places import LINE_M, MAX_DISTANCE_M, SharedPlace
from hvcpd.reporting.events import Plant
from hvcpd.reporting.map_svg import draw_map, draw_plan
from hvcpd.reporting.story import tell
from tests.reporting.example import example

LETTER = 13.5
"""Width of a letter on a phone, SVG units, where labels are largest: 13.2 in bold DejaVu Sans of 20 px."""
LABEL = re.compile(r'<text class="label" x="([-0-9.]+)" y="[-0-9.]+" text-anchor="(\w+)">([^<]+)</text>')

RECTANGLE = re.compile(r'<rect class="(\w+)" x="([-0-9.]+)" y="([-0-9.]+)" width="([0-9.]+)" height="([0-9.]+)"')
METRES = st.floats(-MAX_DISTANCE_M, MAX_DISTANCE_M)


@pytest.mark.parametrize("seed", range(20))
def test_no_label_is_cut_off_at_the_side(seed: int) -> None:
    rng = random.Random(seed)
    places = [(-6.0, 0.0)] + [(rng.uniform(5.0, 6.0), rng.uniform(-1.0, 1.0)) for _ in range(11)]
    drawn = str(draw_plan([Plant(k + 1, "water the orange rose", x_m, y_m) for k, (x_m, y_m) in enumerate(places)]))
    wide = float(re.findall(r'viewBox="0 0 (\d+)', drawn)[0])
    labels = LABEL.findall(drawn)
    assert len(labels) == len(places)
    for x, anchor, text in labels:
        left = float(x) - len(text) * LETTER * {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor]
        assert 0.0 <= left <= wide - len(text) * LETTER, (text, x, anchor)


@pytest.mark.parametrize("seed", range(10))
def test_the_name_of_a_robot_that_stays_where_it_is_is_not_in_its_frame(seed: int) -> None:
    """Robots start beside each other, and in a team of six four or five have nothing to do."""
    record = example(names=("Emma", "Noah", "Mia", "Leon", "Lina", "Finn"), n_tasks=1, seed=seed, sound=False)
    drawn = str(draw_map(tell(record), record.trails))
    frames = dict(re.findall(r'<rect class="end (r\d)" ((?:\w+="[-0-9.]+" ?)+)', drawn))
    labels = re.findall(r'<text class="label (r\d)" x="([-0-9.]+)" y="([-0-9.]+)" text-anchor="(\w+)">([^<]+)<', drawn)
    for slot in ("r1", "r2", "r3", "r4", "r5"):
        side = {key: float(value) for key, value in re.findall(r'(\w+)="([-0-9.]+)"', frames[slot])}
        ((_, x, y, anchor, text),) = [label for label in labels if label[0] == slot]
        left = float(x) - len(text) * LETTER * {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor]
        beside = left + len(text) * LETTER <= side["x"] or left >= side["x"] + side["width"]
        assert beside or float(y) <= side["y"] or float(y) - 15.0 >= side["y"] + side["height"], text


@given(METRES, METRES, st.floats(0.1, 20.0), st.floats(0.1, 20.0), st.booleans())
def test_a_place_for_one_robot_is_drawn_to_scale_with_the_line_at_which_others_wait(
    x_m: float, y_m: float, wide_m: float, high_m: float, round_: bool
) -> None:
    area = SharedPlace("tap", x_m, y_m, x_m, y_m, 0.5 * wide_m)
    if not round_:
        area = SharedPlace("tap", x_m, y_m, x_m + wide_m, y_m + high_m)
    drawn = str(draw_plan([Plant(1, "water the orange rose", 0.0, 0.0)], areas=[area]))
    scale, left_m, bottom_m, room_m = (
        float(re.findall(rf'data-{key}="([-0-9.]+)"', drawn)[0]) for key in ("scale", "left", "bottom", "high")
    )
    wide, high = (float(side) for side in re.findall(r'viewBox="0 0 (\d+) (\d+)"', drawn)[0])
    inner, line = RECTANGLE.findall(drawn)
    assert (inner[0], line[0]) == ("area", "wait")
    low, top = area.corners
    for (_, *sides), margin_m in ((inner, 0.0), (line, LINE_M)):
        x, y, width, height = map(float, sides)
        assert 0.0 <= x <= x + width <= wide
        assert 0.0 <= y <= y + height <= high
        seen = ((x - 34.0) / scale + left_m, room_m - (y - 34.0) / scale + bottom_m, width / scale, height / scale)
        across_m, up_m = top.x_m - low.x_m + 2 * margin_m, top.y_m - low.y_m + 2 * margin_m
        assert seen == pytest.approx((low.x_m - margin_m, top.y_m + margin_m, across_m, up_m), abs=0.11 / scale)
    assert ">tap</text>" in drawn
