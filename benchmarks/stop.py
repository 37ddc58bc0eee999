"""Is "stop" heard when a person says it, over a talking robot? And how often is it heard where nobody said it?

    python -m benchmarks.stop [--calls 100] [--sir-db 0] [--minutes 10] [--data DIR] [--seed 0] [--names Rob,Bot]
        [--cases other,own,nobody,false,collide]

`other`: a robot's random sentence, and over it, at a random time and --sir-db, a person's "stop", "Rob stop" or "all
stop" in a voice that no robot has. `own`: the listening robot itself speaks, 20 dB louder at its own microphone.
`nobody`: the call alone. `false`: the robots' own sentences, one after the other, none of which says stop; `collide`:
two at once, half of them begun within 0.4 s as when neither could hear the other yet; and the WAVs below --data. A call
counts as heard when the robot halts after its beginning and no later than 0.5 s after its end, and as a stop for good
when it stays.
"""

from __future__ import annotations

import argparse
import random
import time
from pathlib import Path

import numpy as np

from benchmarks.hearing.material import BLOCK, GAP_S
from hil_fakes.room import PinkNoise
from hvcpd.assembly.make import (
    DEFAULT_TEAMS,
    make_phrasebook,
    make_recogniser,
    make_sound,
    user_cache_folder,
)
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Held, Recognised, Released, Urgent
from hvcpd.recognition.recogniser import Recogniser
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES, voice_for

SPEECH_DBFS = -35.0
NOISE_DBFS = -75.0
"""A quiet room."""
OWN_LOUDER_DB = 20.0
"""The own loudspeaker is ten times nearer to the own microphone than anybody else."""
LEAD_S = 2.0
REST_S = 2
"""After the talk, until all is decided."""
IN_TIME_S = 0.5
UNHEARD_S = 0.4
"""Who begins so soon after another has not heard it yet."""
CALLS = (("stop",), ("rob", "stop"), ("all", "stop"))


class Stage:
    """Two robots, the voices that are not theirs, and the recogniser of the first."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self._sound = make_sound(None, user_cache_folder())
        self.book = make_phrasebook(names, DEFAULT_TEAMS, load_tasks(default_tasks_path()))
        robots = {voice_for(name).name for name in names}
        self._speakers = {v.name: Speaker(v, self._sound.lexicon, self._sound.cache) for v in VOICES}
        self.people = [v.name for v in VOICES if v.name not in robots]

    def ears(self) -> Recogniser:
        return make_recogniser(self.book, self.names, self._sound)

    def sentence(self, chooser: random.Random, speaker: str) -> Samples:
        """A random sentence of a robot that does not say "stop"."""
        while True:
            utterance = self.book.sample(chooser)
            if utterance.speaker == speaker and "stop" not in self.book.render(utterance):
                return self._speakers[voice_for(speaker).name].render(self.book.phrases(utterance))

    def call(self, chooser: random.Random) -> Samples:
        """A person's call, cut off where it is no longer audible."""
        sound = self._speakers[chooser.choice(self.people)].render([chooser.choice(CALLS)])
        loud = np.flatnonzero(np.abs(sound) > 1e-3 * np.abs(sound).max())
        return sound[: loud[-1] + 1]


def at_level(sound: Samples, dbfs: float) -> Samples:
    active = sound[np.abs(sound) > 1e-4]
    return np.asarray(sound * (10.0 ** (dbfs / 20.0) / np.sqrt(np.mean(active**2))), np.float32)


def room(n: int, seed: int) -> Samples:
    return np.asarray(PinkNoise(10.0 ** (NOISE_DBFS / 20.0), seed).take(n).copy(), np.float32)


class Listener:
    """One robot's ears, and when it halted for what it heard, s: holds, how long those released took, and stops."""

    def __init__(self, ears: Recogniser) -> None:
        self._ears = ears
        self._held: float | None = None
        self.now_s = self.spent_s = 0.0
        self.held_s: list[float] = []
        self.stood_s: list[float] = []
        self.released_s: list[float] = []
        self.stopped_s: list[float] = []

    def listen(self, sound: Samples, masked: tuple[int, int] = (0, 0)) -> None:
        began_s = time.process_time()
        for start in range(0, len(sound), BLOCK):
            block = sound[start : start + BLOCK]
            self.now_s += len(block) / SAMPLE_RATE_HZ
            for event in self._ears.push(block, masked=masked[0] <= start < masked[1]):
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


