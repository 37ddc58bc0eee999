"""`hvcpctl task`: repeats or skips a task while the robots work; adds and removes tasks."""

from __future__ import annotations

import argparse
import json
from contextlib import closing
from typing import Any

from hvcpd.config.document import parse
from hvcpd.control.live.daemon_client import find_daemon
from hvcpd.control.live.short_commands import result_lines
from hvcpd.control.output import show
from hvcpd.daemon.control_protocol import LEARN_S
from hvcpd.errors import ConfigError

BECOMES = {"again": "is done once more", "skip": "is left out this time"}
"""The effect on a task, in words."""
OTHERS = {
    "add": "it starts when its words are ready; the other robots do not know it, so give each the same command",
    "remove": "the other robots keep it, so give each the same command",
}
"""Reminder for changes that robots do not announce to each other."""


def run(options: argparse.Namespace) -> None:
    """Give the robot the change; it announces repeats and skips to the others."""
    arguments: dict[str, Any] = {"do": options.do}
    arguments |= {"task": task_of(options)} if options.do == "add" else {"number": options.number}
    with closing(find_daemon(options)) as daemon:
        if options.do in OTHERS:
            daemon.patience_s = LEARN_S
        result = daemon.ask("task", **arguments)
        if options.do in OTHERS:
            lines = [*result_lines("reload", daemon.name, result), OTHERS[options.do]]
        else:
            lines = [f"task {options.number}, {result['name']}, {BECOMES[options.do]}: {daemon.name} tells the others"]
        show(options.json, {"robot": daemon.name, **result}, *lines)


def task_of(options: argparse.Namespace) -> dict[str, Any]:
    """The task, as a task file has it; the robot checks it. Raises ConfigError for what cannot be written so."""
    task: dict[str, Any] = {"number": options.number, "name": options.task_name}
    actions = [_action(text) for text in options.action]
    if options.place is not None:
        task["place"] = dict(zip(("x_m", "y_m"), options.place, strict=True))
        actions = actions if "go to place" in actions else ["go to place", *actions]
    if not actions:
        raise ConfigError("what is to be done? give a place, or an action, for example --action wait=5")
    task["actions"] = actions
    for key in ("after", "every", "priority", "deadline", "robots"):
        if getattr(options, key) is not None:
            task[key] = getattr(options, key)
    return task


def _action(text: str) -> object:
    """`wait=5`, or an action as the task file has it. Raises ConfigError for what is no YAML."""
    name, equals, value = text.partition("=")
    is_short = bool(equals) and not name.lstrip().startswith("{")
    document = parse((value if is_short else text).strip().encode("utf-8", "surrogateescape"), "--action")
    for fault in document.faults():
        raise ConfigError(fault)
    found = json.loads(json.dumps(document.value, default=str))  # no task has a date, so it is text
    return {name.strip(): found} if is_short else found
