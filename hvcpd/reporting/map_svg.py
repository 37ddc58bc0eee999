"""The room seen from above: tasks' places, trails, starts and ends, as inline SVG."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from hvcpd.config.shared_places import LINE_M, SharedPlace
from hvcpd.reporting.events import Performed, Plant, Trail
from hvcpd.reporting.icons import drawn
from hvcpd.reporting.markup import joined, tag
from hvcpd.reporting.story import Story
from hvcpd.reporting.text import clock, number, without_common_start

_WIDTH, _HEIGHT = 700.0, 700.0
"""The drawing fits into this, in SVG units."""
_PAD = 34.0
"""Around it, for the scale's figures."""
MAX_NAMED_TASKS = 16
"""More are labelled by their number alone; the table beside has the names."""
_MARGIN_M = 0.8
_MAX_LINES = 26
"""Grid lines each way; larger rooms get a coarser grid."""
_ARROW_EVERY = 160.0
"""SVG units of trail between two arrowheads."""
_END = 15.0
"""Half the side of the frame around a trail's end: a robot ends at a task's place, whose mark stays visible in it."""
_CHARACTER, _LINE = 13.5, 20.0
"""Size of a label's letter, SVG units: bold, 20 px, as on a phone, where labels are larger than on a desk."""


@dataclass(frozen=True)
class Frame:
    """Metres to SVG units; y upwards in the room, downwards in SVG."""

    left_m: float
    bottom_m: float
    wide_m: float
    high_m: float
    step_m: float

    @property
    def scale(self) -> float:
        return min(_WIDTH / self.wide_m, _HEIGHT / self.high_m)

    @property
    def size(self) -> tuple[float, float]:
        return self.wide_m * self.scale, self.high_m * self.scale

    def at(self, x_m: float, y_m: float) -> tuple[float, float]:
        x = _PAD + (x_m - self.left_m) * self.scale
        return round(x, 1), round(_PAD + (self.high_m - (y_m - self.bottom_m)) * self.scale, 1)


def fit(points: Sequence[tuple[float, float]]) -> Frame:
    """A frame around points (x_m, y_m), on whole steps of the grid."""
    finite = [p for p in points if all(map(math.isfinite, p))] or [(0.0, 0.0)]
    xs, ys = [p[0] for p in finite], [p[1] for p in finite]
    extent_m = max(max(xs) - min(xs), max(ys) - min(ys)) + 2 * _MARGIN_M
    step_m = 1.0
    for factor in (2, 2.5, 2) * 6:
        if extent_m / step_m <= _MAX_LINES:
            break
        step_m *= factor
    edges = []
    for values in (xs, ys):
        low = math.floor((min(values) - _MARGIN_M) / step_m) * step_m
        edges.append((low, math.ceil((max(values) + _MARGIN_M) / step_m) * step_m - low))
    return Frame(edges[0][0], edges[1][0], edges[0][1], edges[1][1], step_m)


def draw_plan(
    plants: Sequence[Plant],
    others: Sequence[tuple[float, float]] = (),
    icons: Mapping[int, str] | None = None,
    areas: Sequence[SharedPlace] = (),
) -> Markup:
    """The room with the tasks' places, none of them done yet, and room for `others`: (x_m, y_m).

    `icons` are the tasks' by number; without one a task has the neutral mark. Only one robot fits in each of the
    `areas`.

    The picture tells in its data how metres become its units, for a script that draws robots into it: x is
    `pad + (x_m - left) * scale`, y is `pad + (high - (y_m - bottom)) * scale`.
    """
    frame = fit([(plant.x_m, plant.y_m) for plant in plants] + list(others) + corners(areas))
    labels = _Labels(frame)
    for plant in plants:
        labels.block(*frame.at(plant.x_m, plant.y_m), 16.0)
    return _picture(
        frame,
        "",
        [_area(frame, area, labels) for area in areas],
        _marks(frame, plants, icons or {}, {}, labels),
        data_left=frame.left_m,
        data_bottom=frame.bottom_m,
        data_high=frame.high_m,
        data_wide=frame.wide_m,
        data_scale=f"{frame.scale:.6f}",
        data_pad=_PAD,
    )


