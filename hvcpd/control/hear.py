"""`hvcpctl hear`: every sentence in a recording."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from hvcpd.assembly import make_recogniser
from hvcpd.control.soundfile import read_wav
from hvcpd.control.team import Team, load_team
from hvcpd.language.messages import ToAll, ToRobot, ToTeam, Utterance
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Recognised

BLOCK = 1600
"""Samples pushed at once, 0.1 s; the size changes no result."""


@dataclass(frozen=True)
class HeardSentence:
    """One sentence of a recording; times are seconds from its beginning."""

    start_s: float
    end_s: float
    text: str
    speaker: str | None
    addressee: str | None
    confidence: float


def run(options: argparse.Namespace) -> int:
    """List the sentences, as text or as one JSON object a line."""
    samples = read_wav(options.file)
    team = load_team(options, options.names or ())
    count = 0
    for sentence in sentences(samples, team):
        count += 1
        sys.stdout.write((_as_json(sentence) if options.json else _as_text(sentence)) + "\n")
        sys.stdout.flush()
    if count == 0 and not options.json:
        sys.stderr.write(
            f"hvcpctl: no sentence of the phrasebook in {options.file} "
            f"({len(samples) / SAMPLE_RATE_HZ:.1f} s; names known: {', '.join(team.names)})\n"
        )
    return 0


def sentences(samples: Samples, team: Team) -> Iterator[HeardSentence]:
    """Every sentence that the recogniser reports in a recording, in order."""
    recogniser = make_recogniser(team.phrasebook, team.names, team.sound)
    for start in range(0, len(samples), BLOCK):
        yield from _reports(recogniser.push(samples[start : start + BLOCK]), team)
    yield from _reports(recogniser.flush(), team)


def _reports(events: list[Event], team: Team) -> Iterator[HeardSentence]:
    for event in events:
        if isinstance(event, Recognised):
            utterance = team.phrasebook.parse(event.words)
            yield HeardSentence(
                event.start_sample / SAMPLE_RATE_HZ,
                event.end_sample / SAMPLE_RATE_HZ,
                team.phrasebook.write(utterance),
                utterance.speaker,
                _addressee(utterance),
                event.confidence,
            )


def _addressee(utterance: Utterance) -> str | None:
    match utterance.addressee:
        case ToRobot(name):
            return name
        case ToTeam(team):
            return f"team {team}"
        case ToAll():
            return "all"
        case None:
            return None


def _as_json(s: HeardSentence) -> str:
    return json.dumps(
        {
            "start_s": round(s.start_s, 3),
            "end_s": round(s.end_s, 3),
            "text": s.text,
            "speaker": s.speaker,
            "addressee": s.addressee,
            "confidence": round(s.confidence, 4),
        }
    )


def _as_text(s: HeardSentence) -> str:
    return f"{s.start_s:8.2f} – {s.end_s:6.2f} s  {s.confidence:4.0%}  {s.text}"
