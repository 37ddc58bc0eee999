"""A mission as an animated SVG with captions: `python -m release.animation MISSION_DIR FILE.svg`.

CSS alone moves it, so that a page can show it as an image. Talk runs faster than it was, and silence much faster, so
that the captions can be read and nobody waits. For people who ask for less motion, the picture stands still at the end.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap

import numpy as np
from markupsafe import Markup

from hvcpd.reporting.events import Heard, Performed, Plant, Said, TaskChanged, Trail
from hvcpd.reporting.icons import drawn
from hvcpd.reporting.map_svg import Frame, fit
from hvcpd.reporting.markup import joined, tag
from hvcpd.reporting.palette import ROBOT_DARK, ROBOT_LIGHT, robot_slot
from hvcpd.reporting.text import clock, number
from release.shown_mission import ShownMission, read_mission

TALK_RATE, SILENCE_RATE = 2.0, 14.0
"""How much faster than it was: two to three seconds a sentence are enough to read it."""
LINGER_S = 1.0
"""Of the mission's time after a sentence, at the rate of talk: who reads is behind who speaks."""
REST_S = 4.0
"""The end of the mission stays this long before it begins anew."""
WIDTH, HEIGHT = 880, 450
MAP_LEFT, MAP_TOP, MAP_SCALE = 16, 16, 0.56
LIST_LEFT, LIST_TOP, LIST_STEP = 456, 92, 46
CAPTION_TOP, LINE_STEP, STATUS_TOP = 380, 26, 434
CAPTION_CHARACTERS = 62
"""A line of a caption: the widest of the fonts takes 13 px a character, and the picture has 832."""


@dataclass(frozen=True)
class Film:
    """Maps the mission's time to the film's: rising moments of the mission, s, and of the film, s."""

    mission_s: tuple[float, ...]
    film_s: tuple[float, ...]

    @property
    def length_s(self) -> float:
        """With the rest at its end."""
        return self.film_s[-1] + REST_S

    def at(self, mission_s: float) -> float:
        """The share of the film, 0 to 1, at which a moment of the mission is shown."""
        return float(np.interp(mission_s, self.mission_s, self.film_s)) / self.length_s


def make_film(talk: Iterable[tuple[float, float]], end_s: float) -> Film:
    """The film of a mission with sentences from one time to another, s, in their order."""
    moments, shown = [0.0], [0.0]

    def go_on(until_s: float, rate: float) -> None:
        if until_s > moments[-1]:
            shown.append(shown[-1] + (until_s - moments[-1]) / rate)
            moments.append(until_s)

    for begin_s, finish_s in talk:
        go_on(min(begin_s, end_s), SILENCE_RATE)
        go_on(min(finish_s + LINGER_S, end_s), TALK_RATE)
    go_on(end_s, SILENCE_RATE)
    return Film(tuple(moments), tuple(shown))


class Animation:
    """Elements that change with the mission's time, and the style sheet that changes them."""

    def __init__(self, film: Film) -> None:
        self._film = film
        self._rules: list[str] = []

    def shown(self, begin_s: float | None, end_s: float | None, *children: str, **attributes: str | float) -> Markup:
        """A group that is seen from one time of the mission to another; None: from its begin, to its end."""
        steps = [(0.0, "opacity:0"), (begin_s, "opacity:1")] if begin_s is not None else [(0.0, "opacity:1")]
        if end_s is not None:
            steps.append((end_s, "opacity:0"))
        name = self._animate(steps, "step-end")
        at_the_end = {} if end_s is None else {"opacity": 0}
        return tag("g", *children, style=name, **attributes, **at_the_end)

    def along(self, times_s: Sequence[float], write: Callable[[int], str]) -> str:
        """The style of an element that has the property `write(k)` at the k-th time, and glides between."""
        return self._animate([(at_s, write(k)) for k, at_s in enumerate(times_s)], "linear")

    def _animate(self, steps: Sequence[tuple[float, str]], timing: str) -> str:
        name = f"a{len(self._rules)}"
        frames = [f"{number(100 * self._film.at(at_s), 2)}%{{{what}}}" for at_s, what in steps]
        frames.append(f"100%{{{steps[-1][1]}}}")
        self._rules.append(f"@keyframes {name}{{{''.join(frames)}}}")
        return f"animation:{name} {number(self._film.length_s, 2)}s {timing} infinite"

    @property
    def style_sheet(self) -> str:
        """All that moves."""
        return "".join(self._rules)


