"""`hvcpctl stop`, `resume` and `reload`: gives a running robot this command."""

from __future__ import annotations

import argparse
import json
from contextlib import closing
from pathlib import Path
from typing import Any

from hvcpd.control.live.daemon_client import DaemonClient, find_daemon, meant, running_sockets
from hvcpd.control.output import show
from hvcpd.daemon.control_protocol import LEARN_S
from hvcpd.errors import HvcpdError, NotDoneError


def run(options: argparse.Namespace) -> None:
    """Give the command, and report its result. "Stop" is for each robot that runs here and may be meant."""
    if options.command != "stop" or options.socket is not None:
        _give(options, find_daemon(options))
        return
    where = meant(options)
    is_chosen = options.config is not None or options.name is not None  # the system's settings choose no robot
    several = running_sockets(where, is_chosen)
    if len(several) < 2:
        _give(options, DaemonClient(several[0]) if several else find_daemon(options, where))
        return
    from concurrent.futures import ThreadPoolExecutor  # not for one robot, which must not wait for its import

    with ThreadPoolExecutor(len(several)) as pool:  # no robot waits for one that does not answer
        given = [pool.submit(_stop, options, path) for path in several]
    if faults := [fault for each in given if (fault := each.result()) is not None]:
        raise NotDoneError("; ".join(faults))


def _stop(options: argparse.Namespace, path: Path) -> str | None:
    """Stop the robot whose socket that is. Returns why that failed, or None."""
    try:
        _give(options, DaemonClient(path))
    except HvcpdError as error:
        return str(error)
    return None


def _give(options: argparse.Namespace, daemon: DaemonClient) -> None:
    with closing(daemon):
        if options.command == "reload":
            daemon.patience_s = LEARN_S
        result = daemon.ask(options.command)
        is_outdone = options.command != "reload" and result["stopped"] is (options.command == "resume")
        lines = [] if is_outdone else result_lines(options.command, daemon.name, result)
        show(options.json, {"name": daemon.name, **result}, *lines)
        if is_outdone:
            raise NotDoneError(f"{daemon.name} was {'stopped again' if result['stopped'] else 'released'} meanwhile")
        if result.get("kept") is False:
            now = "stands still" if result["stopped"] else "takes on tasks"
            raise NotDoneError(f"{daemon.name} {now}, but {result['reason']}")


def result_lines(command: str, name: str, result: dict[str, Any]) -> list[str]:
    """The result of a command to a robot, in lines for people."""
    if command == "stop":
        how = "was stopped already" if result["before"] else "stands still, and says so"
        return [f"{name} {how}; `hvcpctl resume` lets it take on tasks again"]
    if command == "resume":
        return [f"{name} takes on tasks again" if result["before"] else f"{name} was not stopped"]
    return _reloaded(name, result)


def _reloaded(name: str, result: dict[str, Any]) -> list[str]:
    lines = [_changed(change) for change in result["changed"]]
    if result["restart"]:
        lines.append(f"needs a restart of {name}: {', '.join(result['restart'])}")
    return lines or [f"{name}: nothing has changed"]


def _changed(change: dict[str, Any]) -> str:
    key, before, now = change["key"], change["before"], change["now"]
    if key.startswith("task ") and None in (before, now):
        return f"{key}, {now}: new" if before is None else f"{key}, {before}: gone"
    return f"{key}: {value_text(before)} → {value_text(now)}"


def value_text(value: object) -> str:
    """A setting as it is written in the file: as JSON, which is also YAML, but text without quotes."""
    return value if isinstance(value, str) and value.isprintable() else json.dumps(value, ensure_ascii=False)
