"""Missions through a corridor in both directions: counts robots that met inside, and how long each waited."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, field

from hil_fakes.word_traffic import TrafficMission, corridor_plan
from hvcpd.evaluation.statistics import wilson

WAIT_MAX_S = 60.0
"""Nobody is to wait longer."""


@dataclass
class Tally:
    """The results of all missions."""

    missions: int = 0
    tasks: int = 0
    sent: int = 0
    passages: int = 0
    met: int = 0
    wrecks: int = 0
    endless: int = 0
    lost: int = 0
    long: int = 0
    """Missions in which one waited longer than WAIT_MAX_S, and nobody stood in the corridor switched off."""
    waits_s: list[float] = field(default_factory=list)
    blocked_s: list[float] = field(default_factory=list)

    def add(self, mission: TrafficMission, seed: int) -> None:
        """Add a mission, and print it if anything in it went wrong."""
        plan, result, t = mission.plan, mission.run(), mission.traffic
        self.missions, self.passages = self.missions + 1, self.passages + t.passages
        self.tasks, self.sent, self.lost = (
            self.tasks + len(plan.tasks),
            self.sent + result.sent,
            self.lost + result.lost,
        )
        self.met, self.wrecks = self.met + (t.collisions > 0), self.wrecks + (t.wrecks > 0)
        is_stuck = math.isinf(result.ended_s) or bool(mission.held)
        self.endless += is_stuck
        longest_s = max(t.waits_s, default=0.0)
        self.long += longest_s > WAIT_MAX_S
        self.waits_s += t.waits_s
        self.blocked_s += t.blocked_s
        if t.collisions or t.wrecks or longest_s > WAIT_MAX_S or result.lost or is_stuck:
            what = f"met {t.collisions}, wrecks {t.wrecks}, waited {longest_s:.0f} s, lost {result.lost}"
            ended = ", did not end" * is_stuck
            print(
                f"  seed {seed}: {len(plan.names)} robots, loss {plan.conditions.loss:.0%}: {what}{ended}", flush=True
            )


def corridor(o: argparse.Namespace) -> None:
    """Run the missions of `o.seeds` and print the counts, with intervals of 95 % (Wilson)."""
    first, _, last = o.seeds.partition("-")
    least, _, most = o.loss.partition("-")
    tally = Tally()
    for seed in range(int(first), int(last or first) + 1):
        loss = float(least), float(most or least)
        plan = corridor_plan(seed, loss=loss, outages_max=o.outages, inside=o.inside)
        tally.add(TrafficMission(plan), seed)
    n, waits_s = tally.missions, sorted(tally.waits_s) or [0.0]
    print(f"{n} missions, {tally.passages} passages, {tally.sent / tally.tasks:.1f} sentences a task")
    print(f"missions in which two met in the corridor: {tally.met}; share without: {_share(n - tally.met, n)}")
    print(f"missions in which one came upon another that was switched off in there: {tally.wrecks}")
    print(f"missions that did not end, or ended while one waited: {tally.endless}; tasks lost: {tally.lost}")
    mean_s, high_s = sum(waits_s) / len(waits_s), waits_s[int(0.95 * (len(waits_s) - 1))]
    print(f"{len(waits_s)} waits: mean {mean_s:.1f} s, 95 % within {high_s:.0f} s, longest {waits_s[-1]:.0f} s")
    print(f"missions with a wait over {WAIT_MAX_S:g} s: {tally.long}; share without: {_share(n - tally.long, n)}")
    longest_s = max(tally.blocked_s, default=0.0)
    print(f"waits while somebody stood in there switched off: {len(tally.blocked_s)}, longest {longest_s:.0f} s")


def _share(right: int, n: int) -> str:
    low, high = wilson(right, n)
    return f"{low:.4f} to {high:.4f}"