def draw(mission: ShownMission) -> str:
    """The film of a mission as one SVG document."""
    said = [event for event in mission.events if isinstance(event, Said)]
    end_s = max(float(trail.t_s[-1]) for trail in mission.trails)
    animation = Animation(make_film([(each.at_s, each.end_s) for each in said], end_s))
    plants = mission.started.plants
    starts = [(pose.x_m, pose.y_m) for pose in mission.started.starts]
    frame = fit([(plant.x_m, plant.y_m) for plant in plants] + starts)
    slots = {name: robot_slot(k) for k, name in enumerate(mission.started.robots)}
    floor = tag(
        "g",
        _floor(frame),
        *(_place(frame, plant, mission, animation) for plant in plants),
        *(_robot(frame, trail, slots[trail.robot], said, animation) for trail in mission.trails),
        transform=f"translate({MAP_LEFT} {MAP_TOP}) scale({MAP_SCALE})",
    )
    board = [_board_row(k, plant, mission, slots, animation) for k, plant in enumerate(plants)]
    captions = _captions(mission, said, slots, animation, end_s)
    title = "A mission: robots share out tasks by speaking. Their sentences are shown as they are said."
    return tag(
        "svg",
        tag("title", title),
        tag("style", Markup(_STYLE + _robot_colours() + animation.style_sheet + _STILL)),
        tag("rect", class_="page", width=WIDTH, height=HEIGHT, rx=12),
        floor,
        tag("text", "Who does what", class_="head", x=LIST_LEFT, y=46),
        *board,
        *captions,
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {WIDTH} {HEIGHT}",
        width=WIDTH,
        height=HEIGHT,
        role="img",
    )


def _floor(frame: Frame) -> Markup:
    x0, y1 = frame.at(frame.left_m, frame.bottom_m)
    width, height = frame.size
    top = y1 - height
    columns = [x0 + k * frame.step_m * frame.scale for k in range(1, round(frame.wide_m / frame.step_m))]
    rows = [top + k * frame.step_m * frame.scale for k in range(1, round(frame.high_m / frame.step_m))]
    lines = "".join(
        [*(f"M{x:.0f} {top:.0f}V{y1:.0f}" for x in columns), *(f"M{x0:.0f} {y:.0f}H{x0 + width:.0f}" for y in rows)]
    )
    return joined(
        [
            tag("rect", class_="floor", x=x0, y=round(top, 1), width=round(width, 1), height=round(height, 1), rx=6),
            tag("path", class_="grid", d=lines),
        ]
    )


def _place(frame: Frame, plant: Plant, mission: ShownMission, animation: Animation) -> Markup:
    x, y = frame.at(plant.x_m, plant.y_m)
    icon = drawn(dict(mission.started.icons).get(plant.task, ""), plant.name)
    done_s = _done_s(mission, plant.task)
    return tag(
        "g",
        tag("g", icon, opacity=0.35),
        *([animation.shown(done_s, None, icon)] if done_s is not None else []),
        tag("text", plant.task, class_="number", x=24, y=9),
        transform=f"translate({x:.0f} {y:.0f}) scale(1.5)",
    )


def _robot(frame: Frame, trail: Trail, slot: int, said: Sequence[Said], animation: Animation) -> Markup:
    points = [frame.at(x, y) for x, y in zip(trail.x_m.tolist(), trail.y_m.tolist(), strict=True)]
    steps = np.hypot(*np.diff(np.array(points), axis=0).T)
    gone = np.concatenate([[0.0], np.cumsum(steps)]) / max(float(steps.sum()), 1e-9)
    times_s = trail.t_s.tolist()
    drive = animation.along(times_s, lambda k: f"transform:translate({points[k][0]:.0f}px,{points[k][1]:.0f}px)")
    trace = animation.along(times_s, lambda k: f"stroke-dashoffset:{number(1 - float(gone[k]), 4)}")
    rings = [
        animation.shown(each.at_s, each.end_s, tag("circle", class_="speaks", r=30))
        for each in said
        if each.speaker == trail.robot
    ]
    end = f"translate({points[-1][0]:.0f} {points[-1][1]:.0f})"
    way = " ".join(f"{x:.0f},{y:.0f}" for x, y in points)
    above_or_below = 46 if slot % 2 else -28  # robots start side by side, where two names would run together
    return tag(
        "g",
        tag("polyline", class_="trail", points=way, pathLength=1, style=trace),
        tag(
            "g", *rings, tag("circle", class_="robot", r=18),
            tag("text", trail.robot, class_="name", y=above_or_below), transform=end, style=drive,
        ),
        class_=f"r{slot}",
    )  # fmt: skip


def _board_row(k: int, plant: Plant, mission: ShownMission, slots: dict[str, int], animation: Animation) -> Markup:
    """One task: open, claimed by a robot, done by it."""
    icon = drawn(dict(mission.started.icons).get(plant.task, ""), plant.name)
    claims = [
        event
        for event in mission.events
        if isinstance(event, TaskChanged) and event.task == plant.task and event.owner == event.robot
    ]
    claimed = next(((event.at_s, event.robot) for event in claims if event.state == "claimed"), None)
    done_s = _done_s(mission, plant.task)
    words = [animation.shown(None, claimed[0] if claimed else None, _state("open"))]
    if claimed:
        colour = f"r{slots[claimed[1]]}"
        words.append(animation.shown(claimed[0], done_s, _state(f"{claimed[1]} will do it"), class_=colour))
        if done_s is not None:
            words.append(animation.shown(done_s, None, _state(f"✓ {claimed[1]} has done it"), class_=colour))
    return tag(
        "g",
        tag("g", icon, transform="translate(14 -6)"),
        tag("text", f"{plant.task}  {plant.name}", class_="task", x=36),
        *words,
        transform=f"translate({LIST_LEFT} {LIST_TOP + k * LIST_STEP})",
    )


