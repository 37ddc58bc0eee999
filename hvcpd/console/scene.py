"""The present state of a running robot as the page shows it; every change is sent to the viewers."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

from hvcpd.config.shared_places import SharedPlace
from hvcpd.console.alarms import alarms_of, was_given_up
from hvcpd.console.lines import Lines, SpeakerColours, line_of, line_of_row
from hvcpd.console.viewers import Message, Viewers
from hvcpd.reporting.events import Plant
from hvcpd.reporting.icons import badge
from hvcpd.reporting.map_svg import corners, draw_plan
from hvcpd.reporting.text import clean, shown_away, task_words

MAX_TRAIL = 4000
"""Points kept of a trail: 200 m, by STEP_M."""
STEP_M = 0.05
"""Between two points of a trail: less than the line's width on the map."""
SAME_WITHIN_S = 60.0
"""Largest difference of the wall clock between a row of the transcript and the event of the same kind, text and sample
time."""
KEPT_KEYS = 2000

Reply = Mapping[str, Any]


class Scene:
    """Takes a daemon's events and replies; `snapshot` returns the whole state, and every change goes to the viewers."""

    def __init__(self, viewers: Viewers) -> None:
        self.viewers = viewers
        self.lines = Lines()
        self._colours = SpeakerColours()
        self._status: Reply | None = None
        self._tasks: Sequence[Reply] = ()
        self._link: Message = {"kind": "link", "up": False, "text": "Looking for the robot …"}
        self._level: Message | None = None
        self._trail: deque[tuple[float, float]] = deque(maxlen=MAX_TRAIL)
        self._moved: Message | None = None
        self._plan, self._framed = "", (0.0, 0.0, 0.0, 0.0)
        self._offset_s = 0.0
        self._shown: deque[tuple[str, float, str, float]] = deque(maxlen=KEPT_KEYS)

    @property
    def name(self) -> str:
        """The robot's name; empty before it is known."""
        return clean(self._status["name"]) if self._status else ""

    def snapshot(self) -> Message:
        """All that a page needs to begin with."""
        parts = [self._robots(self._status), self._board(), self._alarms(self._status), self._link]
        parts += [self._level] if self._level else []
        return {
            "kind": "snapshot",
            "parts": parts,
            "plan": self._plan_message(),
            "lines": self.lines.page(),
            "first": self.lines.first,
        }

    def link(self, up: bool, text: str) -> None:
        """Note whether the daemon answers, with a message; on a change the viewers get a new snapshot."""
        before, self._link = self._link, {"kind": "link", "up": up, "text": text}
        if up and before != self._link:
            self.viewers.renew()
        elif before != self._link:
            self.viewers.tell(self._link)

    def status(self, status: Reply) -> None:
        """Take a reply to `status`; one of another shape raises an error, and is not kept."""
        before, areas = self.name, _areas(self._status)
        told = self._robots(status), self._alarms(status)
        self._offset_s = status["wall_s"] - status["now_s"]
        self._status = status
        if before != self.name:
            self._trail.clear()
        for message in told:
            self.viewers.tell(message)
        if _areas(status) != areas:
            self._draw()
        if status["pose"] is not None:
            self._move(status["pose"]["x_m"], status["pose"]["y_m"], status["pose"]["heading_deg"])

    def tasks(self, tasks: Sequence[Reply]) -> None:
        """Take a reply to `tasks`."""
        board, places = self._board(), _placed(self._tasks)
        self._tasks = tasks
        if self._board() != board:
            self.viewers.tell(self._board())
            self.viewers.tell(self._alarms(self._status))
        if _placed(tasks) != places:
            self._draw()

    def rows(self, rows: Sequence[Reply]) -> None:
        """Take rows of the transcript, oldest first, except those that were already shown as events."""
        for row in rows:
            at_s = row["wall_s"] or 0.0
            key = (row["kind"], round(row["at_s"], 3), row["text"] if row["kind"] != "garbled" else "")
            if not any(shown[:3] == key and abs(shown[3] - at_s) < SAME_WITHIN_S for shown in self._shown):
                self.lines.add(line_of_row(row, self._colours))

    def event(self, event: Reply) -> None:
        """Take an event."""
        match event.get("event"):
            case "moved":
                pose = event["poses"][0]
                self._move(pose["x_m"], pose["y_m"], math.degrees(pose["heading_rad"]))
            case "level":
                self._level = {"kind": "level", "level_dbfs": event["level_dbfs"], "floor_dbfs": event["floor_dbfs"]}
                self.viewers.tell(self._level)
            case _:
                self._line(event)

    def _line(self, event: Reply) -> None:
        line = line_of(event, event.get("at_s", 0.0) + self._offset_s, self._colours, self._task)
        if line is None:
            return
        spoken = line["sort"] in ("said", "heard")  # the transcript has all else as garbled, worded otherwise
        kind, text = (line["sort"], line["text"]) if spoken else ("garbled", "")
        self._shown.append((kind, round(event["at_s"], 3), text, line["at_s"]))
        self.viewers.tell({"kind": "line", "line": self.lines.add(line)})

    def _task(self, number: int) -> str:
        return task_words(number, next((task["name"] for task in self._tasks if task["number"] == number), None))

    def _move(self, x_m: float, y_m: float, heading_deg: float) -> None:
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            return
        if not self._trail or math.dist(self._trail[-1], (x_m, y_m)) >= STEP_M:
            self._trail.append((round(x_m, 3), round(y_m, 3)))
        place = {"x_m": round(x_m, 3), "y_m": round(y_m, 3), "heading_deg": round(heading_deg, 1)}
        moved = {"kind": "moved", "name": self.name, "slot": self._colours.of(self.name), **place}
        if moved != self._moved:
            self._moved = moved
            self.viewers.tell(moved)
            left, bottom, right, top = self._framed
            if not (left <= x_m <= right and bottom <= y_m <= top):
                self._draw()

    def _draw(self) -> None:
        """Draw the room again, with all tasks' places, those that only one robot fits in, and the whole trail."""
        areas = _areas(self._status)
        placed = [task for task in self._tasks if task["place"] is not None]
        plants = [Plant(t["number"], t["name"], t["place"]["x_m"], t["place"]["y_m"]) for t in placed]
        points = [(plant.x_m, plant.y_m) for plant in plants] + list(self._trail) + corners(areas)
        if points:
            xs, ys = zip(*points, strict=True)
            self._framed = (min(xs) - 0.5, min(ys) - 0.5, max(xs) + 0.5, max(ys) + 0.5)
        self._plan = draw_plan(plants, list(self._trail), {t["number"]: t.get("icon", "") for t in placed}, areas)
        self.viewers.tell(self._plan_message())

    def _plan_message(self) -> Message:
        trails = [{**self._moved, "points": list(self._trail)}] if self._moved is not None else []
        return {"kind": "plan", "svg": self._plan, "trails": trails}

    def _robots(self, status: Reply | None) -> Message:
        if status is None:
            return {"kind": "robots", "robots": [], "stopped": False}
        name, doing, task = clean(status["name"]), clean(status["doing"]), status["task"]
        own = {
            "name": name,
            "slot": self._colours.of(name),
            "team": clean(status["team"] or ""),
            "doing": doing + (f": {task_words(task['number'], task['name'])}" if task else ""),
            "present": True,
            "note": f"{status['battery_v']:.1f} V" if status["battery_v"] is not None else "",
        }
        peers = [self._peer(peer) for peer in sorted(status["peers"], key=lambda p: float(p["heard_ago_s"]))]
        return {"kind": "robots", "robots": [own, *peers], "stopped": status["stopped"], "speaking": status["speaking"]}

    def _peer(self, peer: Reply) -> dict[str, Any]:
        own = next((t for t in self._tasks if t["owner"] == peer["name"] and t["state"] == "claimed"), None)
        ago_s = float(peer["heard_ago_s"])
        ago = f"{ago_s:.0f} s" if ago_s < 90 else f"{ago_s / 60:.0f} min"
        far = shown_away(peer)
        return {
            "name": clean(peer["name"]),
            "slot": self._colours.of(peer["name"]),
            "team": clean(peer["team"] or ""),
            "doing": f"has {task_words(own['number'], own['name'])}" if own else "",
            "present": peer["present"],
            "note": f"heard {ago} ago, {100 * peer['confidence']:.0f} % sure" + (f", {far} away" if far else ""),
        }

    def _board(self) -> Message:
        rows = [
            {
                "number": task["number"],
                "hearsay": task["hearsay"],
                "state": "failed" if was_given_up(task) else task["state"],
                "name": clean(task["name"]),
                "owner": (owner := clean(task["owner"] or "")),
                "mark": badge(task.get("icon", ""), task["name"]),
                "slot": self._colours.of(owner) if owner else None,
            }
            for task in self._tasks
        ]
        return {"kind": "board", "tasks": rows}

    def _alarms(self, status: Reply | None) -> Message:
        return {"kind": "alarms", "alarms": alarms_of(status, self._tasks) if status else []}


def _areas(status: Reply | None) -> tuple[SharedPlace, ...]:
    """The places that only one robot fits in; daemons of older versions do not tell where they are."""
    places = status.get("places", ()) if status is not None else ()
    return tuple(SharedPlace(place["name"], **place["area"]) for place in places if "area" in place)


def _placed(tasks: Sequence[Reply]) -> list[tuple[Any, ...]]:
    """What the plan shows of the tasks."""
    return [(task["number"], task["name"], task["place"], task.get("icon", "")) for task in tasks]
