"""A recorded mission as the page plays it: the initial state, and every later change with its time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hvcpd.console.lines import Mark, confidence_note, make_line, mark, seal_notes
from hvcpd.console.viewers import Message
from hvcpd.errors import ConfigError
from hvcpd.reporting.events import MissionRecord, Performed, TaskChanged, Trail
from hvcpd.reporting.icons import badge
from hvcpd.reporting.map_svg import draw_plan
from hvcpd.reporting.palette import robot_slot
from hvcpd.reporting.story import Line, Story, tell
from hvcpd.reporting.text import clean, listed, task_words
from hvcpd.reporting.transcript import read_trails, read_transcript
from hvcpd.reporting.watching import Watch

FRAME_S = 0.2
"""Interval between a robot's positions; short enough for smooth motion on the map."""

Step = tuple[float, Message]


@dataclass(frozen=True)
class Recording:
    """A mission's folder, read: its title, what the page plays, and the path of its sound, if there is any."""

    title: str
    messages: Message
    sound: Path | None


def read_recording(folder: Path) -> Recording:
    """What `hvcpctl simulate --report` has written into a folder. Raises ConfigError."""
    transcript, trails, sound = (folder / name for name in ("transcript.jsonl", "trails.jsonl", "mission.wav"))
    if not transcript.is_file():
        raise ConfigError(f"{folder} has no transcript.jsonl: name the folder that `hvcpctl simulate --report` made")
    record = MissionRecord(
        read_transcript(transcript), read_trails(trails) if trails.is_file() else (), np.zeros(0, np.float32)
    )
    story = tell(record)
    if not story.robots:
        raise ConfigError(f"{transcript} has no robot")
    has_sound = sound.is_file()
    messages = {
        "begin": _begin(story, record),
        "steps": [{"at_s": round(at_s, 3), "message": message} for at_s, message in _steps(story, record)],
        "duration_s": round(story.end_s, 3),
        "has_sound": has_sound,
    }
    return Recording(f"{listed(story.robots)}, recorded", messages, sound if has_sound else None)


def _begin(story: Story, record: MissionRecord) -> Message:
    plants = story.started.plants
    starts = [(pose.x_m, pose.y_m) for pose in story.started.starts]
    ways = [(x, y) for t in record.trails for x, y in zip(t.x_m.tolist(), t.y_m.tolist(), strict=True)]
    trails = [
        {"name": clean(name), "slot": robot_slot(k), "points": [], "x_m": pose.x_m, "y_m": pose.y_m}
        for k, (name, pose) in enumerate(zip(story.started.robots, story.started.starts, strict=False))
    ]
    drawn = draw_plan(plants, starts + ways, dict(story.started.icons), story.started.places)
    plan = {"kind": "plan", "svg": drawn, "trails": trails}
    board = _board(Watch(story.started), story)
    return {"kind": "snapshot", "parts": [_robots(story, 0.0), board], "plan": plan}


def _steps(story: Story, record: MissionRecord) -> list[Step]:
    """All changes in order of time; lines are numbered in this order."""
    turns_s = sorted({at_s for span in story.spans for at_s in (span.from_s, span.to_s)})
    steps = [*_spoken(story), *_boards(story, record), *((at_s, _robots(story, at_s)) for at_s in turns_s)]
    for trail in record.trails:
        steps += _moves(trail, story.slots.get(trail.robot, 0))
    steps.sort(key=lambda step: step[0])
    lines = [message["line"] for _, message in steps if message["kind"] == "line"]
    for number, line in enumerate(lines):
        line["n"] = number
    return steps


def _spoken(story: Story) -> Iterator[Step]:
    slots, names = story.slots, {task.number: task.name for task in story.tasks}
    for line in story.lines:
        said = line.said
        yield _line(said.at_s, "said", said.speaker, said.text, _marks(line), slots.get)
    for act in story.performed:
        text = f"has carried out {task_words(act.task, names.get(act.task))}"
        yield _line(act.at_s, "act", act.robot, text, [], slots.get)


def _line(at_s: float, *line: Any) -> Step:
    return at_s, {"kind": "line", "line": make_line(at_s, *line)}


def _marks(line: Line) -> list[Mark]:
    """The robots that heard it, with their confidence, and those that did not."""
    marks = [mark("bad", "collided with another voice")] if line.said.collided else []
    marks += seal_notes(line.said.seal)
    for heard in line.heard:
        if heard.text == line.said.text:
            sure = confidence_note(heard.confidence, heard.snr_db)
            marks.append({**sure, "text": f"{clean(heard.listener)} {sure['text']}"})
        else:
            marks.append(mark("odd", f"{clean(heard.listener)} understood: “{clean(heard.text)}”"))
    for verb, names in (("garbled at", line.garbled), ("not heard by", line.missed)):
        if names:
            marks.append(mark("bad", f"{verb} {clean(listed(names))}"))
    return marks


def _boards(story: Story, record: MissionRecord) -> Iterator[Step]:
    watch = Watch(story.started)
    changes = sorted((e for e in record.events if isinstance(e, TaskChanged | Performed)), key=lambda e: e.at_s)
    before = _board(watch, story)
    for event in changes:
        watch.handle(event)
        board = _board(watch, story)
        if board != before:
            before = board
            yield event.at_s, board


def _board(watch: Watch, story: Story) -> Message:
    slots, icons = story.slots, dict(story.started.icons)
    rows = [
        {
            "number": row.task,
            "name": clean(row.name),
            "state": row.state,
            "owner": clean(row.owner or ""),
            "slot": slots.get(row.owner or ""),
            "hearsay": False,
            "mark": badge(icons.get(row.task, ""), row.name),
        }
        for row in watch.board()
    ]
    return {"kind": "board", "tasks": rows}


def _robots(story: Story, at_s: float) -> Message:
    """The robots and their tasks at that time."""
    names = {task.number: task.name for task in story.tasks}
    robots = []
    for k, robot in enumerate(story.robots):
        span = next((s for s in story.spans if s.robot == robot and s.from_s <= at_s < s.to_s), None)
        doing = clean(f"has {task_words(span.task, names.get(span.task))}" if span else "")
        own = {"name": clean(robot), "slot": robot_slot(k), "team": "", "doing": doing, "present": True, "note": ""}
        robots.append(own)
    return {"kind": "robots", "robots": robots, "stopped": False, "speaking": False}


def _moves(trail: Trail, slot: int) -> Iterator[Step]:
    """Where the robot is, FRAME_S after FRAME_S as long as it moves."""
    if len(trail.t_s) < 2:
        return
    times = np.arange(float(trail.t_s[0]), float(trail.t_s[-1]) + FRAME_S, FRAME_S)
    places = np.stack([np.interp(times, trail.t_s, axis) for axis in (trail.x_m, trail.y_m)], axis=1)
    last = places[0]
    for at_s, place in zip(times.tolist(), places, strict=True):
        way = place - last
        if math.hypot(*way) < 1e-3:
            continue
        heading = math.degrees(math.atan2(way[1], way[0]))
        last = place
        moved = {"kind": "moved", "name": clean(trail.robot), "slot": slot, "heading_deg": round(heading)}
        yield at_s, {**moved, "x_m": round(float(place[0]), 3), "y_m": round(float(place[1]), 3)}
