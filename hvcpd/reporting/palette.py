"""Colours of robots, by their place in the team, and of tasks, by the colour word in their name; style sheets."""

from __future__ import annotations

import re
from importlib import resources

from markupsafe import Markup

ROBOT_LIGHT = (
    "#0b62a4 #b3470f #0a7355 #8a3b8f #7a6200 #c2255c #3b5bdb #557000 #8a5a44 #08717d #6741d9 #55606b"
).split()
ROBOT_DARK = ("#6cb6ff #ffa36b #4fd1a5 #e29be6 #e6c34a #ff8fb0 #9db4ff #b5d957 #d8a48f #5fd6e3 #b79cff #b0bac5").split()
"""Twelve hues, told apart best among the first; each has a contrast of 4.5 or more (WCAG 2.2, 1.4.3) to its page."""
ROBOT_TERMINAL = (
    "cyan magenta green yellow blue red bright_cyan bright_magenta bright_green bright_yellow bright_blue bright_red"
).split()
"""The terminal's own sixteen, which its user has chosen to be legible."""

TASK = {
    "red": "#d6303f",
    "crimson": "#b0123a",
    "scarlet": "#e03119",
    "pink": "#ec6aa0",
    "orange": "#f08c00",
    "gold": "#d4a017",
    "golden": "#d4a017",
    "yellow": "#f0c808",
    "lime": "#82c91e",
    "green": "#2f9e44",
    "teal": "#0f8f8f",
    "turquoise": "#22b8b8",
    "cyan": "#15aabf",
    "blue": "#1c7ed6",
    "indigo": "#4b3fbf",
    "violet": "#9b4ddb",
    "purple": "#862e9c",
    "magenta": "#c2259c",
    "brown": "#8a5a2b",
    "black": "#343a40",
    "grey": "#868e96",
    "gray": "#868e96",
    "silver": "#adb5bd",
    "white": "#f6f5f0",
}
TASK_TERMINAL = {
    "red": "red",
    "crimson": "red",
    "scarlet": "red",
    "orange": "dark_orange",
    "yellow": "yellow",
    "gold": "yellow",
    "green": "green",
    "blue": "blue",
    "indigo": "slate_blue3",
    "violet": "medium_purple",
    "purple": "purple",
    "pink": "hot_pink",
    "white": "bright_white",
}
NO_COLOUR = "#8a949e"


def robot_slot(index: int) -> int:
    """Which of the twelve colours the robot at `index` in the team has."""
    return index % len(ROBOT_LIGHT)


def task_colour(name: str) -> str:
    """The colour that a task's name holds, as #rrggbb; a grey if it holds none."""
    return next((TASK[word] for word in re.findall(r"[a-z]+", name.lower()) if word in TASK), NO_COLOUR)


def task_style(name: str) -> str:
    """Return the task's colour as a terminal's."""
    words = re.findall(r"[a-z]+", name.lower())
    return next((TASK_TERMINAL[word] for word in words if word in TASK_TERMINAL), "white")


def own_file(name: str) -> str:
    """The text of a file of this package."""
    return resources.files("hvcpd.reporting").joinpath(name).read_text(encoding="utf-8")


def style_sheet(*names: str) -> Markup:
    """These files one after the other, and the robots' colours: a class r0 to r11 sets --robot."""

    def block(colours: list[str]) -> str:
        return "".join(f".r{k}{{--robot:{colour}}}" for k, colour in enumerate(colours))

    light, dark = block(ROBOT_LIGHT), block(ROBOT_DARK)
    robots = f"{light}@media screen and (prefers-color-scheme:dark){{{dark}}}"
    return Markup("".join(map(own_file, names)) + robots)
