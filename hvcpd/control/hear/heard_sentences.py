"""What is heard as commands show it: sentences with speaker, addressee, text, confidence and seal, and halts."""

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
from hvcpd.recognition.events import Event, Held, Recognised, Released, Urgent
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
        *_seconds(event),
        written(utterance, team.phrasebook) if is_cipher else team.phrasebook.write(utterance),
        utterance.speaker,
        str(utterance.addressee) if utterance.addressee is not None else None,
        event.confidence,
        seal,
        is_cipher,
    )


HALTS: dict[type[Event], tuple[str, str]] = {
    Held: ("hold", 'a robot stands still: this may be "stop"'),
    Released: ("release", "the word alone counts no more: the sentence around it does, if there is one"),
    Urgent: ("stop", 'a robot stops for good: this is "stop"'),
}
"""The names and the meanings of the events by which a robot halts, and goes on."""


class Teller:
    """Prints what is heard, at once."""

    def __init__(self, team: Team, sealing: Sealing | None, options: argparse.Namespace) -> None:
        self._team, self._sealing, self._options = team, sealing, options
        self._held = False
        self.sentences = 0
        """How many have been printed."""

    def tell(self, event: Event) -> None:
        """Print a sentence, or where a robot would halt; of several holds in a row the first."""
        if isinstance(event, Recognised):
            self.sentences += 1
            sentence = sentence_of(event, self._team, self._sealing)
            self._write(as_json(sentence) if self._options.json else as_text(sentence))
        elif type(event) in HALTS and not (self._held and isinstance(event, Held)):
            self._held = isinstance(event, Held)
            start_s, end_s = _seconds(event)
            kind, shown = HALTS[type(event)]
            as_object = {"start_s": round(start_s, 3), "end_s": round(end_s, 3), "event": kind}
            self._write(json.dumps(as_object) if self._options.json else line_at(start_s, end_s, f"[{shown}]"))

    def _write(self, line: str) -> None:
        sys.stdout.write(line + "\n")


def _seconds(event: Event) -> tuple[float, float]:
    return event.start_sample / SAMPLE_RATE_HZ, event.end_sample / SAMPLE_RATE_HZ


def line_at(start_s: float, end_s: float, text: str, sure: str = "") -> str:
    """A line of what was heard from when to when, and how sure that is, if that is known."""
    return f"{start_s:8.2f} – {end_s:6.2f} s  {sure:4}  {text}"


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
    return line_at(s.start_s, s.end_s, s.text + seal, f"{s.confidence:4.0%}")
