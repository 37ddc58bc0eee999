"""What a listening robot makes of the echo of its own sentences, which fades in the room, and of calls after them.

    python -m benchmarks.own_echo [--sentences 24] [--rt60 0.3,0.45,0.6,0.9] [--noise-dbfs -80,-60]
        [--past-s -0.25,0,0.3] [--call-dbfs -30] [--names Rob,Bot,Mia,Zed] [--seed 0]

The robot says a sentence every few seconds, its microphone 10 cm from its loudspeaker, in rooms as in
`benchmarks.own_voice`; its recogniser hears all that follows TAIL_S after each sentence. First nobody else is there:
what halts or stops the robot is false. Then a person 2 m away calls after each sentence, beginning --past-s after
TAIL_S. A call counts as heard when it halts or stops the robot from its beginning to 0.5 s after its end.
"""

from __future__ import annotations

import argparse
import random
from itertools import product

import numpy as np
from scipy.signal import fftconvolve

from benchmarks.own_voice import CALLER_M, OWN_M, TAIL_S, own_sentences, way
from benchmarks.stop import IN_TIME_S, Stage, at_level, room
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Held, Urgent

BLOCK = 320
PAUSE_S = 2.5
TAIL = round(TAIL_S * SAMPLE_RATE_HZ)


class Shift:
    """A robot's own sentences as its microphone has them, with a room's echo and noise."""

    def __init__(self, stage: Stage, n: int, rt60_s: float, noise_dbfs: float, seed: int) -> None:
        chooser, self._rng = random.Random(seed), np.random.default_rng(seed)
        played, self.spans = own_sentences(stage, chooser, 0, n, PAUSE_S)
        self._stage, self._rt60_s, self._chooser = stage, rt60_s, chooser
        echo = fftconvolve(played, way(rt60_s, OWN_M, self._rng))[: len(played)]
        self.heard = np.asarray(echo + room(len(echo), seed, noise_dbfs), np.float32)

    def call(self, past_s: float, dbfs: float) -> list[tuple[int, int]]:
        """Have a person call after each sentence; returns where, in samples."""
        places = []
        for _, end in self.spans:
            dry = at_level(self._stage.call(self._chooser), dbfs)
            at = end + TAIL + round(past_s * SAMPLE_RATE_HZ)
            sound = fftconvolve(dry, way(self._rt60_s, CALLER_M, self._rng))[: len(self.heard) - at]
            self.heard[at : at + len(sound)] += at_level(sound, dbfs)
            places.append((at, at + len(dry)))
        return places

    def listen(self) -> list[tuple[int, Event]]:
        """All events, and when they were told, in samples."""
        recogniser = self._stage.recogniser()
        sound: Samples = np.clip(self.heard, -1.0, 1.0)
        told = []
        for at in range(0, len(sound), BLOCK):
            own = any(begin <= at < end + TAIL for begin, end in self.spans)
            told += [(at + BLOCK, event) for event in recogniser.push(sound[at : at + BLOCK], masked=own)]
        return told


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sentences", type=int, default=24, help="in each room")
    parser.add_argument("--rt60", default="0.3,0.45,0.6,0.9")
    parser.add_argument("--noise-dbfs", default="-80,-60")
    parser.add_argument("--past-s", default="-0.25,0,0.3")
    parser.add_argument("--call-dbfs", type=float, default=-30.0)
    parser.add_argument("--names", default="Rob,Bot,Mia,Zed")
    parser.add_argument("--seed", type=int, default=0)
    o = parser.parse_args()
    stage = Stage(tuple(o.names.split(",")))
    for rt60_s, dbfs in product(map(float, o.rt60.split(",")), map(float, o.noise_dbfs.split(","))):
        quiet = Shift(stage, o.sentences, rt60_s, dbfs, o.seed).listen()
        halts, stops = (sum(isinstance(event, kind) for _, event in quiet) for kind in (Held, Urgent))
        print(f"RT60 {rt60_s} s, noise {dbfs:.0f} dBFS: {halts} halts, {stops} false stops; calls heard", end="")
        for past_s in map(float, o.past_s.split(",")) if o.past_s else ():
            shift = Shift(stage, o.sentences, rt60_s, dbfs, o.seed)
            calls = shift.call(past_s, o.call_dbfs)
            told = [at for at, event in shift.listen() if isinstance(event, Held | Urgent)]
            until = round(IN_TIME_S * SAMPLE_RATE_HZ)
            heard = sum(any(begin < at <= end + until for at in told) for begin, end in calls)
            print(f", {past_s:+.2f} s: {heard} of {len(calls)}", end="", flush=True)
        print(flush=True)


if __name__ == "__main__":
    main()