def _state(text: str) -> Markup:
    return tag("text", text, class_="state", x=262)


def _captions(
    mission: ShownMission, said: Sequence[Said], slots: dict[str, int], animation: Animation, end_s: float
) -> list[Markup]:
    """Each sentence from its begin to the next one's, with who understood it."""
    begins = [each.at_s for each in said]
    shown = []
    for k, each in enumerate(said):
        until_s = begins[k + 1] if k + 1 < len(said) else None
        first, *others = wrap(f"{each.speaker}: “{each.text}”", CAPTION_CHARACTERS)
        speaker, said_first = first[: len(each.speaker) + 2], first[len(each.speaker) + 2 :]
        text = [
            tag("tspan", speaker, class_=f"speaker r{slots[each.speaker]}"),
            tag("tspan", said_first),
            *(tag("tspan", line, x=24, dy=LINE_STEP) for line in others),
        ]
        shown.append(animation.shown(each.at_s, until_s, tag("text", *text, class_="caption", x=24, y=CAPTION_TOP)))
        if understood := _understood(mission, each):
            at_s = max(event.at_s for event in understood)
            line = "; ".join(f"{event.listener} understood it, {event.confidence:.0%} sure" for event in understood)
            line = tag("text", line, class_="sure", x=24, y=STATUS_TOP)
            shown.append(animation.shown(max(at_s, each.end_s), until_s, line))
    seconds = [tag("text", clock(at_s), class_="clock", x=WIDTH - 24, y=STATUS_TOP) for at_s in (*begins, end_s)]
    return shown + [
        animation.shown(at_s, (*begins, end_s)[k + 1] if k < len(begins) else None, seconds[k])
        for k, at_s in enumerate((*begins, end_s))
    ]


def _understood(mission: ShownMission, said: Said) -> list[Heard]:
    return [e for e in mission.events if isinstance(e, Heard) and e.utterance == said.utterance and e.text == said.text]


def _done_s(mission: ShownMission, task: int) -> float | None:
    return next((e.at_s for e in mission.events if isinstance(e, Performed) and e.task == task), None)


def _robot_colours() -> str:
    light = "".join(f".r{k}{{--robot:{colour}}}" for k, colour in enumerate(ROBOT_LIGHT[:2]))
    dark = "".join(f".r{k}{{--robot:{colour}}}" for k, colour in enumerate(ROBOT_DARK[:2]))
    return f"{light}@media(prefers-color-scheme:dark){{{dark}}}"


_STYLE = (
    "svg{--page:#fbfaf7;--floor:#fff;--ink:#1c2126;--soft:#5b6570;--grid:#e7e3da}"
    "@media(prefers-color-scheme:dark){svg{--page:#14171a;--floor:#1c2024;--ink:#e8eaec;--soft:#9aa5b1;--grid:#2a2f35}}"
    "text{font:17px system-ui,'Segoe UI',Roboto,'Liberation Sans',Arial,sans-serif;fill:var(--ink);white-space:pre}"
    ".page{fill:var(--page)}.floor{fill:var(--floor);stroke:var(--grid)}.grid{stroke:var(--grid);fill:none}"
    ".head,.speaker{font-weight:600}.number{font-size:15px;fill:var(--soft)}"
    ".state,.sure,.clock{font-size:15px;fill:var(--robot,var(--soft))}"
    ".caption{font-size:21px}.speaker{fill:var(--robot)}.clock{text-anchor:end}"
    ".trail{fill:none;stroke:var(--robot);stroke-width:3;stroke-dasharray:1;opacity:.55}"
    ".robot{fill:var(--robot)}.name{fill:var(--robot);font-size:24px;font-weight:600;text-anchor:middle}"
    ".speaks{fill:none;stroke:var(--robot);stroke-width:4;opacity:.6}"
)
_STILL = "@media(prefers-reduced-motion:reduce){*{animation:none!important}}"


def main(arguments: Sequence[str]) -> int:
    """Draw the mission of a folder that `hvcpctl simulate --report` has written."""
    parser = argparse.ArgumentParser(prog="release.animation", description="Draw a mission as a moving picture.")
    parser.add_argument("folder", type=Path, help="what `hvcpctl simulate --report` has written")
    parser.add_argument("file", metavar="FILE.svg", type=Path)
    options = parser.parse_args(arguments)
    options.file.write_text(draw(read_mission(options.folder)) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
