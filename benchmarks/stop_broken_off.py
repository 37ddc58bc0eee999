"""Whether a robot hears another one that breaks off its sentence to say "stop".

    python -m benchmarks.stop_broken_off [--calls 24] [--pause-s 0.2] [--times 2] [--names Rob,Bot] [--seed 0]

The second robot's sentence ends at a random place, "stop" follows after --pause-s, and --times times in all, 1.2 s
apart. The first robot listens in a quiet room. A call counts as heard when the robot halts no later than 0.5 s after
the end of the first "stop", and as a stop for good within 3 s.
"""

from __future__ import annotations

import argparse
import random

import numpy as np

from benchmarks.stop import IN_TIME_S, SPEECH_DBFS, Listener, Stage, at_level, room
from hvcpd.coordination.actions import Timing
from hvcpd.evaluation.statistics import wilson
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

REST_S = 8.0
"""After each call: a call within 6 s of another one counts as its repetition."""
LEAST_S = 0.5
"""Of a sentence before it is broken off."""
FOR_GOOD_S = 3.0


def silence(duration_s: float) -> Samples:
    return np.zeros(round(duration_s * SAMPLE_RATE_HZ), np.float32)


def talk(stage: Stage, o: argparse.Namespace) -> tuple[Samples, list[float]]:
    """All calls one after the other, and the ends of their first "stop", s."""
    chooser, speaker = random.Random(o.seed), stage.names[1]
    stop = at_level(stage.stop(speaker), SPEECH_DBFS)
    parts, ends_s, at = [silence(2.0)], list[float](), 2.0
    for _ in range(o.calls):
        sentence = at_level(stage.sentence(chooser, speaker), SPEECH_DBFS)
        first = round(LEAST_S * SAMPLE_RATE_HZ)
        sentence = sentence[: chooser.randrange(first, max(len(sentence), first + 1))]
        again = [silence(Timing().stop_again_s - len(stop) / SAMPLE_RATE_HZ), stop] * (o.times - 1)
        new = [sentence, silence(o.pause_s), stop, *again, silence(REST_S)]
        ends_s.append(at + sum(map(len, new[:3])) / SAMPLE_RATE_HZ)
        at += sum(map(len, new)) / SAMPLE_RATE_HZ
        parts += new
    return np.concatenate(parts), ends_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=24)
    parser.add_argument("--pause-s", type=float, default=0.2)
    parser.add_argument("--times", type=int, default=2)
    parser.add_argument("--names", default="Rob,Bot")
    parser.add_argument("--seed", type=int, default=0)
    o = parser.parse_args()
    stage = Stage(tuple(o.names.split(",")))
    sound, ends_s = talk(stage, o)
    listener = Listener(stage.recogniser())
    listener.listen(sound + room(len(sound), o.seed))
    for what, told_s, within_s in (
        ("halted", listener.halts_s, IN_TIME_S),
        ("stopped for good", listener.stopped_s, FOR_GOOD_S),
    ):
        heard = sum(any(end - 1.0 <= t <= end + within_s for t in told_s) for end in ends_s)
        low, high = wilson(heard, o.calls)
        print(f"{heard} of {o.calls} {what} within {within_s} s ({100 * low:.0f} to {100 * high:.0f} %)")


if __name__ == "__main__":
    main()
