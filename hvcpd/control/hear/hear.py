"""`hvcpctl hear`: every sentence in a recording."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TypeVar

import numpy as np

from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.assembly.plan import HearingPlan
from hvcpd.config.files import require_place, write_whole
from hvcpd.control.hear.heard_sentences import Teller, listening_team
from hvcpd.control.output import print_note
from hvcpd.control.simulate.team import Team
from hvcpd.errors import AudioFileError, writing
from hvcpd.hardware.soundfile import read_wav
from hvcpd.language.messages import Utterance
from hvcpd.people.second_pass import Found
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.recognition.events import Event, Received, Recognised, WordSpan
from hvcpd.recognition.frontend import frame_powers
from hvcpd.recognition.stages import Segment, SynchronousWorker

SILENT_DB = -80.0
"""A recording whose loudest sample is below that is silent: rooms and microphones alone are louder."""
QUIET_S = 1.0
"""Before and after a recording; the end of a sentence takes half of it."""
Place = TypeVar("Place", Event, WordSpan)
BLOCK = 1600
"""Samples pushed at once, 0.1 s; the size changes no result."""


def run(options: argparse.Namespace) -> None:
    """List the sentences, as text or as one JSON object a line."""
    if options.learn_alternatives:
        from hvcpd.control.hear import learn_alternatives

        learn_alternatives.run(options)
        return
    if len(options.file) > 1:
        raise AudioFileError("hear takes one recording; give several only with --learn-alternatives")
    [file] = options.file
    samples = read_wav(file)
    team, sealing = listening_team(options)
    said = team.phrasebook.parse_text(options.said) if options.said else None
    if options.plot:
        _check_plot(options.plot, samples)
    teller = Teller(team, sealing, options)
    events: list[Event] = []
    for event in events_in(samples, team):
        events.append(event)
        teller.tell(event)
    if teller.sentences == 0 and not options.json:
        print_note(_nothing(samples, team.names, file))
    if said is not None:
        _tell_nearness(samples, events, said, team, options)
    if options.plot:
        _draw(options.plot, samples, events, file.name)


def _tell_nearness(
    samples: Samples, events: list[Event], utterance: Utterance, team: Team, options: argparse.Namespace
) -> None:
    """Print how near the sentence that was said came to being understood."""
    from hvcpd.control.hear.how_near import as_line, nearness, understood

    said, text = team.phrasebook.render(utterance), team.phrasebook.write(utterance)
    if understood(events, said, team):
        return
    found = [as_line(near, text, options.json) for near in nearness(samples, events, said, team)]
    sys.stdout.writelines(line + "\n" for line in found)
    if not found:
        print_note(f"no speech was noticed in {options.file[0]}")


def _nothing(samples: Samples, names: Sequence[str], file: Path) -> str:
    """Why no sentence was heard, if that is known."""
    peak = float(np.abs(samples).max(initial=0.0))
    level_db = 20.0 * math.log10(peak) if peak else -math.inf
    length = f"{len(samples) / SAMPLE_RATE_HZ:.1f} s"
    if level_db < SILENT_DB:
        loudest = f"its loudest sample has {level_db:.0f} dBFS" if peak else "all of its samples are zero"
        return f"{file} is silent ({length}): {loudest}; was the microphone muted, or another one meant?"
    return f"no sentence of the phrasebook in {file} ({length}; names known: {', '.join(names)})"


def _check_plot(path: Path, samples: Samples) -> None:
    """Warn before listening, which may take minutes."""
    from hvcpd.reporting.hearing_plot import check_drawable

    check_drawable(samples)
    with writing(path, AudioFileError, "--plot: "):
        require_place(path)


def _draw(path: Path, samples: Samples, events: list[Event], title: str) -> None:
    from hvcpd.reporting.hearing_plot import hearing_png

    png = hearing_png(samples, events, title)
    with writing(path, AudioFileError, "--plot: "):
        write_whole(path, png)


def events_in(samples: Samples, team: Team) -> Iterator[Event]:
    """Yield everything that the recogniser reports in a recording, shape (n,), float32 at 16 kHz, in order:
    sentences and garbled speech."""
    robots = tuple(name for name in team.names if name.lower() not in team.people)
    voices = team.settings.voices
    people = SynchronousWorker[Segment, Found]() if voices != "robots" else None
    hearing = HearingPlan(people=team.people, channel=SynchronousWorker(), second=people, any_voice=voices == "any")
    recogniser = make_speech_recogniser(team.phrasebook, robots or team.names, team.sound, hearing)
    quiet = _quiet(samples)
    n, whole = len(quiet), np.concatenate([quiet, samples, quiet])
    pushed = (recogniser.push(whole[start : start + BLOCK]) for start in range(0, len(whole), BLOCK))
    for event in chain(chain.from_iterable(pushed), recogniser.flush()):
        if n < event.end_sample and event.start_sample < n + len(samples):
            yield _earlier(event, n)


def _quiet(samples: Samples) -> Samples:
    """QUIET_S of noise that is as loud as a recording, shape (n,), where it is quietest, and has that spectrum.

    A recording may begin and end with a word, but a room does not: what was before is the noise of the word, and the
    pause after a sentence ends it.
    """
    n, powers = samples_in(QUIET_S), frame_powers(samples, BLOCK)
    if not len(powers) or not powers.min():
        return np.zeros(n, np.float32)
    start, rng = int(np.argmin(powers)) * BLOCK, np.random.default_rng(1)
    noise = np.convolve(rng.standard_normal(n + BLOCK - 1), samples[start : start + BLOCK], "valid")
    return np.asarray(noise / math.sqrt(BLOCK), np.float32)


def _earlier(event: Event, n: int) -> Event:
    """The event `n` samples earlier, but not before the recording."""
    moved = _span_earlier(event, n)
    if not isinstance(moved, Recognised):
        return moved
    received = moved.received and Received(moved.received.start - n, moved.received.samples)
    return replace(moved, spans=tuple(_span_earlier(span, n) for span in moved.spans), received=received)


def _span_earlier(span: Place, n: int) -> Place:
    return replace(span, start_sample=max(span.start_sample - n, 0), end_sample=max(span.end_sample - n, 0))
