"""`hvcpctl range`: has a running robot ask another one how far it is, and tells the distance."""

from __future__ import annotations

import argparse
from contextlib import closing
from typing import Any

from hvcpd.control.live.daemon_client import DaemonClient, find_daemon
from hvcpd.control.output import show
from hvcpd.errors import NotDoneError, PhraseError
from hvcpd.reporting.text import clean

WITHIN_S = 60.0
"""Three sentences take 20 s; in a busy team the robot's turn may come after half a minute."""


def run(options: argparse.Namespace) -> None:
    """Ask, wait for the distance, and print it. Raises NotDoneError if none was measured."""
    with closing(find_daemon(options)) as daemon:
        robot = _peer(daemon, options.robot)["name"]
        daemon.ask("subscribe", events=["heard", "noted"])
        daemon.ask("say", text=f"Hi {robot}, I am {daemon.name}, how far are you")
        text = _measured(daemon, robot)
        away = _peer(daemon, robot)["away"]
    show(options.json, {"robot": robot, **away}, clean(text))


def _peer(daemon: DaemonClient, name: str) -> dict[str, Any]:
    """A robot that the daemon has heard. Raises PhraseError if there is none of that name."""
    peers: list[dict[str, Any]] = daemon.ask("status")["peers"]
    for peer in peers:
        if str(peer["name"]).lower() == name.lower():
            return peer
    known = ", ".join(str(peer["name"]) for peer in peers) or "nobody"
    raise PhraseError(f"{daemon.name} has heard no robot '{name}'; it knows {known}")


def _measured(daemon: DaemonClient, robot: str) -> str:
    for event in daemon.events(WITHIN_S):
        if str(event.get("speaker")).lower() != robot.lower():
            continue
        text = str(event.get("text"))
        if event.get("event") == "noted" and text.startswith(f"{event['speaker']} is "):
            return text
        if event.get("event") == "heard" and "I cannot measure it" in text:
            raise NotDoneError(f"{robot} or {daemon.name} drives, or did not hear well enough; ask again")
    raise NotDoneError(f"no distance to {robot} in {WITHIN_S:g} s: a sentence was missed; ask again")
