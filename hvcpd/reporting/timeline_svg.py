"""The timeline of who did what: a lane for each robot, as inline SVG beside a column of names."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from markupsafe import Markup

from hvcpd.reporting.events import Performed, Trail
from hvcpd.reporting.markup import joined, tag
from hvcpd.reporting.palette import robot_slot, task_colour
from hvcpd.reporting.story import Line, OnSpan, SkillSpan, Span, Story
from hvcpd.reporting.text import clock, without_common_start

_MIN_WIDTH = 1080.0
UNITS_PER_S = 1.5
"""An utterance of 4 s stays 6 units wide; longer missions scroll sideways."""
_MAX_WIDTH = 12_000.0
LANE = 62.0
"""Height of a robot's lane, SVG units and CSS pixels: its speech above, its task below."""
_SPEECH_Y, _SPEECH_HEIGHT, _TASK_Y, _TASK_HEIGHT, _DRIVE_HEIGHT = 8.0, 16.0, 28.0, 24.0, 4.0
_AXIS = 26.0
_PAD = 20.0
_CHARACTER = 7.4
"""Width of a letter, SVG units: of wide letters in the widest of the page's fonts, at 12 pixels."""
_TICK = 7.0
"""Radius of the mark at the end of a task that was carried out."""
MOVING_M_S = 0.02
"""Slower is standing still: a tenth of the drive's speed, above the wheels' jitter."""
_STEP_S = 0.5
_TICKS_S = (
    5,
    10,
    15,
    30,
    60,
    120,
    300,
    600,
    1200,
    3600,
    7200,
    10800,
    21600,
    43200,
    *(86400 * d for d in (1, 2, 7, 28)),
)


def draw_timeline(
    story: Story,
    trails: Sequence[Trail],
    as_time: Callable[[float], str] = clock,
    clock_s: float = 0.0,
    units_per_s: float = UNITS_PER_S,
) -> Markup:
    """The chart, with the names before it in a column that stays when the chart scrolls.

    `as_time` writes a time of the story; `clock_s` is what its clock shows at the beginning, so that ticks are round;
    `units_per_s` is how wide a second is at least, SVG units.
    """
    width = min(max(_MIN_WIDTH, story.end_s * units_per_s), _MAX_WIDTH)
    scale = width / story.end_s
    height = LANE * len(story.robots) + _AXIS
    shorts = dict(
        zip((t.number for t in story.tasks), without_common_start([t.name for t in story.tasks]), strict=True)
    )
    parts = [_axis(story.end_s, scale, height - _AXIS, as_time, clock_s)]
    for k, robot in enumerate(story.robots):
        moving = next((driving(trail) for trail in trails if trail.robot == robot), [])
        parts.append(_lane(story, k, robot, moving, shorts, scale, as_time))
    parts.append(
        tag("line", class_="cursor", id="cursor", x1=0, x2=0, y1=0, y2=height - _AXIS, data_scale=f"{scale:.6f}")
    )
    chart = tag(
        "svg",
        tag("title", "Timeline: who spoke, drove and worked when"),
        tag("g", *parts, transform=f"translate({_PAD:g} 0)"),
        class_="timeline",
        id="timeline",
        data_pad=_PAD,
        width=width + 2 * _PAD,
        height=height,
        viewBox=f"0 0 {width + 2 * _PAD:.1f} {height:.1f}",
        role="img",
    )
    names = [tag("div", name, class_=f"r{robot_slot(k)}") for k, name in enumerate(story.robots)]
    return tag(
        "div",
        tag("div", *names, class_="names"),
        tag("div", chart, class_="scroll", tabindex="0", role="group", aria_label="Timeline, scrolls sideways"),
        class_="gantt",
    )


def driving(trail: Trail) -> list[tuple[float, float]]:
    """When the robot moved, as (from_s, to_s)."""
    if len(trail.t_s) < 2 or trail.t_s[-1] <= trail.t_s[0]:
        return []
    times = np.arange(trail.t_s[0], trail.t_s[-1] + _STEP_S, _STEP_S)
    x, y = np.interp(times, trail.t_s, trail.x_m), np.interp(times, trail.t_s, trail.y_m)
    moving = np.hypot(np.diff(x), np.diff(y)) > MOVING_M_S * _STEP_S
    edges = np.flatnonzero(np.diff(np.concatenate([[0], moving.astype(np.int8), [0]])))
    return [(float(times[a]), float(times[b])) for a, b in edges.reshape(-1, 2)]


def _axis(end_s: float, scale: float, height: float, as_time: Callable[[float], str], clock_s: float) -> Markup:
    wide = _CHARACTER * max(len(as_time(at_s)) for at_s in (0.0, end_s))
    step_s = next((step for step in _TICKS_S if step * scale >= wide + _PAD), _TICKS_S[-1])
    parts = []
    for k in range(math.ceil(clock_s / step_s), int((clock_s + end_s) / step_s) + 1):
        at_s = k * step_s - clock_s
        x = at_s * scale
        parts.append(tag("line", class_="grid", x1=x, x2=x, y1=0, y2=height))
        if min(x, end_s * scale - x) >= wide / 2 - _PAD:  # else the picture's edge would cut it
            parts.append(tag("text", as_time(at_s), class_="scale", x=x, y=height + 18, text_anchor="middle"))
    return joined(parts)


