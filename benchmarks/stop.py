"""Detections of "stop" over a talking robot, and false alarms.

    python -m benchmarks.stop [--calls 100] [--kinds robots,espeak-ng,flite,people] [--over-db none,-6,0,6,12,20]
        [--snr-db quiet] [--worlds near] [--data DIR] [--minutes 10] [--seed 0] [--names Rob,Bot] [--accent gb] [--peer]
        [--natural] [--for-noise] [--cases call,two,false,collide,kitchen,data]

`call`: "stop", "Rob stop" or "all stop" (people: "stop") in a voice that no robot has, at a random time over a robot's
random sentence, --over-db louder or alone (`none`). `two`: over two robots at once (over the listening robot's own
talk: `benchmarks.own_voice`). `false`: the robots' sentences, one after the other, none of which says stop, at
--snr-db, too; `collide`: two at once, half of them begun within 0.4 s as when neither could hear the other yet;
`kitchen`: their sentences in kitchen noise as loud, the half of the recording that the net did not learn;
`data`: the recordings below --data in which nobody says stop. A call counts as heard when the robot halts after its
beginning and no later than 0.5 s after its end, and as a stop for good when it stays. Intervals are Wilson's, 95 %.
--kinds, --over-db, --snr-db and --worlds are all tried with all. --peer: PocketSphinx spots the keyword instead.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.hearing.material import BLOCK, GAP_S
from benchmarks.manner import USUAL, Manner, add_manner, manner_of
from benchmarks.stop_callers import Callers, ended, is_held_out
from benchmarks.stop_peer import Peer
from hil_fakes.room import PinkNoise
from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.assembly.plan import HearingPlan
from hvcpd.assembly.sound import make_phrasebook
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.evaluation.statistics import wilson
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Held, Recognised, Released, Urgent
from hvcpd.recognition.stages import SpeechRecogniser, SynchronousWorker
from hvcpd.synthesis.voices import VOICES, voice_for

SPEECH_DBFS = -35.0
NOISE_DBFS = -75.0
"""A quiet room."""
SOON_S = 0.3
LEAD_S = 2.0
REST_S = 2
"""After the talk, until all is decided."""
IN_TIME_S = 0.5
UNHEARD_S = 0.4
"""A robot that begins this soon after another one has not heard it yet."""
CALLS = (("stop",), ("rob", "stop"), ("all", "stop"))


class Stage:
    """Two robots, the voices that are not theirs, and the recogniser of the first."""

    def __init__(self, names: tuple[str, ...], manner: Manner = USUAL) -> None:
        self.names = names
        self._sound = manner.sound()
        self.book = make_phrasebook(names, DEFAULT_TEAMS, load_tasks(default_tasks_path()))
        robots = {voice_for(name).name for name in names}
        voices = [replace(voice, natural=manner.natural) for voice in VOICES]
        self._speakers = {voice.name: manner.speaker(voice, self._sound) for voice in voices}
        self.people = [v.name for v in VOICES if v.name not in robots]

    def recogniser(self) -> SpeechRecogniser:
        """As a robot's with `voices: any`, which understands strangers, too."""
        hearing = HearingPlan(channel=SynchronousWorker(), second=SynchronousWorker())
        return make_speech_recogniser(self.book, self.names, self._sound, hearing)

    def sentence(self, chooser: random.Random, speaker: str) -> Samples:
        """A random sentence of a robot that does not say "stop"."""
        while True:
            utterance = self.book.sample(chooser)
            if utterance.speaker == speaker and "stop" not in self.book.render(utterance):
                return self._speakers[voice_for(speaker).name].render(self.book.phrases(utterance))

    def stop(self, speaker: str) -> Samples:
        """A robot's "stop", cut off where it is no longer audible."""
        return ended(self._speakers[voice_for(speaker).name].render([("stop",)]))

    def call(self, chooser: random.Random) -> Samples:
        """A person's call, cut off where it is no longer audible."""
        return ended(self._speakers[chooser.choice(self.people)].render([chooser.choice(CALLS)]))


def at_level(sound: Samples, dbfs: float) -> Samples:
    active = sound[np.abs(sound) > 1e-4]
    return np.asarray(sound * (10.0 ** (dbfs / 20.0) / np.sqrt(np.mean(active**2))), np.float32)


def room(n: int, seed: int, dbfs: float = NOISE_DBFS) -> Samples:
    return np.asarray(PinkNoise(10.0 ** (dbfs / 20.0), seed).take(n).copy(), np.float32)


def noise_level(snr_db: float | None) -> float:
    return NOISE_DBFS if snr_db is None else SPEECH_DBFS - snr_db


