"""`hvcpctl listen`: follows by ear what robots say, and decrypts it with the key."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace

from hvcpd.assembly.make import make_ears
from hvcpd.config.settings import AudioSettings
from hvcpd.control.hear.heard_sentences import listening_team, sentence_of, tell
from hvcpd.errors import EX_OK
from hvcpd.hardware.audio_capture import Block, capture
from hvcpd.recognition.events import Recognised

Capture = Callable[[AudioSettings], AbstractContextManager[Iterator[Block]]]


def run(options: argparse.Namespace, capture: Capture = capture) -> int:
    """Print each sentence when it is understood, until interrupted."""
    team, sealing = listening_team(options)
    settings = team.settings.audio
    with capture(replace(settings, input_device=options.device or settings.input_device)) as blocks:
        recogniser = make_ears(team.phrasebook, team.names, team.sound)
        sys.stderr.write(f"hvcpctl: listening for {', '.join(team.names)}; end with Ctrl-C\n")
        for sound, lost in blocks:
            events = recogniser.lost(lost) if lost is not None else []
            for event in [*events, *recogniser.push(sound)]:
                if isinstance(event, Recognised):
                    tell(sentence_of(event, team, sealing), options)
    return EX_OK
