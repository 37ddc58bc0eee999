"""Detections of "stop" while the listening robot itself speaks, and false alarms.

    python -m benchmarks.own_voice [--calls 20] [--call-db -10] [--rt60 0.3,0.45,0.6] [--shifts-ms 0,20,-20]
        [--minutes 4] [--first 1] [--names Rob,Bot] [--seed 0] [--overlaps 60] [--overlap-db -15,-10,-5]
        [--gaps 0.5] [--steps 1] [--past-s 0.2] [--drive 3]

The robot's microphone is 10 cm from its loudspeaker, its latency known to within the shift. Rooms follow Polack's
model (exponentially decaying noise, at the direct-to-reverberant ratio of 60 cubic metres). The call, 2 m away, is
--call-db louder than the own voice as the microphone has it; the robot has said --first sentences before, from which it
knows the way through the room. A call counts as heard when it is told after its beginning and no later than 0.5 s after
its end. --gaps: so often a second the loudspeaker leaves out 25 to 300 ms, as on a busy computer; the robot knows when.
--steps: so often a second its sound is 10 to 300 ms later from then on, or earlier again; the robot is not told.
--past-s: the call ends that much later than the sentence. --drive: the loudspeaker distorts (the hyperbolic tangent of
so many times the voice, whose peak is 1). --overlaps: so often another robot begins to speak from 0.2 s before to 0.4 s
after this one, five people talk at once (babble), or somebody knocks at the table, each --overlap-db louder than the
own voice; all names take turns.
"""

from __future__ import annotations

import argparse
import random
import time
from itertools import product

import numpy as np
from scipy.signal import fftconvolve

from benchmarks.manner import add_manner, manner_of
from benchmarks.stop import IN_TIME_S, SPEECH_DBFS, Stage, at_level, room
from hvcpd.assembly.make import make_barge_in_detector
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.barge_in import DELAY_TOLERANCE_S, BargeInDetector
from hvcpd.recognition.events import Held, Released, Urgent

BLOCK = 320
OWN_DBFS = -15.0
OWN_M, CALLER_M = 0.1, 2.0
VOLUME_M3 = 60.0
SOUND_SPEED_M_S = 343.0
PAUSE_S, TAIL_S = 1.0, 0.12
STEPS_S = (0.01, 0.02, 0.05, 0.1, 0.3)
"""From a block of a card to what two clocks are allowed to drift apart."""
UNHEARD_S = (-0.2, 0.4)
"""A speaker who begins at least this much before or after the robot neither heard it nor was heard by it."""
SWAY_DB = 0.03
"""How much the path through the room varies, as when a person walks about."""


def way(rt60_s: float, distance_m: float, rng: np.random.Generator) -> Samples:
    """A room's impulse response; the direct sound has power 1 at any distance."""
    n = round(SAMPLE_RATE_HZ * rt60_s)
    critical_m = 0.057 * float(np.sqrt(VOLUME_M3 / rt60_s))
    ringing = rng.standard_normal(n) * 10.0 ** (-3.0 * np.arange(n) / n)
    ringing[: round(0.004 * SAMPLE_RATE_HZ)] = 0.0
    ringing *= distance_m / critical_m / np.sqrt(np.square(ringing).sum())
    ringing[0] = 1.0
    lead = np.zeros(round(distance_m / SOUND_SPEED_M_S * SAMPLE_RATE_HZ))
    return np.concatenate([lead, ringing]).astype(np.float32)


def own_sentences(
    stage: Stage, chooser: random.Random, speaker: int, n: int, pause_s: float
) -> tuple[Samples, list[tuple[int, int]]]:
    """Sentences of a robot with a pause before, between and after them, and the samples where each begins and ends."""
    pause = np.zeros(round(pause_s * SAMPLE_RATE_HZ), np.float32)
    parts, spans, at = [pause], list[tuple[int, int]](), len(pause)
    for _ in range(n):
        talk = at_level(stage.sentence(chooser, stage.names[speaker]), OWN_DBFS)
        spans.append((at, at + len(talk)))
        parts += [talk, pause]
        at += len(talk) + len(pause)
    return np.concatenate(parts), spans