def _lane(
    story: Story,
    k: int,
    robot: str,
    moving: list[tuple[float, float]],
    shorts: dict[int, str],
    scale: float,
    as_time: Callable[[float], str],
) -> Markup:
    spans = [_span(span, story, shorts, scale, as_time) for span in story.spans if span.robot == robot]
    drives = [_drive(from_s, to_s, scale, as_time) for from_s, to_s in moving]
    used = [_skill(span, scale, as_time) for span in story.skills if span.last.robot == robot]
    speech = [_speech(line, robot_slot(k), scale, as_time) for line in story.lines if line.said.speaker == robot]
    ticks = [_tick(act, scale, as_time) for act in story.performed if act.robot == robot]
    used += [_on(span, scale, as_time) for span in story.switched if span.on.robot == robot]
    base = tag("line", class_="grid", x1=0, x2=story.end_s * scale, y1=LANE, y2=LANE)
    return tag("g", base, *spans, *drives, *used, *speech, *ticks, transform=f"translate(0 {k * LANE:g})")


def _tick(act: Performed, scale: float, as_time: Callable[[float], str]) -> Markup:
    """A check mark where a task was carried out."""
    at = f"translate({act.at_s * scale:.1f} {_TASK_Y + _TASK_HEIGHT / 2:g})"
    title = tag("title", f"{act.robot} finished task {act.task} at {as_time(act.at_s)}")
    hook = tag("path", d="M-3 0-1 2.5 3-2.5")
    return tag("g", title, tag("circle", r=_TICK), hook, class_="carried-out", transform=at)


def _span(span: Span, story: Story, shorts: dict[int, str], scale: float, as_time: Callable[[float], str]) -> Markup:
    task = next((t for t in story.tasks if t.number == span.task), None)
    name = task.name if task else f"task {span.task}"
    x, wide = span.from_s * scale, max((span.to_s - span.from_s) * scale, 2.0)
    title = f"{span.robot}, task {span.task}: {name}, {as_time(span.from_s)} to {as_time(span.to_s)}, {span.ended}"
    fit = int((wide - 2 * _TICK - 6) / _CHARACTER)
    words = next((w for w in (f"{span.task} {shorts.get(span.task, '')}", f"{span.task}") if len(w) <= fit), "")
    bar = tag("rect", x=x, y=_TASK_Y, width=wide, height=_TASK_HEIGHT, rx=3, fill=task_colour(name))
    text = tag("text", words, x=x + _TICK + 3, y=_TASK_Y + 15) if words else None
    return tag("g", tag("title", title), bar, text, class_="span" if span.ended == "done" else "span broken")


def _drive(from_s: float, to_s: float, scale: float, as_time: Callable[[float], str]) -> Markup:
    y = _TASK_Y + _TASK_HEIGHT - _DRIVE_HEIGHT
    title = tag("title", f"driving, {as_time(from_s)} to {as_time(to_s)}")
    wide = max((to_s - from_s) * scale, 1.0)
    return tag("rect", title, class_="drive", x=from_s * scale, y=y, width=wide, height=_DRIVE_HEIGHT)


def _skill(span: SkillSpan, scale: float, as_time: Callable[[float], str]) -> Markup:
    """When a skill was in use; its words tell what it was told and what came of it."""
    title = tag("title", f"{span.words}, {as_time(span.from_s)} to {as_time(span.last.at_s)}")
    x, wide = span.from_s * scale, max((span.last.at_s - span.from_s) * scale, 2.0)
    y, kind = _TASK_Y + _TASK_HEIGHT - _DRIVE_HEIGHT, "skill" if span.is_done else "skill failed"
    return tag("rect", title, class_=kind, x=x, y=y, width=wide, height=_DRIVE_HEIGHT)


def _on(span: OnSpan, scale: float, as_time: Callable[[float], str]) -> Markup:
    """When a pump, or whatever else is switched, was truly on."""
    title = tag("title", f"{span.on.skill} on {as_time(span.on.at_s)}, off {as_time(span.off_s)}")
    x, wide = span.on.at_s * scale, max((span.off_s - span.on.at_s) * scale, 2.0)
    return tag("rect", title, class_="switched", x=x, y=_TASK_Y, width=wide, height=_DRIVE_HEIGHT)


def _speech(line: Line, slot: int, scale: float, as_time: Callable[[float], str]) -> Markup:
    said = line.said
    kind = " collided" if said.collided else "" if any(h.text == said.text for h in line.heard) else " unheard"
    title = tag("title", f"{as_time(said.at_s)} {said.speaker}: {said.text}")
    wide = max((said.end_s - said.at_s) * scale, 2.0)
    return tag(
        "rect",
        title,
        class_=f"speech r{slot}{kind}",
        x=said.at_s * scale,
        y=_SPEECH_Y,
        width=wide,
        height=_SPEECH_HEIGHT,
        rx=2,
        data_utterance=said.utterance,
    )
