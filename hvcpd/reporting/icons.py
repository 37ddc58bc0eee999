"""A task's mark: what its file asks for with `icon`, or a neutral one; on a page and on a terminal."""

from __future__ import annotations

import math
from dataclasses import dataclass

from markupsafe import Markup
from rich.cells import cell_len

from hvcpd.reporting.markup import tag
from hvcpd.reporting.palette import task_colour

RADIUS = 12.0
"""Half the side of the square that holds a mark, SVG units."""


@dataclass(frozen=True)
class Drawing:
    """A mark around (0, 0): the outline that is filled, strokes in it, and the character for a terminal."""

    outline: str
    strokes: str
    character: str


NEUTRAL = Drawing("M0-10 10 0 0 10-10 0Z", "", "◆")
_DRAWINGS = {
    "book": Drawing("M-11-8C-7-10-3-9 0-7 3-9 7-10 11-8V8C7 6 3 7 0 9-3 7-7 6-11 8Z", "M0-7V9", "▤"),
    "box": Drawing("M-10-5 0-11 10-5V6L0 11-10 6Z", "M-10-5 0 1 10-5M0 1V11", "▣"),
    "shelf": Drawing("M-10-11H10V11H-10Z", "M-10-3.7H10M-10 3.7H10", "☰"),
    "bottle": Drawing("M-3-11H3V-6C6-4 6-2 6 0V9Q6 11 4 11H-4Q-6 11-6 9V0C-6-2-6-4-3-6Z", "M-6 1H6", "▮"),
    "door": Drawing("M-7-11H7V11H-7Z", "M2.5 0H4", "▯"),
    "lamp": Drawing("M-6-11H6L10 2H-10Z", "M0 2V11M-5 11H5", "☼"),
    "tool": Drawing("M-10-10H6L11-6V-3H-10ZM-3-3H2V11H-3Z", "", "⚒"),
    "bin": Drawing("M-8-7H8L6 11H-6Z", "M-10-7H10M-3-10H3M-2.5-3-2 7M2.5-3 2 7", "▽"),
    "flag": Drawing("M-7-11H10L6-5.5 10 0H-7Z", "M-7-11V11", "⚑"),
}
FLOWER = "✿"


def drawn(icon: str, name: str) -> Markup:
    """The mark around (0, 0) of an SVG picture, within RADIUS, in the colour that the task's name holds."""
    colour = task_colour(name)
    if icon == "flower":
        return _flower(colour)
    if icon and icon not in _DRAWINGS:
        return tag("text", icon, class_="icon-text", y=6, text_anchor="middle", fill=colour)
    drawing = _DRAWINGS.get(icon, NEUTRAL)
    strokes = tag("path", d=drawing.strokes, class_="strokes") if drawing.strokes else Markup()
    return tag("g", tag("path", d=drawing.outline, fill=colour), strokes)


def _flower(colour: str) -> Markup:
    petals = []
    for k in range(5):
        angle = 2 * math.pi * k / 5 - math.pi / 2
        petals.append(tag("circle", cx=round(6.6 * math.cos(angle), 2), cy=round(6.6 * math.sin(angle), 2), r=5.4))
    return tag("g", *petals, tag("circle", class_="heart", r=4), fill=colour)


def badge(icon: str, name: str) -> Markup:
    """The mark as a small picture before a task's name."""
    box = f"{-RADIUS:g} {-RADIUS:g} {2 * RADIUS:g} {2 * RADIUS:g}"
    return tag("svg", drawn(icon, name), class_="icon", viewBox=box, width=16, height=16, aria_hidden="true")


def character(icon: str) -> str:
    """The mark for a terminal, one cell wide; the neutral one where the icon is wider than a cell."""
    if icon == "flower":
        return FLOWER
    if icon in _DRAWINGS:
        return _DRAWINGS[icon].character
    return icon if icon and cell_len(icon) == 1 else NEUTRAL.character