class Trial:
    """Some of the robot's own sentences, as they are played and as they are heard."""

    def __init__(
        self,
        stage: Stage,
        n: int,
        rt60_s: float,
        shift_ms: float,
        seed: int,
        speaker: int = 0,
        gaps: float = 0.0,
        steps: float = 0.0,
        drive: float = 0.0,
    ) -> None:
        chooser, rng = random.Random(seed), np.random.default_rng(seed)
        self.played, self.spans = own_sentences(stage, chooser, speaker, n, PAUSE_S)
        late = round((DELAY_TOLERANCE_S + shift_ms / 1000.0) * SAMPLE_RATE_HZ)
        self.gaps: list[int] = []
        really = self._with_gaps(gaps, rng)
        if drive:
            peak = np.abs(really).max()
            really = np.asarray(np.tanh(drive * really / peak) / np.tanh(drive) * peak, np.float32)
        pause = round(PAUSE_S * SAMPLE_RATE_HZ)
        for begin, end in self.spans if steps else ():
            really[begin : end + pause] = with_steps(really[begin:end], pause, steps, rng)
        echo = np.concatenate([np.zeros(late), fftconvolve(really, way(rt60_s, OWN_M, rng))])[: len(self.played)]
        self.own_rms = float(np.sqrt(np.mean(np.square(echo[np.abs(self.played) > 1e-4]))))
        seconds = np.arange(len(echo)) / SAMPLE_RATE_HZ
        sway = 10.0 ** (SWAY_DB / 20.0 * np.sin(2.0 * np.pi * 0.7 * seconds + seed))
        self.heard = np.asarray(echo * sway + room(len(echo), seed), np.float32)

    def _with_gaps(self, gaps: float, rng: np.random.Generator) -> Samples:
        """What the loudspeaker really plays; the gaps are whole blocks of 25 ms."""
        really, at = self.played.copy(), 0
        while gaps and (at := at + round(rng.exponential(1.0 / gaps) * SAMPLE_RATE_HZ)) < len(really):
            n = 400 * int(rng.integers(1, 13))
            really[at : at + n] = 0.0
            self.gaps.append(at)
            at += n
        return really

    def call(
        self, stage: Stage, call_db: float, rt60_s: float, seed: int, past_s: float | None = None
    ) -> tuple[float, float]:
        """Have a person call over the last sentence, until `past_s` after it if that is given; returns when the call
        begins and ends, s."""
        chooser = random.Random(seed)
        dry = at_level(stage.call(chooser), SPEECH_DBFS)
        begin, end = self.spans[-1]
        at = begin + round(chooser.random() * max(end - begin - len(dry), 0))
        if past_s is not None:
            at = end + round(past_s * SAMPLE_RATE_HZ) - len(dry)
        self.add(dry, at, call_db, rt60_s, seed)
        return at / SAMPLE_RATE_HZ, (at + len(dry)) / SAMPLE_RATE_HZ

    def add(self, dry: Samples, at: int, louder_db: float, rt60_s: float, seed: int) -> None:
        """Have something else sound in the room from sample `at` on."""
        sound = fftconvolve(dry, way(rt60_s, CALLER_M, np.random.default_rng(seed + 1)))
        active = sound[: len(dry)][np.abs(dry) > 1e-4]
        sound = sound[: len(self.heard) - at]
        rms = float(np.sqrt(np.mean(np.square(active))))
        self.heard[at : at + len(sound)] += sound * self.own_rms * 10.0 ** (louder_db / 20.0) / rms

    def listen(self, recogniser: BargeInDetector) -> tuple[list[float], list[float], float]:
        """When "stop" was reported, s, when it was held to be possible, and the processor time."""
        told: dict[type, list[float]] = {Held: [], Released: [], Urgent: []}
        began_s, speaking = time.process_time(), False
        sound = np.clip(np.rint(self.heard * 32768.0) / 32768.0, -1.0, 1.0).astype(np.float32)
        for at in range(0, len(sound), BLOCK):
            begun = any(at <= begin < at + BLOCK for begin, _ in self.spans)
            over = any(at - BLOCK < end + TAIL_S * SAMPLE_RATE_HZ <= at for _, end in self.spans)
            if begun:
                recogniser.begin(at, 0.0)
            speaking = (speaking or begun) and not over
            if any(at <= gap < at + BLOCK for gap in self.gaps):
                recogniser.disturb()
            recogniser.play(self.played[at : at + BLOCK])
            for event in recogniser.hear(sound[at : at + BLOCK], speaking):
                told[type(event)].append((at + BLOCK) / SAMPLE_RATE_HZ)
        return told[Urgent], told[Held], time.process_time() - began_s

    @property
    def own_s(self) -> float:
        return sum(end - begin for begin, end in self.spans) / SAMPLE_RATE_HZ


def with_steps(talk: Samples, pause: int, steps: float, rng: np.random.Generator) -> Samples:
    """The sentence and a pause, in which again and again the sound comes later from then on, or earlier again."""
    pieces, at, late = [], 0, 0
    while at < len(talk):
        n = round(rng.exponential(1.0 / steps) * SAMPLE_RATE_HZ) + 1
        pieces.append(talk[at : at + n])
        at += n
        step = round(rng.choice(STEPS_S) * SAMPLE_RATE_HZ)
        if rng.random() < 0.5 and step <= late:
            at, late = at + step, late - step
        elif late + step <= pause:
            pieces.append(np.zeros(step, np.float32))
            late += step
    return np.concatenate([*pieces, np.zeros(len(talk) + pause, np.float32)])[: len(talk) + pause]


