"""The mission that the README shows, as its first robot knew it at one moment: for the status and for the pictures."""

from __future__ import annotations

import io
import math
from collections import Counter
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from hvcpd import __version__
from hvcpd.control.live.short_commands import result_lines
from hvcpd.control.live.status_screen import status_screen
from hvcpd.coordination.states import State
from hvcpd.reporting.events import Event, Heard, Performed, Said, Started, TaskChanged, Trail
from hvcpd.reporting.story import task_names
from hvcpd.reporting.transcript import read_trails, read_transcript

SHARE = 0.65
"""Least share of the mission that has passed at the moment shown: some tasks are done, some are under way."""
WALL_S = datetime(2026, 11, 22, 14, 30).timestamp()
"""When the mission began, for a page that shows the clock on the wall."""
BATTERY_V, LEVEL_DBFS, FLOOR_DBFS = 11.9, -62.0, -63.0
"""What a robot in a quiet room measures; the simulated one has no battery."""
COLUMNS = 78
MOVING_M = 0.1
"""Farther than this in a second is driving: half of what a robot does at its usual speed."""


@dataclass(frozen=True)
class ShownMission:
    """A mission's folder, its events and trails, and the moment that is shown, s."""

    folder: Path
    events: tuple[Event, ...]
    trails: tuple[Trail, ...]
    at_s: float

    @property
    def started(self) -> Started:
        """Its first event."""
        return next(event for event in self.events if isinstance(event, Started))

    @property
    def robot(self) -> str:
        """Whose view is shown."""
        return self.started.robots[0]

    def past(self) -> list[Event]:
        """What had happened by the moment shown; a sentence when it ended."""
        return [event for event in self.events if _known_s(event) <= self.at_s]

    def pose(self, at_s: float) -> dict[str, float]:
        """Where the robot was: x_m, y_m and heading_deg."""
        trail = next(each for each in self.trails if each.robot == self.robot)
        (x, y), (later_x, later_y) = (
            (float(np.interp(t, trail.t_s, trail.x_m)), float(np.interp(t, trail.t_s, trail.y_m)))
            for t in (at_s, at_s + 1.0)
        )
        heading = math.degrees(math.atan2(later_y - y, later_x - x))
        return {"x_m": round(x, 2), "y_m": round(y, 2), "heading_deg": round(heading, 1)}

    def tasks(self) -> list[dict[str, Any]]:
        """The robot's board, as `hvcpctl tasks --json` has it."""
        names, icons = task_names(self.started), dict(self.started.icons)
        places = {plant.task: {"x_m": plant.x_m, "y_m": plant.y_m} for plant in self.started.plants}
        known: dict[int, tuple[str, str | None]] = {}
        for event in self.past():
            if isinstance(event, TaskChanged) and event.robot == self.robot:
                known[event.task] = (event.state, event.owner)
        return [
            {
                "number": number,
                "name": name,
                "icon": icons.get(number, ""),
                "state": known.get(number, ("open", None))[0],
                "owner": known.get(number, ("open", None))[1],
                "hearsay": False,
                "lease_s": None,
                "failed_by": [],
                "unable": False,
                "place": places.get(number),
            }
            for number, name in names.items()
        ]

    def status(self) -> dict[str, Any]:
        """The robot's status, as `hvcpctl status --json` has it."""
        board = self.tasks()
        own = next((task for task in board if (task["state"], task["owner"]) == ("claimed", self.robot)), None)
        moving = self.is_under_way()
        state = State.READY if own is None else State.GOING if moving else State.PROPOSED
        return {
            "name": self.robot,
            "team": "plant",
            "mode": self.started.mode,
            "version": __version__,
            "uptime_s": self.at_s,
            "state": state.name.lower(),
            "doing": state.value,
            "stopped": False,
            "speaking": False,
            "task": {"number": own["number"], "name": own["name"]} if own else None,
            "tasks": dict(Counter(task["state"] for task in board)),
            "wall_s": WALL_S + self.at_s,
            "now_s": self.at_s,
            "pose": self.pose(self.at_s),
            "peers": self._peers(),
            "battery_v": BATTERY_V,
            "sound": {"listening": True, "level_dbfs": LEVEL_DBFS, "floor_dbfs": FLOOR_DBFS, "mute": False, "lost": {}},
            "wheels": {"driver": "auto", "fault": None, "turning": moving},
            "memory": {"file": "rob.sqlite3", "lost": 0},
        }

    def is_under_way(self) -> bool:
        """Whether the robot drives."""
        before, now = self.pose(self.at_s - 1.0), self.pose(self.at_s)
        return math.hypot(now["x_m"] - before["x_m"], now["y_m"] - before["y_m"]) > MOVING_M

    def _peers(self) -> list[dict[str, Any]]:
        last = {e.speaker: e for e in self.past() if isinstance(e, Heard) and e.listener == self.robot}
        return [
            {
                "name": name,
                "team": "plant",
                "present": True,
                "heard_ago_s": round(self.at_s - event.at_s, 1),
                "confidence": event.confidence,
                "snr_db": event.snr_db,
            }
            for name, event in last.items()
        ]

    def status_lines(self) -> tuple[str, ...]:
        """What `hvcpctl status` would print of it."""
        console = Console(file=io.StringIO(), width=COLUMNS, highlight=False, color_system=None)
        with console.capture() as captured:
            console.print(status_screen(self.status()))
        return tuple(line.rstrip() for line in captured.get().rstrip("\n").split("\n"))

    def stop_lines(self) -> tuple[str, ...]:
        """What `hvcpctl stop` would print then."""
        return tuple(result_lines("stop", self.robot, {"before": False}))

    def live_events(self) -> list[dict[str, Any]]:
        """What the robot's daemon would have told of the past, as docs/control.md has it."""
        from hvcpd.reporting.events import as_json

        own = [
            event
            for event in self.past()
            if (isinstance(event, Said) and event.speaker == self.robot)
            or (isinstance(event, Heard) and event.listener == self.robot)
            or (isinstance(event, Performed | TaskChanged) and event.robot == self.robot)
        ]
        return [as_json(event) for event in sorted(own, key=lambda event: event.at_s)]


def _known_s(event: Event) -> float:
    return event.end_s if isinstance(event, Said) else getattr(event, "at_s", math.inf)


def read_mission(folder: Path) -> ShownMission:
    """The mission that `hvcpctl simulate --report` has kept in a folder."""
    events = read_transcript(folder / "transcript.jsonl")
    trails = read_trails(folder / "trails.jsonl")
    end_s = max(float(trail.t_s[-1]) for trail in trails)
    moments = [ShownMission(folder, events, trails, float(at_s)) for at_s in range(round(SHARE * end_s), round(end_s))]
    return next((moment for moment in moments if moment.is_under_way()), moments[0])
