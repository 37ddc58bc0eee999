"""`hvcpctl listen`: follows by ear what robots say, and decrypts it with the key."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

from hvcpd.assembly.make import make_ears
from hvcpd.config.settings import AudioSettings
from hvcpd.control.hear.heard_sentences import as_json, as_text, sealing_of, sentence_of
from hvcpd.control.simulate.team import load_team
from hvcpd.errors import EX_OK
from hvcpd.hardware.audio_capture import Block, capture
from hvcpd.recognition.events import Recognised

Capture = Callable[[AudioSettings], AbstractContextManager[Iterator[Block]]]


def run(options: argparse.Namespace, capture: Capture = capture) -> int:
    """Print each sentence when it is understood, until interrupted."""
    has_key = options.key not in (None, Path())
    team = load_team(options, options.names or (), sealed=options.key is not None, encrypted=has_key)
    sealing = sealing_of(options.key)
    settings = team.settings.audio
    with capture(replace(settings, input_device=options.device or settings.input_device)) as blocks:
        recogniser = make_ears(team.phrasebook, team.names, team.sound)
        sys.stderr.write(f"hvcpctl: listening for {', '.join(team.names)}; end with Ctrl-C\n")
        for sound, lost in blocks:
            events = recogniser.lost(lost) if lost is not None else []
            for event in [*events, *recogniser.push(sound)]:
                if isinstance(event, Recognised):
                    sentence = sentence_of(event, team, sealing)
                    sys.stdout.write((as_json(sentence) if options.json else as_text(sentence)) + "\n")
                    sys.stdout.flush()
    return EX_OK
