"""`hvcpctl listen`: follows by ear what robots say, and decrypts it with the key."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace

from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.config.settings import AudioSettings
from hvcpd.control.hear.heard_sentences import Teller, listening_team
from hvcpd.control.output import print_note
from hvcpd.hardware.audio_capture import Block, capture

Capture = Callable[[AudioSettings], AbstractContextManager[Iterator[Block]]]


def run(options: argparse.Namespace, capture: Capture = capture) -> None:
    """Print each sentence when it is understood, until interrupted."""
    team, sealing = listening_team(options)
    settings = team.settings.audio
    with capture(replace(settings, input_device=options.device or settings.input_device)) as blocks:
        recogniser = make_speech_recogniser(team.phrasebook, team.names, team.sound)
        print_note(f"listening for {', '.join(team.names)}; end with Ctrl-C")
        teller = Teller(team, sealing, options)
        for sound, lost in blocks:
            events = recogniser.lost(lost) if lost is not None else []
            for event in [*events, *recogniser.push(sound)]:
                teller.tell(event)