def calls(stage: Stage, case: str, seeds: range, sir_db: float) -> None:
    halts_s, stops_s, early, spent_s, total_s = [], [], 0, 0.0, 0.0
    missed: list[int] = []
    for seed in seeds:
        chooser = random.Random(seed)
        call = at_level(stage.call(chooser), SPEECH_DBFS + sir_db)
        speaker = stage.names[0] if case == "own" else stage.names[1]
        talk = at_level(stage.sentence(chooser, speaker), SPEECH_DBFS + (OWN_LOUDER_DB if case == "own" else 0.0))
        lead = round(LEAD_S * SAMPLE_RATE_HZ)
        at = lead + round(chooser.random() * max(len(talk) - len(call), 0))
        sound = room(lead + len(talk) + len(call) + REST_S * SAMPLE_RATE_HZ, seed)
        if case != "nobody":
            sound[lead : lead + len(talk)] += talk
        sound[at : at + len(call)] += call
        begin_s, end_s = at / SAMPLE_RATE_HZ, (at + len(call)) / SAMPLE_RATE_HZ
        found = Listener(stage.ears())
        found.listen(sound, (lead, lead + len(talk)) if case == "own" else (0, 0))
        spent_s, total_s = spent_s + found.spent_s, total_s + found.now_s
        halts = [t - end_s for t in found.halts_s if begin_s < t <= end_s + IN_TIME_S]
        halts += [begin_s - end_s] if found.stood_at(begin_s) else []
        stops = [t - end_s for t in found.stopped_s if t > begin_s]
        early += any(t <= begin_s for t in found.stopped_s)
        halts_s += [min(halts)] if halts else []
        stops_s += [min(stops)] if stops else []
        if not (halts and stops):
            missed.append(seed)
    print(
        f"{case:7} {len(halts_s):4d} of {len(seeds)} halted within {IN_TIME_S} s ({_spread(halts_s)}), "
        f"{len(stops_s)} for good ({_spread(stops_s)}), {early} before anybody called, "
        f"{spent_s / total_s:.3f} of real time" + (f"; not all: seeds {missed}" if missed else ""),
        flush=True,
    )


def _spread(times_s: list[float]) -> str:
    return f"mean {np.mean(times_s):.2f}, latest {max(times_s):.2f} s" if times_s else "never"


def false_stops(stage: Stage, minutes: float, seed: int, at_once: bool) -> None:
    """The robots' own talk; `at_once`: two of them at a time, as when they collide."""
    chooser, listener, n, overlap_s = random.Random(seed), Listener(stage.ears()), 0, 0.0
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
        sound = room(len(talk) + gap, n % 100_003)
        sound[gap:] += talk
        listener.listen(sound)
        n += len(sound)
    what = f"two robots at once for {overlap_s / 60.0:.1f} min" if at_once else "robots' own talk"
    print(listener.told(what), flush=True)


def peoples_talk(stage: Stage, minutes: float, data: Path) -> None:
    listener = Listener(stage.ears())
    for path in sorted(data.rglob("*.wav")):
        listener.listen(np.asarray(read_wav(path), np.float32))
        if listener.now_s >= minutes * 60.0:
            break
    print(listener.told("people's talk"), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=100)
    parser.add_argument("--sir-db", type=float, default=0.0, help="the call's level over the talk's")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cases", default="other,own,nobody,false,collide")
    parser.add_argument("--names", default="Rob,Bot")
    o = parser.parse_args()
    stage = Stage(tuple(o.names.split(",")))
    for case in o.cases.split(","):
        if case in ("false", "collide"):
            false_stops(stage, o.minutes, o.seed, at_once=case == "collide")
        else:
            calls(stage, case, range(o.seed, o.seed + o.calls), o.sir_db)
    if o.data is not None:
        peoples_talk(stage, o.minutes, o.data)


if __name__ == "__main__":
    main()
