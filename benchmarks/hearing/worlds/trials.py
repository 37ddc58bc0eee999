"""One trial: sentences said in a world, heard by fresh ears, and scored."""

from __future__ import annotations

import random
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from benchmarks.hearing.listeners import Peer, padded
from benchmarks.hearing.material import BLOCK, Spoken, Team
from benchmarks.hearing.worlds.conditions import Condition
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Recognised, Urgent
from hvcpd.synthesis.leveling import audible

LEAD_S = 3.5
"""Of the world's noise before anybody speaks: the noise tracker's memory, and a little more."""
TAIL_S = 2.5
"""Of it after the last sentence: until then it is told."""
GAP_S = (0.9, 1.6)
LATER_S = (0.3, 1.0)
"""How much later the second of two robots begins."""
ACQUAINTED = 2
"""Sentences of the same robot in the same world that are heard first, and not scored."""


class HearsSentences(Protocol):
    """The interface of ears that a trial needs."""

    def push(self, samples: Samples, masked: bool = False) -> list[Event]: ...


class MakeRecogniser(Protocol):
    """Makes ears that have heard nothing."""

    def __call__(self, team: Team) -> HearsSentences: ...


@dataclass(frozen=True)
class Trial:
    """The sound at the ears, the sample from which it is scored, and its sentences, the louder first if there are
    two."""

    sound: Samples
    scored_from: int
    said: tuple[Spoken, ...]


@dataclass(frozen=True)
class Verdict:
    """The outcome of one sentence: right, wrong or lost; with every sentence reported that was not said, by source."""

    words: tuple[str, ...]
    outcome: str
    source: str = ""
    instead: tuple[tuple[str, str], ...] = ()


@dataclass
class Tally:
    """Verdicts, and the processor's time for the sound that was heard."""

    verdicts: list[Verdict] = field(default_factory=list)
    seconds: float = 0.0
    heard_s: float = 0.0

    def count(self, outcome: str) -> int:
        """Of that outcome."""
        return sum(v.outcome == outcome for v in self.verdicts)

    def sources(self, outcome: str) -> Counter[str]:
        """Of the reports that are right or wrong, by what made them."""
        if outcome == "right":
            return Counter(v.source for v in self.verdicts if v.outcome == "right")
        return Counter(source for v in self.verdicts for source, _ in v.instead)

    def add(self, other: Tally) -> None:
        """Of another trial too."""
        self.verdicts += other.verdicts
        self.seconds += other.seconds
        self.heard_s += other.heard_s


def make_trial(team: Team, condition: Condition, number: int, seed: int, acquainted: bool, data: Path | None) -> Trial:
    """The trial of that number, the same for the same seed. What is scored is the same, acquainted or not; where two
    speak at once, the one that begins first was heard before."""
    chooser = random.Random(f"{condition.name} {number} {seed}")
    before = random.Random(f"before {condition.name} {number} {seed}")
    k = 100_000 * seed + number
    world = condition.make(k)
    speakers = team.speakers()
    voice = chooser.choice(list(speakers))
    clean, spoken = _stream(team, voice, ACQUAINTED if acquainted else 0, chooser, before)
    arrived = world.carried(clean)
    spoken = world.when(spoken, len(arrived))
    said = [spoken[-1]]
    scored_from = spoken[-2].end + SAMPLE_RATE_HZ // 2 if acquainted else 0
    if condition.apart_db is not None:
        other = chooser.choice([name for name in speakers if name != voice])
        words, sound = _sentence(team, other, chooser, condition.calls)
        at = said[0].start + round(chooser.uniform(*LATER_S) * SAMPLE_RATE_HZ)
        second = np.zeros(max(len(arrived), at + len(sound) + round(TAIL_S * SAMPLE_RATE_HZ)), np.float32)
        second[at : at + len(sound)] = sound
        end = at + audible(sound)[1]
        # louder first: every other time the second one is
        through = condition.make(k + 50_000).carried(second)
        gain = 10.0 ** (condition.apart_db / 20.0 * (1 if number % 2 else -1))
        gain *= _rms(arrived, said[0].start, said[0].end) / _rms(through, at, end)
        arrived = np.pad(arrived, (0, len(second) - len(arrived))) + gain * through
        said.insert(0 if number % 2 and condition.calls is None else 1, Spoken(words, at, end))
    return Trial(world.heard(arrived, spoken, team, data), scored_from, tuple(said))


