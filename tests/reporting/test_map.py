"""The map from above: its labels can be read."""

from __future__ import annotations

import random
import re

import pytest

from hvcpd.reporting.events import Plant
from hvcpd.reporting.map_svg import draw_plan

LETTER = 13.5
"""Width of a letter on a phone, SVG units, where labels are largest: 13.2 in bold DejaVu Sans of 20 px."""
LABEL = re.compile(r'<text class="label" x="([-0-9.]+)" y="[-0-9.]+" text-anchor="(\w+)">([^<]+)</text>')


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