class Listener:
    """One robot's ears, and when it halted for what it heard, s: holds, how long those released took, and stops."""

    def __init__(self, recogniser: SpeechRecogniser | Peer) -> None:
        self._ears = recogniser
        self._held: float | None = None
        self.now_s = self.spent_s = 0.0
        self.held_s: list[float] = []
        self.stood_s: list[float] = []
        self.released_s: list[float] = []
        self.stopped_s: list[float] = []

    def listen(self, sound: Samples) -> None:
        began_s = time.process_time()
        for start in range(0, len(sound), BLOCK):
            block = sound[start : start + BLOCK]
            self.now_s += len(block) / SAMPLE_RATE_HZ
            for event in self._ears.push(block):
                self._note(event)
        self.spent_s += time.process_time() - began_s

    def _note(self, event: Event) -> None:
        match event:
            case Held() if self._held is None:
                self._held = self.now_s
                self.held_s.append(self.now_s)
            case Released() if self._held is not None:
                self.stood_s.append(self.now_s - self._held)
                self.released_s.append(self.now_s)
                self._held = None
            case Urgent():
                self._held = None
                self.stopped_s.append(self.now_s)
            case Recognised(words=words) if "stop" in words:  # or "stop please"
                self.stopped_s.append(self.now_s)

    @property
    def halts_s(self) -> list[float]:
        """When it halted, for good or not."""
        return self.held_s + self.stopped_s

    def stood_at(self, time_s: float) -> bool:
        """Whether it stood, for whatever it had heard before, and did not go on soon after."""
        last = max((t for t in self.halts_s if t <= time_s), default=None)
        return last is not None and not any(last < t <= time_s + IN_TIME_S for t in self.released_s)

    def told(self, what: str) -> str:
        """The account of talk in which nobody calls."""
        return (
            f"{what}: in {self.now_s / 60.0:.1f} min {len(self.stopped_s)} false stops; {len(self.held_s)} holds, "
            f"{len(self.stood_s)} of them released after {sum(self.stood_s):.1f} s in all; "
            f"{self.spent_s / self.now_s:.3f} of real time"
        )


@dataclass(frozen=True)
class Cell:
    """One row of the table: who calls, how much louder than the talk (None: nobody talks), in what noise and world."""

    kind: str
    over_db: float | None
    snr_db: float | None
    world: str
    talkers: int = 1

    def __str__(self) -> str:
        who = "two robots" if self.talkers == 2 else "a robot"
        over = "alone" if self.over_db is None else f"{self.over_db:+.0f} dB over {who}"
        noise = "quiet" if self.snr_db is None else f"noise {self.snr_db:.0f} dB"
        return f"{self.kind}, {over}, {noise}, {self.world}"


@dataclass
class Score:
    """When it halted, and stopped for good, after the ends of the calls, s; of those that it heard."""

    calls: int = 0
    halts_s: list[float] = field(default_factory=list)
    stops_s: list[float] = field(default_factory=list)
    early: int = 0
    missed: list[int] = field(default_factory=list)
    spent_s: float = 0.0
    total_s: float = 0.0

    def told(self, what: str) -> str:
        """A line of the table."""
        n, low_high = len(self.halts_s), wilson(len(self.halts_s), self.calls)
        soon = sum(t <= SOON_S for t in self.halts_s)
        last = f"95 % after {np.quantile(self.halts_s, 0.95):.2f} s" if n else "never"
        return (
            f"{what}: {n} of {self.calls} halted within {IN_TIME_S} s ({100 * low_high[0]:.0f} to "
            f"{100 * low_high[1]:.0f} %), {soon} within {SOON_S} s, {last}; {len(self.stops_s)} for good, {self.early} "
            f"before anybody called, {self.spent_s / max(self.total_s, 1e-9):.3f} of real time"
            + (f"; missed: seeds {self.missed}" if 0 < len(self.missed) <= 8 else "")
        )


def mixture(stage: Stage, callers: Callers, cell: Cell, seed: int) -> tuple[Samples, int, int]:
    """What is heard, and the samples where the call begins and ends."""
    chooser = random.Random(seed)
    call = at_level(callers.call(cell.kind, chooser), SPEECH_DBFS + (cell.over_db or 0.0))
    end = len(call)
    call = callers.through(call, cell.world, chooser)
    talk: Samples = np.zeros(0, np.float32)
    for speaker in (stage.names[1], stage.names[0])[: cell.talkers]:
        said = at_level(stage.sentence(chooser, speaker), SPEECH_DBFS)
        said = callers.through(said, cell.world, chooser)
        talk = np.pad(talk, (0, max(len(said) - len(talk), 0)))
        talk[: len(said)] += said
    lead = round(LEAD_S * SAMPLE_RATE_HZ)
    at = lead + round(chooser.random() * max(len(talk) - end, 0))
    n = lead + max(len(talk), at - lead + len(call)) + REST_S * SAMPLE_RATE_HZ
    sound = room(n, seed, noise_level(cell.snr_db))
    if cell.over_db is not None:
        sound[lead : lead + len(talk)] += talk
    sound[at : at + len(call)] += call
    return sound, at, at + end


