"""Sentences as commands show them: speaker, addressee, text, confidence and seal."""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path

from hvcpd.control.simulate.team import Team, load_team
from hvcpd.language.messages import Cipher, Seal
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Recognised
from hvcpd.robot.sealing import Sealing, written
from hvcpd.security.guard import Guard
from hvcpd.security.keyring import keep_out_of_dumps, read_key_file
from hvcpd.security.silence import Patience
from hvcpd.security.trust import Trust

FAR_CIPHER = 1 << 18
"""Messages of a robot that has spoken for months are found from the second on; the search takes 2 s (x86)."""


@dataclass(frozen=True)
class HeardSentence:
    """One sentence; times are seconds from the beginning of the recording, or of the listening."""

    start_s: float
    end_s: float
    text: str
    speaker: str | None
    addressee: str | None
    confidence: float
    seal: str | None = None
    """The verdict of the team's key on its seal: "right", "wrong" or "used"; None without a seal, or without a key."""
    encrypted: bool = False
    """Whether it was said in code words; with the key `text` is what was meant."""


def listening_team(options: argparse.Namespace) -> tuple[Team, Sealing | None]:
    """The team that the options describe and, with the key in a file, what judges its seals and reads its messages.
    What was said before is unknown: it may begin far ahead."""
    path, has_key = options.key, options.key not in (None, Path())
    team = load_team(options, options.names or (), sealed=path is not None, encrypted=has_key)
    if not has_key:
        return team, None
    keep_out_of_dumps()
    ring = read_key_file(path).ring(None)
    return team, Sealing(Guard("", ring, patience=Patience(free=math.inf), far_cipher=FAR_CIPHER))


_SEALS = {Trust.FRESH: "right", Trust.SEALED: "right", Trust.AHEAD: "right", Trust.USED: "used"}


def sentence_of(event: Recognised, team: Team, sealing: Sealing | None) -> HeardSentence:
    """The sentences, by the team's phrasebook and, if there is one, its key."""
    utterance = team.phrasebook.parse(event.words)
    seal, is_cipher = None, isinstance(utterance.mark, Cipher)
    if sealing is not None and isinstance(utterance.mark, Seal | Cipher):
        utterance, verdict = sealing.judge(utterance, team.phrasebook, event.end_sample / SAMPLE_RATE_HZ)
        seal = _SEALS.get(verdict.trust, "wrong")
    return HeardSentence(
        event.start_sample / SAMPLE_RATE_HZ,
        event.end_sample / SAMPLE_RATE_HZ,
        written(utterance, team.phrasebook) if is_cipher else team.phrasebook.write(utterance),
        utterance.speaker,
        str(utterance.addressee) if utterance.addressee is not None else None,
        event.confidence,
        seal,
        is_cipher,
    )


def tell(s: HeardSentence, options: argparse.Namespace) -> None:
    """Print a sentence, at once."""
    sys.stdout.write((as_json(s) if options.json else as_text(s)) + "\n")
    sys.stdout.flush()


def as_json(s: HeardSentence) -> str:
    """The sentence as one JSON object."""
    return json.dumps(
        {
            "start_s": round(s.start_s, 3),
            "end_s": round(s.end_s, 3),
            "text": s.text,
            "speaker": s.speaker,
            "addressee": s.addressee,
            "confidence": round(s.confidence, 4),
        }
        | ({"seal": s.seal} if s.seal is not None else {})
        | ({"encrypted": True} if s.encrypted else {})
    )


def as_text(s: HeardSentence) -> str:
    """The sentence as a line."""
    kind = "encrypted, seal" if s.encrypted else "seal"
    seal = f"  [{kind} {s.seal}]" if s.seal is not None else ""
    return f"{s.start_s:8.2f} – {s.end_s:6.2f} s  {s.confidence:4.0%}  {s.text}{seal}"
