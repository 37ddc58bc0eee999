"""What is heard as commands show it: sentences with speaker, addressee, text, confidence and seal, and halts."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

from hvcpd.control.output import show
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
"""The verdict of the team's key on a seal; any other is "wrong"."""
HALTS: dict[type[Event], tuple[str, str]] = {
    Held: ("hold", 'a robot stands still: this may be "stop"'),
    Released: ("release", "the word alone counts no more: the sentence around it does, if there is one"),
    Urgent: ("stop", 'a robot stops for good: this is "stop"'),
}
"""The names and the meanings of the events by which a robot halts, and goes on."""


class Teller:
    """Prints what is heard, at once. Times are seconds from the beginning of the recording, or of the listening."""

    def __init__(self, team: Team, sealing: Sealing | None, options: argparse.Namespace) -> None:
        self._book, self._sealing, self._json = team.phrasebook, sealing, options.json
        self._held = False
        self.sentences = 0
        """How many have been printed."""

    def tell(self, event: Event) -> None:
        """Print a sentence, or where a robot would halt; of several holds in a row the first."""
        start_s, end_s = event.start_sample / SAMPLE_RATE_HZ, event.end_sample / SAMPLE_RATE_HZ
        times = {"start_s": round(start_s, 3), "end_s": round(end_s, 3)}
        if isinstance(event, Recognised):
            self.sentences += 1
            fields, text = self._sentence(event, end_s)
            show(self._json, times | fields, line_at(start_s, end_s, text, f"{event.confidence:4.0%}"))
        elif type(event) in HALTS and not (self._held and isinstance(event, Held)):
            self._held = isinstance(event, Held)
            kind, meaning = HALTS[type(event)]
            show(self._json, times | {"event": kind}, line_at(start_s, end_s, f"[{meaning}]"))

    def _sentence(self, event: Recognised, end_s: float) -> tuple[dict[str, Any], str]:
        """A sentence for programs, and in words; one that was encrypted as it was meant, where there is the key."""
        utterance = self._book.parse(event.words)
        seal, is_cipher = None, isinstance(utterance.mark, Cipher)
        if self._sealing is not None and isinstance(utterance.mark, Seal | Cipher):
            utterance, verdict = self._sealing.judge(utterance, self._book, end_s)
            seal = _SEALS.get(verdict.trust, "wrong")
        text = written(utterance, self._book) if is_cipher else self._book.write(utterance)
        to = str(utterance.addressee) if utterance.addressee is not None else None
        fields = {"text": text, "speaker": utterance.speaker, "addressee": to, "confidence": round(event.confidence, 4)}
        fields |= ({"seal": seal} if seal is not None else {}) | ({"encrypted": True} if is_cipher else {})
        kind = "encrypted, seal" if is_cipher else "seal"
        return fields, f"{text}  [{kind} {seal}]" if seal is not None else text


def line_at(start_s: float, end_s: float, text: str, sure: str = "") -> str:
    """A line of what was heard from when to when, and how sure that is, if that is known."""
    return f"{start_s:8.2f} – {end_s:6.2f} s  {sure:4}  {text}"
