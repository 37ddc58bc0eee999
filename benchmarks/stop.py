"""Is "stop" heard when a person says it, over a talking robot? And how often is it heard where nobody said it?

    python -m benchmarks.stop [--calls 100] [--sir-db 0] [--minutes 10] [--data DIR] [--cases other,own,nobody,false]

`other`: a robot's random sentence, and over it, at a random time and --sir-db, a person's "stop", "Rob stop" or "all
stop" in a voice that no robot has. `own`: the listening robot itself speaks, 20 dB louder at its own microphone.
`nobody`: the call alone. `false`: the robots' own sentences, one after the other, none of which says stop, and the WAVs
below --data. A call counts as heard when a stop is reported after its beginning and no later than 0.5 s after its end:
the robot halts then.
"""

from __future__ import annotations

import argparse
import random
import time
from pathlib import Path

import numpy as np

from benchmarks.hearing.material import BLOCK, GAP_S
from hil_fakes.room import PinkNoise
from hvcpd.assembly import DEFAULT_TEAMS, make_phrasebook, make_recogniser, make_sound, user_cache_folder
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised, Urgent
from hvcpd.recognition.recogniser import Recogniser
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES, voice_for

SPEECH_DBFS = -35.0
NOISE_DBFS = -75.0
"""A quiet room."""
OWN_LOUDER_DB = 20.0
"""The own loudspeaker is ten times nearer to the own microphone than anybody else."""
LEAD_S = 2.0
IN_TIME_S = 0.5
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


def listen(ears: Recogniser, sound: Samples, masked: tuple[int, int] = (0, 0)) -> tuple[list[float], int]:
    """When a stop was reported, s, and how many of those were over talk."""
    times, urgent = [], 0
    for start in range(0, len(sound), BLOCK):
        for event in ears.push(sound[start : start + BLOCK], masked=masked[0] <= start < masked[1]):
            over = isinstance(event, Urgent)
            if over or (isinstance(event, Recognised) and event.words[-1] == "stop"):
                urgent += over
                times.append((start + BLOCK) / SAMPLE_RATE_HZ)
    return times, urgent


def calls(stage: Stage, case: str, n: int, sir_db: float) -> None:
    heard, over, early, delays_s, spent_s, total_s = 0, 0, 0, [], 0.0, 0.0
    for seed in range(n):
        chooser = random.Random(seed)
        call = at_level(stage.call(chooser), SPEECH_DBFS + sir_db)
        speaker = stage.names[0] if case == "own" else stage.names[1]
        talk = at_level(stage.sentence(chooser, speaker), SPEECH_DBFS + (OWN_LOUDER_DB if case == "own" else 0.0))
        lead = round(LEAD_S * SAMPLE_RATE_HZ)
        at = lead + round(chooser.random() * max(len(talk) - len(call), 0))
        sound = room(lead + len(talk) + len(call) + SAMPLE_RATE_HZ, seed)
        if case != "nobody":
            sound[lead : lead + len(talk)] += talk
        sound[at : at + len(call)] += call
        end_s = (at + len(call)) / SAMPLE_RATE_HZ
        ears = stage.ears()
        built_s = time.process_time()
        times, urgent = listen(ears, sound, (lead, lead + len(talk)) if case == "own" else (0, 0))
        spent_s, total_s = spent_s + time.process_time() - built_s, total_s + len(sound) / SAMPLE_RATE_HZ
        begin_s = at / SAMPLE_RATE_HZ
        in_time = [t - end_s for t in times if begin_s < t <= end_s + IN_TIME_S]
        heard, over, early = heard + bool(in_time), over + urgent, early + any(t <= begin_s for t in times)
        delays_s += in_time[:1]
    worst, mean = (max(delays_s), float(np.mean(delays_s))) if delays_s else (0.0, 0.0)
    print(
        f"{case:7} {heard:4d} of {n} within {IN_TIME_S} s (mean {mean:.2f} s, latest {worst:.2f} s), {over} by the "
        f"word alone, {early} before anybody called, {spent_s / total_s:.3f} of real time",
        flush=True,
    )


def false_stops(stage: Stage, minutes: float, data: Path | None) -> None:
    chooser, ears, n, stops, spent_s = random.Random(1), stage.ears(), 0, 0, 0.0
    while n < minutes * 60.0 * SAMPLE_RATE_HZ:
        talk = at_level(stage.sentence(chooser, chooser.choice(stage.names)), SPEECH_DBFS)
        gap = round(chooser.uniform(*GAP_S) * SAMPLE_RATE_HZ)
        sound = room(len(talk) + gap, n % 100_003)
        sound[gap:] += talk
        began_s = time.process_time()
        stops += len(listen(ears, sound)[0])
        spent_s += time.process_time() - began_s
        n += len(sound)
    heard_s = n / SAMPLE_RATE_HZ
    print(f"robots' own talk: {stops} false stops in {heard_s / 60.0:.1f} min, {spent_s / heard_s:.3f} of real time")
    if data is None:
        return
    ears, n, stops = stage.ears(), 0, 0
    for path in sorted(data.rglob("*.wav")):
        sound = np.asarray(read_wav(path), np.float32)
        stops += len(listen(ears, sound)[0])
        n += len(sound)
        if n >= minutes * 60.0 * SAMPLE_RATE_HZ:
            break
    print(f"people's talk: {stops} false stops in {n / SAMPLE_RATE_HZ / 60.0:.1f} min", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=100)
    parser.add_argument("--sir-db", type=float, default=0.0, help="the call's level over the talk's")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--cases", default="other,own,nobody,false")
    parser.add_argument("--names", default="Rob,Bot")
    o = parser.parse_args()
    stage = Stage(tuple(o.names.split(",")))
    for case in o.cases.split(","):
        if case == "false":
            false_stops(stage, o.minutes, o.data)
        else:
            calls(stage, case, o.calls, o.sir_db)


if __name__ == "__main__":
    main()
