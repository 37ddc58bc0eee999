"""Times how soon a whole team stands after one "stop" when its robots are too far apart to hear it all.

    python -m benchmarks.stop_relay [--seeds 1-200] [--robots 6] [--spread-m 30] [--earshot-m 9,13,19] [--loss 0]

State machines over air of words (hil_fakes). The robots stand in a row over --spread-m, each up to a metre off its
place. Whoever is within --earshot-m of a person beside one of them hears "stop"; the time counts from the word's end.
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Sequence

import numpy as np

from hil_fakes.word_channel import RECOGNITION_S, Conditions
from hil_fakes.word_mission import WordMission, WordPlan
from hil_fakes.word_plans import NAMES, random_tasks
from hvcpd.config.tasks import Place
from hvcpd.coordination.states import State
from hvcpd.evaluation.statistics import wilson
from hvcpd.language import messages as m

LIMIT_S = 3.0
CALLED_S = (30.0, 240.0)
"""When the call comes: during greetings, claims or reports."""
LISTENED_S = 30.0


def stand_after_s(seed: int, n: int, spread_m: float, earshot_m: float, loss: float) -> float:
    """The time after the call at which the last robot stands, s; inf if one does not."""
    rng = random.Random(seed)
    plan = WordPlan(NAMES[:n], random_tasks(3 * n, rng), seed, Conditions(loss=loss), earshot_m=earshot_m)
    mission = WordMission(plan)
    called_s, beside = rng.uniform(*CALLED_S), rng.randrange(n)
    places = [Place(k * spread_m / (n - 1) + rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)) for k in range(n)]

    def call() -> None:
        for name, place in zip(plan.names, places, strict=True):
            mission.bodies[name].halt(mission.air.now)
            mission.bodies[name].place = place
        for name, place in zip(plan.names, places, strict=True):
            if abs(place.x_m - places[beside].x_m) <= earshot_m:
                mission.robots[name].heard(m.Utterance(None, statement=m.Stop()), mission.air.now)
        mission.air.refresh()

    mission.at(called_s + RECOGNITION_S, call)
    mission.air.run_until(called_s + LISTENED_S)
    if any(robot.state is not State.STOPPED for robot in mission.robots.values()):
        return float("inf")
    return max(mission.halted_s[name] for name in plan.names) - called_s


def told(times_s: Sequence[float], what: str) -> str:
    """A line of the table."""
    soon = sum(t <= LIMIT_S for t in times_s)
    low, high = wilson(soon, len(times_s))
    standing = [t for t in times_s if np.isfinite(t)]
    last = f"{np.median(standing):.1f} s (median), {max(standing):.1f} s (last)" if standing else "never"
    return (
        f"{what}: all stood within {LIMIT_S:.0f} s in {soon} of {len(times_s)} ({100 * low:.0f} to {100 * high:.0f} "
        f"%), at all in {len(standing)}; after {last}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1-200")
    parser.add_argument("--robots", type=int, default=6)
    parser.add_argument("--spread-m", type=float, default=30.0)
    parser.add_argument("--earshot-m", default="9,13,19")
    parser.add_argument("--loss", type=float, default=0.0, help="the share of sentences that a listener misses")
    o = parser.parse_args()
    first, last = map(int, o.seeds.split("-"))
    for earshot_m in map(float, o.earshot_m.split(",")):
        seeds = range(first, last + 1)
        times_s = [stand_after_s(seed, o.robots, o.spread_m, earshot_m, o.loss) for seed in seeds]
        print(told(times_s, f"{o.robots} robots over {o.spread_m:.0f} m, voices heard {earshot_m:.0f} m"), flush=True)


if __name__ == "__main__":
    main()
