"""The pictures of the README and of docs/console.md, drawn by a browser from the mission that the README shows."""

from __future__ import annotations

import asyncio
import io
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.terminal_theme import TerminalTheme
from rich.text import Text

from hvcpd.console.app import live_app
from hvcpd.console.guard import PageAccess
from hvcpd.console.scene import Scene
from hvcpd.console.viewers import Viewers
from hvcpd.ports import Pose
from hvcpd.reporting.events import Heard, Moved, Said, Started, Summary
from hvcpd.reporting.live import LiveView
from release.shown_mission import ShownMission
from tests.console.browser import MISSING, Served, chromium, look_like, until

__all__ = ["MISSING", "draw"]

REPORT_PX, CONSOLE_PX, PHONE_PX, CARD_PX = (1240, 1196), (1280, 860), (390, 780), (794, 1123)
TERMINAL = (88, 38)
"""Columns and rows."""
TRAIL_STEP_S = 0.5
TIDY = """
for (const figure of document.querySelectorAll('.figures div'))
  if (figure.textContent.includes('real time')) figure.remove();
"""
"""No measure of the clock on the wall, which differs from run to run."""
THEME = TerminalTheme(
    (41, 41, 41),
    (208, 208, 208),
    [
        *((41, 41, 41), (224, 108, 117), (152, 195, 121), (229, 192, 123)),
        *((97, 175, 239), (198, 120, 221), (86, 182, 194), (208, 208, 208)),
    ],
)


def draw(mission: ShownMission, folder: Path) -> list[Path]:
    """Draw all pictures into the folder; their paths."""
    drawn: list[Path] = []
    with chromium() as driver:

        def shoot(name: str, element: str | None = None) -> None:
            path = folder / f"{name}.png"
            driver.execute_script(TIDY)
            png = (
                driver.find_element("css selector", element).screenshot_as_png
                if element
                else driver.get_screenshot_as_png()
            )
            path.write_bytes(png)
            drawn.append(path)

        driver.execute_cdp_cmd("Emulation.setScrollbarsHidden", {"hidden": True})
        look_like(driver, *REPORT_PX)
        driver.get((mission.folder / "report.html").resolve().as_uri())
        shoot("report")
        _card(driver, mission.folder, shoot)
        _terminal(driver, mission, shoot)
        _console(driver, mission, shoot)
    return drawn


def _card(driver: Any, folder: Path, shoot: Callable[..., None]) -> None:
    command = [str(Path(sys.executable).parent / "hvcpctl"), "phrases", "--format", "html"]
    page = folder / "card.html"
    page.write_bytes(subprocess.run(command, stdout=subprocess.PIPE, check=True, timeout=60.0).stdout)
    look_like(driver, CARD_PX[0] + 60, CARD_PX[1])
    driver.get(page.resolve().as_uri())
    shoot("card", ".sheet")


def _terminal(driver: Any, mission: ShownMission, shoot: Callable[..., None]) -> None:
    page = mission.folder / "terminal.html"
    svg = terminal(mission)
    page.write_text(
        f"<!doctype html><meta charset=utf-8><style>body{{margin:0;width:1092px}}</style>{svg}", encoding="utf-8"
    )
    look_like(driver, 1092, 1000)
    driver.get(page.resolve().as_uri())
    shoot("terminal", "svg")


def terminal(mission: ShownMission) -> str:
    """The terminal as it was at the moment shown, as SVG; what had scrolled away is not in it."""
    columns, rows = TERMINAL
    size: dict[str, Any] = {"width": columns, "height": rows, "force_terminal": True, "color_system": "truecolor"}
    lines, picture = (Console(record=True, file=io.StringIO(), **size) for _ in range(2))
    view = LiveView(Console(file=io.StringIO(), **size), mission.started, lambda: 0.0)
    past = sorted(_on_the_bench(mission), key=lambda pair: pair[0])
    for at_s, event in past:
        if at_s <= mission.at_s:
            for line in view.lines(event):
                lines.print(line, highlight=False)
    picture.print(view.picture())
    shown = picture.export_text(styles=True, clear=True).rstrip("\n").split("\n")
    told = lines.export_text(styles=True, clear=True).rstrip("\n").split("\n")
    screen = Console(record=True, file=io.StringIO(), **size)
    for each in [*told[-(rows - len(shown)) :], *shown]:
        screen.print(Text.from_ansi(each), highlight=False, no_wrap=True, crop=False)
    return screen.export_svg(title="hvcpctl simulate --seed 2", theme=THEME)


def _on_the_bench(mission: ShownMission) -> list[tuple[float, Any]]:
    """The events with the times at which they came, and the robots' ways, which a transcript has not."""
    came: list[tuple[float, Any]] = []
    for event in mission.events:
        if not isinstance(event, Started | Summary):
            late_s = 4.0 if isinstance(event, Heard) else 0.0
            came.append((event.end_s if isinstance(event, Said) else event.at_s + late_s, event))
    for at_s in np.arange(0.0, mission.at_s, TRAIL_STEP_S).tolist():
        at = [(np.interp(at_s, t.t_s, t.x_m), np.interp(at_s, t.t_s, t.y_m)) for t in mission.trails]
        came.append((at_s, Moved(at_s, tuple(Pose(float(x), float(y)) for x, y in at))))
    return came


def _console(driver: Any, mission: ShownMission, shoot: Callable[..., None]) -> None:
    scene = Scene(Viewers())
    _tell(scene, mission)
    with Served(live_app(scene, _nobody, _nothing, PageAccess()), ending=scene.viewers.end).up() as show:
        for name, (width, height), scheme in (
            ("console-desktop", CONSOLE_PX, "light"),
            ("console-phone", PHONE_PX, "dark"),
        ):
            look_like(driver, width, height, scheme, phone=width < 500)
            driver.get(show.url)
            until(lambda: driver.find_elements("css selector", "#chat > li"))
            until(lambda: driver.find_elements("css selector", "#map svg .trail"))
            driver.execute_script("const chat = document.getElementById('chat'); chat.scrollTop = chat.scrollHeight")
            shoot(name)


async def _nobody(_command: str, **_arguments: Any) -> dict[str, Any]:
    """Takes commands of the page; nobody presses its buttons here."""
    return {}


async def _nothing() -> None:
    """Nothing comes after what the page was told before."""
    await asyncio.Event().wait()


def _tell(scene: Scene, mission: ShownMission) -> None:
    """All that the page is told of the robot until the moment shown."""
    scene.link(True, f"Connected to {mission.robot}")
    scene.status({**mission.status(), "pose": None})
    scene.tasks(mission.tasks())
    for event in mission.live_events():
        scene.event(event)
    for at_s in np.arange(0.0, mission.at_s, TRAIL_STEP_S).tolist():
        pose = mission.pose(at_s)
        heading = float(np.radians(pose["heading_deg"]))
        scene.event({"event": "moved", "at_s": at_s, "poses": [{**pose, "heading_rad": heading}]})
    status = mission.status()
    scene.event(
        {"event": "level", "level_dbfs": status["sound"]["level_dbfs"], "floor_dbfs": status["sound"]["floor_dbfs"]}
    )
    scene.status(status)