def _picture(frame: Frame, more: str, *layers: Iterable[Markup], **data: float | str) -> Markup:
    """The layers over the grid; `more` is the rest of the title."""
    width, height = (side + 2 * _PAD for side in frame.size)
    title = tag("title", f"The room from above, {number(frame.wide_m)} m by {number(frame.high_m)} m{more}")
    canvas = {"class_": "map", "viewBox": f"0 0 {width:.0f} {height:.0f}", "role": "img"}
    return tag("svg", title, _grid(frame), *(tag("g", *layer) for layer in layers), **canvas, **data)


def draw_map(story: Story, trails: Sequence[Trail]) -> Markup:
    """The map; `trails` are simplified already."""
    plants, areas = story.started.plants, story.started.places
    points = [(plant.x_m, plant.y_m) for plant in plants] + [(pose.x_m, pose.y_m) for pose in story.started.starts]
    points += corners(areas)
    for trail in trails:
        points += list(zip(trail.x_m.tolist(), trail.y_m.tolist(), strict=True))
    frame = fit(points)
    labels = _Labels(frame)
    order = story.slots
    drawn = [t for t in trails if len(t.t_s)]
    for plant in plants:
        labels.block(*frame.at(plant.x_m, plant.y_m), 16.0)
    for trail in drawn:
        labels.block(*frame.at(trail.x_m[0], trail.y_m[0]), 9.0)
        labels.block(*frame.at(trail.x_m[-1], trail.y_m[-1]), 16.0)
        labels.avoid([frame.at(x, y) for x, y in zip(trail.x_m.tolist(), trail.y_m.tolist(), strict=True)])
    return _picture(
        frame,
        ", with the robots' trails",
        [_area(frame, area, labels) for area in areas],
        [_trail(frame, trail, order.get(trail.robot, 0)) for trail in drawn],
        _marks(frame, plants, dict(story.started.icons), _acts(story), labels),
        [_ends(frame, trail, order.get(trail.robot, 0), labels) for trail in drawn],
        [_puck(frame, trail, order.get(trail.robot, 0)) for trail in drawn],
    )


def corners(areas: Iterable[SharedPlace]) -> list[tuple[float, float]]:
    """Points (x_m, y_m) between which all of these areas lie."""
    return [(corner.x_m, corner.y_m) for area in areas for corner in area.corners]


def _area(frame: Frame, area: SharedPlace, labels: _Labels) -> Markup:
    """A place that only one robot fits in, and the line at which others wait."""
    low, high = area.corners
    (left, bottom), (right, top) = frame.at(low.x_m, low.y_m), frame.at(high.x_m, high.y_m)

    def outline(kind: str, margin: float) -> Markup:
        wide, tall = right - left + 2 * margin, bottom - top + 2 * margin
        radius = area.radius_m * frame.scale + margin
        return tag("rect", class_=kind, x=left - margin, y=top - margin, width=wide, height=tall, rx=radius)

    told = tag("title", f"The {area.name}: only one robot fits in; others wait at the dotted line")
    outlines = tag("g", told, outline("area", 0.0), outline("wait", LINE_M * frame.scale))
    name = labels.place(area.name, 0.5 * (left + right), 0.5 * (top + bottom), 0.5 * (bottom - top), "label area-name")
    labels.avoid([(left, top), (right, top), (right, bottom), (left, bottom), (left, top)])
    return joined([outlines, name])


