"""`hvcpctl hear`: every sentence in a recording."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hvcpd.assembly import make_recogniser
from hvcpd.control.team import Team, load_team
from hvcpd.errors import AudioFileError, PhraseError
from hvcpd.hardware.soundfile import read_wav
from hvcpd.keyring import keep_out_of_dumps, read_key_file
from hvcpd.language.messages import Cipher, Seal, ToAll, ToRobot, ToTeam, Utterance
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Recognised
from hvcpd.sealing import Sealing, written
from hvcpd.security.guard import Guard
from hvcpd.security.silence import Patience
from hvcpd.security.trust import Trust

FAR_CIPHER = 1 << 18
"""Messages of a robot that has spoken for months are found from the second on; the search takes 2 s (x86)."""
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
    seal: str | None = None
    """What the team's key says of its seal: "right", "wrong" or "used"; None without a seal, or without a key."""
    encrypted: bool = False
    """It was said in code words; with the key `text` is what was meant."""


def run(options: argparse.Namespace) -> int:
    """List the sentences, as text or as one JSON object a line."""
    if options.learn_alternatives:
        from hvcpd.control import learn_alternatives

        return learn_alternatives.run(options)
    if options.said:
        raise PhraseError("--said tells --learn-alternatives what was said; give both")
    if len(options.file) > 1:
        raise AudioFileError("hear lists the sentences of one recording; several are for --learn-alternatives")
    [file] = options.file
    samples = read_wav(file)
    team = load_team(
        options, options.names or (), sealed=options.key is not None, encrypted=options.key not in (None, Path())
    )
    sealing = _sealing(options.key)
    if options.plot:
        _check_folder(options.plot)
    count = 0
    events: list[Event] = []
    for event in events_in(samples, team):
        events.append(event)
        if not isinstance(event, Recognised):
            continue
        sentence = _sentence(event, team, sealing)
        count += 1
        sys.stdout.write((_as_json(sentence) if options.json else _as_text(sentence)) + "\n")
        sys.stdout.flush()
    if count == 0 and not options.json:
        sys.stderr.write(
            f"hvcpctl: no sentence of the phrasebook in {file} "
            f"({len(samples) / SAMPLE_RATE_HZ:.1f} s; names known: {', '.join(team.names)})\n"
        )
    if options.plot:
        _draw(options.plot, samples, events, file.name)
    return 0


def _check_folder(path: Path) -> None:
    """Before the listening, which may take minutes."""
    if not path.parent.is_dir():
        raise AudioFileError(f"--plot: {path} cannot be written: there is no folder {path.parent}; name another")
    if path.is_dir():
        raise AudioFileError(f"--plot: {path} cannot be written: it is a folder; name a file in it")


def _draw(path: Path, samples: Samples, events: list[Event], title: str) -> None:
    from hvcpd.reporting.files import write_whole
    from hvcpd.reporting.hearing_plot import hearing_png

    png = hearing_png(samples, events, title)
    try:
        write_whole(path, png)
    except OSError as error:
        raise AudioFileError(f"--plot: {path} cannot be written: {error.strerror}; name another") from None


def sentences(samples: Samples, team: Team) -> Iterator[HeardSentence]:
    """Every sentence that the recogniser reports in a recording, in order."""
    return (_sentence(event, team, None) for event in events_in(samples, team) if isinstance(event, Recognised))


def events_in(samples: Samples, team: Team) -> Iterator[Event]:
    """Everything that the recogniser reports in a recording, garbled speech too, in order."""
    recogniser = make_recogniser(team.phrasebook, team.names, team.sound)
    for start in range(0, len(samples), BLOCK):
        yield from recogniser.push(samples[start : start + BLOCK])
    yield from recogniser.flush()


def _sealing(path: Path | None) -> Sealing | None:
    """Judges seals with the key in a file. What was heard before the recording is unknown: it may begin far ahead."""
    if path is None or path == Path():
        return None
    keep_out_of_dumps()
    return Sealing(Guard("", read_key_file(path).ring(None), patience=Patience(free=math.inf), far_cipher=FAR_CIPHER))


_SEALS = {Trust.FRESH: "right", Trust.SEALED: "right", Trust.AHEAD: "right", Trust.USED: "used"}


def _sentence(event: Recognised, team: Team, sealing: Sealing | None) -> HeardSentence:
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
        _addressee(utterance),
        event.confidence,
        seal,
        is_cipher,
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
        | ({"seal": s.seal} if s.seal is not None else {})
        | ({"encrypted": True} if s.encrypted else {})
    )


def _as_text(s: HeardSentence) -> str:
    kind = "encrypted, seal" if s.encrypted else "seal"
    seal = f"  [{kind} {s.seal}]" if s.seal is not None else ""
    return f"{s.start_s:8.2f} – {s.end_s:6.2f} s  {s.confidence:4.0%}  {s.text}{seal}"
