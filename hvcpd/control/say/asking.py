"""Has a running robot say a sentence: what `hvcpctl say` does where the speaker runs on this computer."""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping
from typing import Any

from hvcpd.control.live.daemon_client import DaemonClient, find_daemon, find_daemon_of
from hvcpd.control.output import show
from hvcpd.errors import NotAllowedError, NotDoneError, NotRunningError

SAID_WITHIN_S = 60.0
"""Time for a robot's turn to come: seconds among few robots, up to a minute in a crowd that never falls silent."""

_SPEAKER = re.compile(r"\bi(?:\s+a|['’])?m\s+([a-z][a-z0-9]*)", re.IGNORECASE)


def daemon_that_says(options: argparse.Namespace) -> DaemonClient | None:
    """The daemon of the speaker in "I am …"; for a sentence without a name, the one that the options select."""
    if options.name is not None or options.socket is not None:
        return find_daemon(options)
    speaker = _SPEAKER.search(options.text)
    if speaker:
        return find_daemon_of(speaker[1], options)
    try:
        return find_daemon(options, noted=False)
    except (NotRunningError, NotAllowedError):
        return None


def have_it_said(options: argparse.Namespace, daemon: DaemonClient) -> None:
    """Wait for the robot's turn. Raises NotDoneError where it does not come."""
    daemon.ask("subscribe", events=["said"])
    text = daemon.ask("say", text=options.text)["text"]
    said = next((event for event in daemon.events(SAID_WITHIN_S) if _without_seal(event) == text), None)
    if said is None:
        raise NotDoneError(f"{daemon.name} had no chance to say it for {SAID_WITHIN_S:g} s")
    show(options.json, said, f"{daemon.name} says: {text}")


def _without_seal(said: Mapping[str, Any]) -> str:
    """The sentence of an event, without the words of its seal, which stand after the last comma."""
    text = str(said.get("text"))
    return text.rpartition(", ")[0] if said.get("seal") == "sealed" else text