def _grid(frame: Frame) -> Markup:
    parts = []
    x0, y1 = frame.at(frame.left_m, frame.bottom_m)
    x1, y0 = frame.at(frame.left_m + frame.wide_m, frame.bottom_m + frame.high_m)
    columns, rows = round(frame.wide_m / frame.step_m), round(frame.high_m / frame.step_m)
    every = 2 if max(columns, rows) > 8 else 1
    for k in range(columns + 1):
        x_m = frame.left_m + k * frame.step_m
        x = frame.at(x_m, 0.0)[0]
        parts.append(tag("line", class_="grid", x1=x, x2=x, y1=y0, y2=y1))
        if round(x_m / frame.step_m) % every == 0:
            parts.append(tag("text", _signed(x_m), class_="scale", x=x, y=y1 + 18, text_anchor="middle"))
    for k in range(rows + 1):
        y_m = frame.bottom_m + k * frame.step_m
        y = frame.at(0.0, y_m)[1]
        parts.append(tag("line", class_="grid", x1=x0, x2=x1, y1=y, y2=y))
        if round(y_m / frame.step_m) % every == 0:
            parts.append(tag("text", _signed(y_m), class_="scale", x=x0 - 7, y=y + 4, text_anchor="end"))
    unit = f"m, one square is {number(frame.step_m)} m"
    parts.append(tag("text", unit, class_="scale", x=x1, y=y0 - 9, text_anchor="end"))
    return tag("g", joined(parts))


def _signed(value: float) -> str:
    return number(value).replace("-", "−")


def _trail(frame: Frame, trail: Trail, slot: int) -> Markup:
    points = [frame.at(x, y) for x, y in zip(trail.x_m.tolist(), trail.y_m.tolist(), strict=True)]
    line = tag(
        "polyline",
        tag("title", f"{trail.robot}'s trail"),
        class_=f"trail r{slot}",
        points=" ".join(f"{number(x, 1)},{number(y, 1)}" for x, y in points),
        data_times=" ".join(number(t) for t in trail.t_s.tolist()),
    )
    return joined([line, *_arrows(points, slot)])


def _arrows(points: list[tuple[float, float]], slot: int) -> list[Markup]:
    """Arrowheads along the way, so that its direction shows without colour or motion."""
    arrows, gone, due = [], 0.0, _ARROW_EVERY / 2
    for (xa, ya), (xb, yb) in itertools.pairwise(points):
        length = math.hypot(xb - xa, yb - ya)
        while length > 0 and due <= gone + length:
            share = (due - gone) / length
            x, y, angle = xa + share * (xb - xa), ya + share * (yb - ya), math.degrees(math.atan2(yb - ya, xb - xa))
            turned = f"translate({number(x, 1)} {number(y, 1)}) rotate({number(angle, 0)})"
            arrows.append(tag("path", class_=f"arrow r{slot}", d="M-5-5 6 0-5 5Z", transform=turned))
            due += _ARROW_EVERY
        gone += length
    return arrows


def _acts(story: Story) -> dict[int, Performed]:
    """The first time that each task was carried out, without those that remained half done."""
    undone, _ = story.wrong
    return {act.task: act for act in reversed(story.performed) if act.task not in undone}


def _marks(
    frame: Frame, plants: Sequence[Plant], icons: Mapping[int, str], done: Mapping[int, Performed], labels: _Labels
) -> list[Markup]:
    parts = []
    for plant, short in zip(plants, without_common_start([p.name for p in plants]), strict=True):
        x, y = frame.at(plant.x_m, plant.y_m)
        act = done.get(plant.task)
        how = f"done by {act.robot} at {clock(act.at_s)}" if act else "not done"
        mark = tag(
            "g",
            tag("title", f"{plant.task}: {plant.name}, at ({plant.x_m:.2f}, {plant.y_m:.2f}) m, {how}"),
            drawn(icons.get(plant.task, ""), plant.name),
            class_="place" if act else "place undone",
            transform=f"translate({number(x, 1)} {number(y, 1)})",
            data_task=plant.task,
            data_done=f"{act.at_s:.3f}" if act else None,
        )
        label = f"{plant.task} {short}" if len(plants) <= MAX_NAMED_TASKS else f"{plant.task}"
        parts += [mark, labels.place(label, x, y, 16.0, "label")]
    return parts


