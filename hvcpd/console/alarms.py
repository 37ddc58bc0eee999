"""Alarms: the parts of a robot's state that a person must see at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from hvcpd.ports import WARN_BATTERY_V

State = Mapping[str, Any]
Alarm = dict[str, str]


def alarms_of(status: State, tasks: Sequence[State]) -> list[Alarm]:
    """The alarms of a `status` and a `tasks` reply (docs/control.md), each with an id that it keeps as long as it
    lasts."""
    return [{"id": id_, "text": text} for id_, text in _found(status, tasks)]


def was_given_up(task: State) -> bool:
    """Whether a robot has given a task up, and nobody has taken it over."""
    return bool(task["failed_by"]) and task["state"] == "open"


def _found(status: State, tasks: Sequence[State]) -> Iterator[tuple[str, str]]:
    name = status["name"]
    if status["stopped"]:
        yield "stopped", f"{name} is stopped, and stands until somebody says “resume”"
    if status.get("button_pressed"):
        yield "button", f"{name}'s stop button is pressed, or its wire is broken: nothing releases {name} meanwhile"
    wheels, sound = status["wheels"], status["sound"]
    if wheels is not None and wheels["fault"] is not None:
        yield "wheels", f"The wheels have failed: {wheels['fault']}"
    if status["state"] != "starting" and not sound["listening"]:
        yield "deaf", f"{name} hears nothing: no sound comes from the microphone"
    if sound.get("mute"):
        yield "mute", "The microphone is mute: it gives nothing but zeros"
    if sound.get("too_busy"):
        yield "busy", "The computer is too busy: sound is lost or late; end other programs"
    battery_v = status["battery_v"]
    if battery_v is not None and battery_v < WARN_BATTERY_V:
        yield "battery", f"The battery has {battery_v:.1f} V: charge it"
    memory = status["memory"]
    if memory.get("unkept"):
        yield "latch", f"{name}'s “stop” or “resume” is not kept: {memory['unkept']}"
    if memory.get("loss") and status["stopped"]:
        yield "loss", f"{name} has lost its memory, and started stopped: {memory['loss']}"
    if memory.get("fault"):
        yield "memory", f"{name} cannot save what it learns: {memory['fault']}"
    elif memory["lost"]:
        yield "memory", f"{memory['lost']} records could not be saved: is the disk full?"
    for task in tasks:
        if was_given_up(task):
            number, who = task["number"], " and ".join(task["failed_by"])
            yield f"task {number}", f"Task {number}, {task['name']}, was given up by {who}"
