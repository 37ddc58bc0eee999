"""The timeline of who did what: a lane for each robot, as inline SVG beside a column of names."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

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
_LOW_Y = _TASK_Y + _TASK_HEIGHT - _DRIVE_HEIGHT
"""Of the bars along a task's lower edge."""
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
    *(5, 10, 15, 30),
    *(60 * minutes for minutes in (1, 2, 5, 10, 20)),
    *(3600 * hours for hours in (1, 2, 3, 6, 12)),
    *(86400 * days for days in (1, 2, 7, 28, 112, 336)),
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
    lanes = _Lanes(story, scale, as_time)
    parts = [_axis(story.end_s, scale, height - _AXIS, as_time, clock_s)]
    for k, robot in enumerate(story.robots):
        moving = next((driving(trail) for trail in trails if trail.robot == robot), [])
        parts.append(lanes.draw(k, robot, moving))
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
    distinct = [step for step in _TICKS_S if as_time(step - clock_s) != as_time(-clock_s)]  # without seconds: minutes
    step_s = next((step for step in distinct if step * scale >= wide + _PAD), _TICKS_S[-1])
    parts = []
    for k in range(math.ceil(clock_s / step_s), int((clock_s + end_s) / step_s) + 1):
        at_s = k * step_s - clock_s
        x = at_s * scale
        parts.append(tag("line", class_="grid", x1=x, x2=x, y1=0, y2=height))
        if min(x, end_s * scale - x) >= wide / 2 - _PAD:  # else the picture's edge would cut it
            parts.append(tag("text", as_time(at_s), class_="scale", x=x, y=height + 18, text_anchor="middle"))
    return joined(parts)


class _Lanes:
    """Draws the robots' lanes; `scale`: SVG units a second."""

    def __init__(self, story: Story, scale: float, as_time: Callable[[float], str]) -> None:
        self._story, self._scale, self._as_time = story, scale, as_time
        shorts = without_common_start([task.name for task in story.tasks])
        self._shorts = {task.number: short for task, short in zip(story.tasks, shorts, strict=True)}

    def draw(self, k: int, robot: str, moving: Iterable[tuple[float, float]]) -> Markup:
        """The lane number `k`, of that robot, which drove at these times (from_s, to_s)."""
        story = self._story
        base = tag("line", class_="grid", x1=0, x2=story.end_s * self._scale, y1=LANE, y2=LANE)
        parts = [self._span(span) for span in story.spans if span.robot == robot]
        parts += [self._bar("drive", f"driving, {self._during(*way)}", way, _LOW_Y, least=1.0) for way in moving]
        parts += [self._skill(span) for span in story.skills if span.last.robot == robot]
        parts += [self._on(span) for span in story.switched if span.on.robot == robot]
        parts += [self._speech(line, robot_slot(k)) for line in story.lines if line.said.speaker == robot]
        parts += [self._tick(act) for act in story.performed if act.robot == robot]
        return tag("g", base, *parts, transform=f"translate(0 {k * LANE:g})")

    def _during(self, from_s: float, to_s: float) -> str:
        return f"{self._as_time(from_s)} to {self._as_time(to_s)}"

    def _bar(
        self, kind: str, title: str, when: tuple[float, float], y: float, least: float = 2.0, **more: float
    ) -> Markup:
        """A bar from one time to another, `least` units wide at least."""
        x, wide = when[0] * self._scale, max((when[1] - when[0]) * self._scale, least)
        box = {"x": x, "y": y, "width": wide, "height": _DRIVE_HEIGHT} | more
        return tag("rect", tag("title", title), class_=kind, **box)

    def _span(self, span: Span) -> Markup:
        task = next((t for t in self._story.tasks if t.number == span.task), None)
        name = task.name if task else f"task {span.task}"
        x, wide = span.from_s * self._scale, max((span.to_s - span.from_s) * self._scale, 2.0)
        title = f"{span.robot}, task {span.task}: {name}, {self._during(span.from_s, span.to_s)}, {span.ended}"
        fit = int((wide - 2 * _TICK - 6) / _CHARACTER)
        labels = (f"{span.task} {self._shorts.get(span.task, '')}", f"{span.task}")
        words = next((w for w in labels if len(w) <= fit), "")
        bar = tag("rect", x=x, y=_TASK_Y, width=wide, height=_TASK_HEIGHT, rx=3, fill=task_colour(name))
        text = tag("text", words, x=x + _TICK + 3, y=_TASK_Y + 15) if words else None
        return tag("g", tag("title", title), bar, text, class_="span" if span.ended == "done" else "span broken")

    def _skill(self, span: SkillSpan) -> Markup:
        """When a skill was in use; its words tell what it was told and what came of it."""
        title = f"{span.words}, {self._during(span.from_s, span.last.at_s)}"
        return self._bar("skill" if span.is_done else "skill failed", title, (span.from_s, span.last.at_s), _LOW_Y)

    def _on(self, span: OnSpan) -> Markup:
        """When a pump, or whatever else is switched, was truly on."""
        title = f"{span.on.skill} on {self._as_time(span.on.at_s)}, off {self._as_time(span.off_s)}"
        return self._bar("switched", title, (span.on.at_s, span.off_s), _TASK_Y)

    def _speech(self, line: Line, slot: int) -> Markup:
        said = line.said
        kind = " collided" if said.collided else "" if any(h.text == said.text for h in line.heard) else " unheard"
        title = f"{self._as_time(said.at_s)} {said.speaker}: {said.text}"
        more = {"height": _SPEECH_HEIGHT, "rx": 2, "data_utterance": said.utterance}
        return self._bar(f"speech r{slot}{kind}", title, (said.at_s, said.end_s), _SPEECH_Y, **more)

    def _tick(self, act: Performed) -> Markup:
        """A check mark where a task was carried out."""
        at = f"translate({act.at_s * self._scale:.1f} {_TASK_Y + _TASK_HEIGHT / 2:g})"
        title = tag("title", f"{act.robot} finished task {act.task} at {self._as_time(act.at_s)}")
        hook = tag("path", d="M-3 0-1 2.5 3-2.5")
        return tag("g", title, tag("circle", r=_TICK), hook, class_="carried-out", transform=at)