def _ends(frame: Frame, trail: Trail, slot: int, labels: _Labels) -> Markup:
    (xa, ya), (xb, yb) = frame.at(trail.x_m[0], trail.y_m[0]), frame.at(trail.x_m[-1], trail.y_m[-1])
    begin = tag("circle", tag("title", f"{trail.robot} starts here"), class_=f"start r{slot}", cx=xa, cy=ya, r=7)
    end = tag(
        "rect",
        tag("title", f"{trail.robot} ends here"),
        class_=f"end r{slot}",
        x=xb - _END,
        y=yb - _END,
        width=2 * _END,
        height=2 * _END,
        rx=4,
    )
    moved = math.hypot(xb - xa, yb - ya) > _LINE
    written = [labels.place(trail.robot, xa, ya, 9.0 if moved else 16.0, f"label r{slot}")]
    if moved:
        written.append(labels.place(trail.robot, xb, yb, 16.0, f"label r{slot}"))
    return joined([begin, end, *written])


def _puck(frame: Frame, trail: Trail, slot: int) -> Markup:
    """The robot itself, which the page's script moves while the mission plays."""
    x, y = frame.at(trail.x_m[0], trail.y_m[0])
    return tag("circle", class_=f"puck r{slot}", cx=x, cy=y, r=10, data_puck=True)


class _Labels:
    """Finds for each label the side of its point where it covers the least."""

    def __init__(self, frame: Frame) -> None:
        self._taken: list[tuple[float, float, float, float]] = []
        self._crowd: list[tuple[float, float]] = []
        self._width = frame.size[0] + 2 * _PAD

    def block(self, x: float, y: float, radius: float) -> None:
        self._taken.append((x - radius, y - radius, x + radius, y + radius))

    def avoid(self, points: Sequence[tuple[float, float]]) -> None:
        """Rather not cover the line through these points."""
        for (xa, ya), (xb, yb) in itertools.pairwise(points):
            n = min(int(math.hypot(xb - xa, yb - ya) / 6.0) + 1, 200)
            self._crowd += zip(np.linspace(xa, xb, n).tolist(), np.linspace(ya, yb, n).tolist(), strict=True)

    def place(self, text: str, x: float, y: float, radius: float, kind: str) -> Markup:
        wide = max(len(text) * _CHARACTER, 8.0)
        above, below = y - radius - 5, y + radius + 16
        options = (
            ("middle", x, above, x - wide / 2),
            ("start", x + radius + 4, y + 5, x + radius + 4),
            ("end", x - radius - 4, y + 5, x - radius - 4 - wide),
            ("end", x + radius, above, x + radius - wide),
            ("start", x - radius, above, x - radius),
            ("middle", x, below, x - wide / 2),
            ("end", x + radius, below, x + radius - wide),
            ("start", x - radius, below, x - radius),
        )
        anchor, tx, ty, left = min(options, key=lambda o: self._cost(o[3], o[2], wide))
        self._taken.append(self._box(left, ty, wide))
        return tag("text", text, class_=kind, x=round(tx, 1), y=round(ty, 1), text_anchor=anchor)

    def _box(self, left: float, base: float, wide: float) -> tuple[float, float, float, float]:
        return left, base - 0.75 * _LINE, left + wide, base + 0.25 * _LINE

    def _cost(self, left: float, base: float, wide: float) -> float:
        a, b, c, d = self._box(left, base, wide)
        hidden = sum(max(min(c, q[2]) - max(a, q[0]), 0) * max(min(d, q[3]) - max(b, q[1]), 0) for q in self._taken)
        # Over a line a label can still be read, over another label neither can; beyond the edge it is cut off.
        crossed = sum(a <= x <= c and b <= y <= d for x, y in self._crowd)
        return 10.0 * hidden + 8.0 * crossed + 1e6 * (a < 0 or c > self._width)
