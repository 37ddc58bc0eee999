"""`hvcpctl say`: one sentence of the phrasebook, by a running robot, to the loudspeaker or to a file.

A robot that runs on this computer says a sentence in its name itself, when its turn comes. With --local, or with an
option about the sound (-o, --as, --voice, --rate, --gain-db, --natural, --lombard), this command makes the sound.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from contextlib import closing

from hvcpd.control.live.daemon_client import DaemonClient, find_daemon, find_daemon_of
from hvcpd.errors import EX_OK, NotAllowedError, NotDoneError, NotRunningError

SAID_WITHIN_S = 60.0
"""Time for a robot's turn to come: seconds among few robots, up to a minute in a crowd that never falls silent."""

_SPEAKER = re.compile(r"\bi\s+am\s+([a-z][a-z0-9]*)", re.IGNORECASE)


def run(options: argparse.Namespace) -> int:
    """Have the sentence said by its speaker's daemon, or speak it in that voice."""
    daemon = None if _makes_the_sound(options) else _daemon_that_says(options)
    if daemon is None:
        from hvcpd.control.say.speaking import speak  # not where a robot says it: this loads the synthesizer

        return speak(options)
    with closing(daemon):
        return _have_it_said(options, daemon)


def _makes_the_sound(options: argparse.Namespace) -> bool:
    chosen = (options.output, options.voice_of, options.voice)
    delivery = (options.rate, options.gain_db, options.lombard) != (1.0, 0.0, False)
    return bool(options.local or options.natural or delivery or any(each is not None for each in chosen))


def _daemon_that_says(options: argparse.Namespace) -> DaemonClient | None:
    """The daemon of the speaker in "I am …"; for a sentence without a name, the one that the options select."""
    if options.name is not None or options.socket is not None:
        return find_daemon(options)
    speaker = _SPEAKER.search(options.text)
    if speaker:
        return find_daemon_of(speaker[1], options)
    try:
        return find_daemon(options)
    except (NotRunningError, NotAllowedError):
        return None


def _have_it_said(options: argparse.Namespace, daemon: DaemonClient) -> int:
    daemon.ask("subscribe", events=["said"])
    text = daemon.ask("say", text=options.text)["text"]
    try:
        said = next(event for event in daemon.events(SAID_WITHIN_S) if event.get("text") == text)
    except NotDoneError:
        raise NotDoneError(f"{daemon.name} had no chance to say it for {SAID_WITHIN_S:g} s") from None
    if options.json:
        sys.stdout.write(json.dumps(said) + "\n")
    else:
        sys.stdout.write(f"{daemon.name} says: {text}\n")
    return EX_OK
