"""The listeners: our recogniser, and PocketSphinx, which is told where each sentence begins and ends.

PocketSphinx gets the phrasebook's network as a finite-state grammar, as `hvcpd.evaluation.sphinx` makes it. It hears
each sentence alone with half a second of the condition's noise at both ends (in digital silence it fares worse), with
beams wider than its own. Its other settings (noise removal, cepstral means of the whole, language weight) gave no more.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.hearing.material import BLOCK, Spoken, Team
from benchmarks.hearing.scoring import Outcome, Score, judge_events
from hvcpd.evaluation.sphinx import WIDE_BEAMS, heard, make_decoder
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event
from hvcpd.recognition.stages import SpeechRecogniser

PAD_S = 0.5
"""Of noise before and after a sentence, for PocketSphinx."""


def listen(recogniser: SpeechRecogniser, sound: Samples) -> tuple[list[tuple[int, Event]], float]:
    """What the ears report, each with the sample at which it was reported; and the processor time, s."""
    began = time.process_time()
    events = []
    for start in range(0, len(sound), BLOCK):
        events += [(start + BLOCK, event) for event in recogniser.push(sound[start : start + BLOCK])]
    events += [(len(sound), event) for event in recogniser.flush()]
    return events, time.process_time() - began


def ours(team: Team, sound: Samples, spoken: Sequence[Spoken]) -> Score:
    """Our recogniser's tally for a stream."""
    events, seconds = listen(team.recogniser(), sound)
    score = judge_events(events, spoken)
    score.seconds, score.heard_s = seconds, len(sound) / SAMPLE_RATE_HZ
    return score


class Peer:
    """PocketSphinx with the grammar of a team."""

    def __init__(self, team: Team, **settings: Any) -> None:
        """`settings` instead of WIDE_BEAMS. Raises ImportError without pocketsphinx."""
        with tempfile.TemporaryDirectory() as folder:
            self._decoder = make_decoder(team.book.graph, Path(folder), team.sound.lexicon, **(settings or WIDE_BEAMS))

    def hear(self, sound: Samples) -> str:
        """Its result for the whole sound as one sentence; empty if none."""
        return heard(self._decoder, sound)

    def score(self, sound: Samples, spoken: Sequence[Spoken]) -> Score:
        """Its tally for the sentences of a stream, one by one; of a repeated one the first that it understands."""
        score = Score()
        began = time.process_time()
        done: set[int] = set()
        for index, s in enumerate(spoken):
            if s.number in done:
                continue
            piece = padded(sound, s)
            got = self.hear(piece)
            score.heard_s += len(piece) / SAMPLE_RATE_HZ
            again = index + 1 < len(spoken) and s.number >= 0 and spoken[index + 1].number == s.number
            if not got and again:
                continue
            done.add(s.number if s.number >= 0 else -2 - index)
            right = got == " ".join(s.words)
            score.add(s, Outcome.RIGHT if right else Outcome.WRONG if got else Outcome.MISSED, got)
        score.seconds = time.process_time() - began
        return score


def padded(sound: Samples, s: Spoken) -> Samples:
    """A sentence with PAD_S of the sound around it."""
    pad = round(PAD_S * SAMPLE_RATE_HZ)
    return sound[max(s.start - pad, 0) : s.end + pad]


def make_peer(team: Team) -> Peer | None:
    """PocketSphinx, or None where it is not installed."""
    try:
        return Peer(team)
    except ImportError:
        return None