def _rms(sound: np.ndarray, start: int, end: int) -> float:
    return float(np.sqrt(np.mean(sound[start:end] ** 2)))


def _sentence(
    team: Team, voice: str, chooser: random.Random, words: tuple[str, ...] | None = None
) -> tuple[tuple[str, ...], Samples]:
    """A sentence in that robot's voice: these words, or a random one that it may say."""
    if words is not None:
        return words, team.speakers()[voice].render([list(words)])
    while True:
        utterance = team.book.sample(chooser)
        if utterance.speaker in (None, voice):
            phrases = team.book.phrases(utterance)
            return tuple(w for phrase in phrases for w in phrase), team.speakers()[voice].render(phrases)


def _stream(
    team: Team, voice: str, n_before: int, chooser: random.Random, before: random.Random
) -> tuple[Samples, list[Spoken]]:
    scored = _sentence(team, voice, chooser)
    sentences = [*(_sentence(team, voice, before) for _ in range(n_before)), scored]
    pieces = [np.zeros(round((LEAD_S + before.uniform(0, 0.3)) * SAMPLE_RATE_HZ), np.float32)]
    spoken = []
    at = len(pieces[0])
    for words, sound in sentences:
        spoken.append(Spoken(words, at, at + audible(sound)[1]))
        gap = np.zeros(round(before.uniform(*GAP_S) * SAMPLE_RATE_HZ), np.float32)
        pieces += [sound, gap]
        at += len(sound) + len(gap)
    pieces.append(np.zeros(round(TAIL_S * SAMPLE_RATE_HZ), np.float32))
    return np.concatenate(pieces), spoken


def hear(recogniser: HearsSentences, sound: Samples) -> tuple[list[Event], float]:
    """Their reports, and the processor's time, s."""
    began = time.process_time()
    events = [event for at in range(0, len(sound), BLOCK) for event in recogniser.push(sound[at : at + BLOCK])]
    return events, time.process_time() - began


def ours(make_speech_recogniser: MakeRecogniser, team: Team, trial: Trial) -> Tally:
    """The result of fresh ears in a trial. Only their processing while they listen is timed."""
    events, seconds = hear(make_speech_recogniser(team), trial.sound)
    return Tally(judged(events, trial), seconds, len(trial.sound) / SAMPLE_RATE_HZ)


def theirs(peer: Peer, trial: Trial) -> Tally:
    """PocketSphinx's result, given the place of each sentence."""
    tally = Tally()
    began = time.process_time()
    for said in trial.said:
        piece = padded(trial.sound, said)
        got = peer.hear(piece)
        right = got == " ".join(said.words)
        wrong = () if right or not got else (("PocketSphinx", got),)
        tally.verdicts.append(Verdict(said.words, "right" if right else "wrong" if wrong else "lost", "", wrong))
        tally.heard_s += len(piece) / SAMPLE_RATE_HZ
    tally.seconds = time.process_time() - began
    return tally


def judged(events: Sequence[Event], trial: Trial) -> list[Verdict]:
    """A sentence is right if it was reported and nothing else was. Any other report counts against the sentence that it
    overlaps most; a stop, where nobody said one, counts against the first."""
    told = [e for e in events if isinstance(e, Recognised | Urgent) and e.end_sample > trial.scored_from]
    sentences = [e for e in told if isinstance(e, Recognised)]
    wrong: dict[int, list[tuple[str, str]]] = {}
    for event in sentences:
        if all(event.words != said.words for said in trial.said):
            overlaps = [_overlap(event, said) for said in trial.said]
            text = " ".join(event.words) + f" ({event.confidence:.2f})"
            wrong.setdefault(int(np.argmax(overlaps)), []).append((str(event.source), text))
    if not any("stop" in said.words for said in trial.said):
        wrong.setdefault(0, []).extend(("urgent", "stop!") for e in told if isinstance(e, Urgent))
    verdicts = []
    for k, said in enumerate(trial.said):
        sources = [str(e.source) for e in sentences if e.words == said.words]
        if said.words == ("stop",):  # whoever calls it is heard if robots stop
            sources += ["urgent" for e in told if isinstance(e, Urgent)]
        instead = tuple(wrong.get(k, ()))
        outcome = "wrong" if instead else "right" if sources else "lost"
        verdicts.append(Verdict(said.words, outcome, sources[0] if sources else "", instead))
    return verdicts


def _overlap(event: Recognised, said: Spoken) -> int:
    return min(event.end_sample, said.end) - max(event.start_sample, said.start)