def other_sound(stage: Stage, kind: str, chooser: random.Random, speaker: int) -> Samples:
    """Sounds over a robot's sentence that do not say "stop"."""
    if kind == "knock":
        n = round(0.08 * SAMPLE_RATE_HZ)
        noise = np.random.default_rng(chooser.getrandbits(32)).standard_normal(n)
        return np.asarray(noise * np.exp(-6.0 * np.arange(n) / n), np.float32)
    others = [name for name in stage.names if name != stage.names[speaker]]
    voices = [chooser.choice(others)] if kind == "robot" else chooser.choices(others, k=5)
    talks = [at_level(stage.sentence(chooser, name), SPEECH_DBFS) for name in voices]
    mixed = np.zeros(max(map(len, talks)), np.float32)
    for talk in talks:
        mixed[: len(talk)] += talk
    return mixed


def overlaps(stage: Stage, kind: str, seeds: range, louder_db: float, rt60_s: float, n: int) -> None:
    """The number of robots that halt when another sound is played over the last of `n` own sentences."""
    stopped = list[int]()
    for seed in seeds:
        chooser, speaker = random.Random(seed), seed % len(stage.names)
        trial = Trial(stage, n, rt60_s, 0.0, seed, speaker)
        at = trial.spans[-1][0] + round(chooser.uniform(*UNHEARD_S) * SAMPLE_RATE_HZ)
        trial.add(other_sound(stage, kind, chooser, speaker), at, louder_db, rt60_s, seed)
        told, _, _ = trial.listen(make_barge_in_detector())
        stopped += [seed] if told else []
    print(
        f"{kind} at {louder_db:+.0f} dB, RT60 {rt60_s} s: {len(stopped)} of {len(seeds)} stopped the robot {stopped}",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=20)
    parser.add_argument("--call-db", type=float, default=-10.0)
    parser.add_argument("--rt60", default="0.3,0.45,0.6")
    parser.add_argument("--shifts-ms", default="0,20,-20")
    parser.add_argument("--minutes", type=float, default=4.0, help="of own talk for each room and shift")
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--names", default="Rob,Bot")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--overlaps", type=int, default=0)
    parser.add_argument("--gaps", type=float, default=0.0)
    parser.add_argument("--steps", type=float, default=0.0)
    parser.add_argument("--past-s", type=float)
    parser.add_argument("--drive", type=float, default=0.0)
    parser.add_argument("--overlap-db", default="-15,-10,-5")
    add_manner(parser)
    o = parser.parse_args()
    stage = Stage(tuple(o.names.split(",")), manner_of(o))
    for rt60_s, db in product(map(float, o.rt60.split(",")), map(float, o.overlap_db.split(","))):
        for kind in ("robot", "babble", "knock") if o.overlaps else ():
            overlaps(stage, kind, range(o.seed, o.seed + o.overlaps), db, rt60_s, o.first + 1)
    if not o.calls:
        return
    for rt60_s in map(float, o.rt60.split(",")):
        for shift_ms in map(float, o.shifts_ms.split(",")):
            lags, missed, sure = [], [], 0
            for seed in range(o.seed, o.seed + o.calls):
                trial = Trial(stage, o.first + 1, rt60_s, shift_ms, seed, 0, o.gaps, o.steps, o.drive)
                begin_s, end_s = trial.call(stage, o.call_db, rt60_s, seed, o.past_s)
                told, held, _ = trial.listen(make_barge_in_detector())
                in_time = [t - end_s for t in sorted(told + held) if begin_s < t <= end_s + IN_TIME_S]
                sure += any(begin_s < t <= end_s + IN_TIME_S for t in told)
                lags += in_time[:1]
                missed += [] if in_time else [seed]
            own_s, false, halts, spent_s, seed = 0.0, 0, 0, 0.0, o.seed + 100_000
            while own_s < 60.0 * o.minutes:
                trial = Trial(stage, 10, rt60_s, shift_ms, seed, 0, o.gaps, o.steps, o.drive)
                told, held, cpu_s = trial.listen(make_barge_in_detector())
                own_s, false, spent_s, seed = own_s + trial.own_s, false + len(told), spent_s + cpu_s, seed + 1
                halts += len(held)
            cost = spent_s / max(own_s, 1e-9)
            print(
                f"RT60 {rt60_s} s, {shift_ms:+.0f} ms: {len(lags)} of {o.calls} calls at {o.call_db:+.0f} dB heard, "
                f"{sure} for good, {max(lags, default=0.0):.2f} s after them at the latest"
                + (f" (not {missed})" if missed else "")
                + f"; {own_s / 60.0:.1f} min of own talk: {false} false stops, {halts} halts, {cost:.3f} of real time",
                flush=True,
            )


if __name__ == "__main__":
    main()
