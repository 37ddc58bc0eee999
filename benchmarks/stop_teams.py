"""False stops in the talk of teams of all kinds of names, through small loudspeakers in a furnished room.

    python -m benchmarks.stop_teams [--teams 40] [--sentences 10] [--seed 0]

Each team has four robots of other names. One of them listens, the others say random sentences, none of which says
stop, from 0.8 to 7 m away, in the room of `hvcpctl simulate`; nobody calls. Counted are stops for good, each of which
would end a mission, and holds, which pass. The interval is that of a Poisson rate, 95 %.
"""

from __future__ import annotations

import argparse
import random
from collections import Counter

import numpy as np
from scipy.stats import chi2

from benchmarks.hearing.material import GAP_S
from benchmarks.stop import REST_S, Listener, Stage, at_level, room
from hil_fakes.furnished_room import FurnishedRoom
from hil_fakes.loudspeakers import USUAL
from hil_fakes.room import DelayLine
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

NAMES = (
    "Siobhan Aoife Nguyen Shaun Sean Stella Steve Stan Bob Pop Otto Oscar Todd Don John Josh Scout Dot "
    "Rob Bot Ada Grace Ali Omar Fatima Wei Ling Hiro Yuki Priya Raj Arjun Olga Ivan Pablo Lola Carlos Bjorn "
    "Astrid Lars Femke Joost Chloe Zoe Noah Liam Emma Olivia Sophia Mia Lucas Ethan Mason Logan Jacob "
    "Charlotte Amelia Harper Evelyn Abigail Emily Ella Scarlett Sofia Hannah Luna Marvin Wally Robby Bender "
    "Tik Tok Kitt Hal Gort Dexter Pepper Cozmo Sparky Rusty Bolt Sprocket Widget"
).split()
NEAR_M, FAR_M = 0.8, 7.0
LEVELS_DBFS = (-45.0, -32.0)


def through_room(said: Samples, ways: FurnishedRoom, distance_m: float) -> Samples:
    """A sentence as it arrives, its echoes included, shape (n,)."""
    played = USUAL.play(np.pad(said, (0, ways.reach)))
    line = DelayLine(len(played) + ways.reach)
    line.write(played)
    return np.asarray(ways.carry(line, len(played), distance_m, distance_m, 1.0), np.float32)


def listen(names: tuple[str, ...], sentences: int, chooser: random.Random) -> tuple[Listener, Counter[str]]:
    """The first robot, after the sentences of the others; and who said those at which it stopped for good."""
    stage, ways = Stage(names), FurnishedRoom()
    listener, stopped = Listener(stage.recogniser()), Counter[str]()
    distances_m = {name: chooser.uniform(NEAR_M, FAR_M) for name in names[1:]}
    for k in range(sentences):
        speaker = chooser.choice(names[1:])
        said = through_room(stage.sentence(chooser, speaker), ways, distances_m[speaker])
        gap = round(chooser.uniform(*GAP_S) * SAMPLE_RATE_HZ)
        sound = room(gap + len(said), k)
        sound[gap:] += at_level(said, chooser.uniform(*LEVELS_DBFS))
        before = len(listener.stopped_s)
        listener.listen(sound)
        stopped[speaker] += len(listener.stopped_s) - before
    listener.listen(room(REST_S * SAMPLE_RATE_HZ, sentences))
    return listener, stopped


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--teams", type=int, default=40)
    parser.add_argument("--sentences", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    o = parser.parse_args()
    hours, stops, holds = 0.0, 0, 0
    for seed in range(o.seed, o.seed + o.teams):
        chooser = random.Random(seed)
        team = tuple(chooser.sample(NAMES, 4))
        listener, stopped = listen(team, o.sentences, chooser)
        hours += listener.now_s / 3600.0
        stops += len(listener.stopped_s)
        holds += len(listener.held_s)
        if listener.stopped_s:
            print(f"team {seed} ({', '.join(team)}): stopped at what {', '.join(+stopped)} said", flush=True)
    low, high = chi2.ppf(0.025, 2 * stops) / 2.0 if stops else 0.0, chi2.ppf(0.975, 2 * stops + 2) / 2.0
    rate = f"{stops / hours:.2f} an hour ({low / hours:.2f} to {high / hours:.2f})"
    held = f"{holds} holds, {holds / hours:.0f} an hour"
    print(f"{o.teams} teams, {60.0 * hours:.0f} min: {stops} false stops, {rate}; {held}")


if __name__ == "__main__":
    main()