def calls(stage: Stage, callers: Callers, cell: Cell, seeds: range, peer: bool) -> Score:
    """Number of calls."""
    score = Score(len(seeds))
    for seed in seeds:
        sound, at, end = mixture(stage, callers, cell, seed)
        begin_s, end_s = at / SAMPLE_RATE_HZ, end / SAMPLE_RATE_HZ
        found = Listener(Peer() if peer else stage.recogniser())
        found.listen(sound)
        halts = [t - end_s for t in found.halts_s if begin_s < t <= end_s + IN_TIME_S]
        halts += [begin_s - end_s] if found.stood_at(begin_s) else []
        stops = [t - end_s for t in found.stopped_s if t > begin_s]
        score.early += any(t <= begin_s for t in found.stopped_s)
        score.halts_s += [min(halts)] if halts else []
        score.stops_s += [min(stops)] if stops else []
        score.missed += [] if halts else [seed]
        score.spent_s, score.total_s = score.spent_s + found.spent_s, score.total_s + found.now_s
    return score


def kitchen(data: Path) -> Samples:
    """The half of the recording that the net has not learned, as loud as speech."""
    sound = np.asarray(read_wav(data / "kitchen.wav"), np.float32)
    return at_level(sound[len(sound) // 2 :], SPEECH_DBFS)


def false_stops(
    stage: Stage, minutes: float, seed: int, at_once: bool, noise: Samples | None = None, snr_db: float | None = None
) -> None:
    """The robots' own talk; `at_once`: two of them at a time, as when they collide; `noise`: goes on all the time, in
    pink noise at `snr_db`, or in a quiet room."""
    chooser, listener, n, overlap_s = random.Random(seed), Listener(stage.recogniser()), 0, 0.0
    while listener.now_s < minutes * 60.0:
        first, second = chooser.sample(stage.names, 2)
        talk = at_level(stage.sentence(chooser, first), SPEECH_DBFS)
        if at_once:
            other = at_level(stage.sentence(chooser, second), SPEECH_DBFS)
            latest = chooser.choice((UNHEARD_S * SAMPLE_RATE_HZ, min(len(talk), len(other))))
            begin = round(chooser.random() * latest)
            overlap_s += min(len(talk) - begin, len(other)) / SAMPLE_RATE_HZ
            talk = np.concatenate([talk, np.zeros(max(begin + len(other) - len(talk), 0), np.float32)])
            talk[begin : begin + len(other)] += other
        gap = round(chooser.uniform(*GAP_S) * SAMPLE_RATE_HZ)
        sound = room(len(talk) + gap, n % 100_003, noise_level(snr_db))
        sound[gap:] += talk
        if noise is not None:
            sound += np.take(noise, np.arange(n, n + len(sound)), mode="wrap")
        listener.listen(sound)
        n += len(sound)
    what = f"two robots at once for {overlap_s / 60.0:.1f} min" if at_once else "robots' own talk"
    what += ", in a kitchen" if noise is not None else ""
    what += f", noise {snr_db:.0f} dB" if snr_db is not None else ""
    print(listener.told(what), flush=True)


def recordings(stage: Stage, minutes: float, data: Path) -> None:
    """What people say, and sounds, by folder; those that the net has not learned."""
    for folder in ("negatives", "words", "sounds"):
        listener = Listener(stage.recogniser())
        for path in sorted((data / folder).rglob("*.wav")):
            if path.parent.name == "stop" or not is_held_out(path):
                continue
            sound = np.asarray(read_wav(path), np.float32)
            listener.listen(np.concatenate([sound, room(SAMPLE_RATE_HZ // 2, len(sound))]))
            if listener.now_s >= minutes * 60.0:
                break
        print(listener.told(folder), flush=True)


def _levels(text: str) -> list[float | None]:
    return [None if part in ("none", "quiet") else float(part) for part in text.split(",")]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=100)
    parser.add_argument("--kinds", default="robots")
    parser.add_argument("--over-db", default="none,-6,0,6,12,20", help="the call's level over the talk's")
    parser.add_argument("--snr-db", default="quiet", help="the talk's, or the call's, over pink noise")
    parser.add_argument("--worlds", default="near", help="near, room, loudspeaker")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cases", default="call,two,false,collide")
    parser.add_argument("--names", default="Rob,Bot")
    add_manner(parser)  # of robots, and of callers by their voices
    parser.add_argument("--peer", action="store_true")
    o = parser.parse_args()
    stage = Stage(tuple(o.names.split(",")), manner_of(o))
    callers = Callers(stage.call, o.data)
    levels = [_levels(o.over_db), _levels(o.snr_db)]
    for case in o.cases.split(","):
        if case in ("false", "collide"):
            for snr_db in levels[1]:
                false_stops(stage, o.minutes, o.seed, at_once=case == "collide", snr_db=snr_db)
        elif case == "kitchen":
            noise = kitchen(o.data or sys.exit("kitchen: where is it? (--data)"))
            false_stops(stage, o.minutes, o.seed, at_once=False, noise=noise)
        elif case == "data":
            recordings(stage, o.minutes, o.data or sys.exit("data: where is it? (--data)"))
        else:
            for kind, over_db, snr_db, world in product(o.kinds.split(","), *levels, o.worlds.split(",")):
                if over_db is None and case != "call":
                    continue
                cell = Cell(kind, over_db, snr_db, world, 2 if case == "two" else 1)
                print(calls(stage, callers, cell, range(o.seed, o.seed + o.calls), o.peer).told(str(cell)), flush=True)


if __name__ == "__main__":
    main()
