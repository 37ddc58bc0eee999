"""The worth of each mechanism of the ear: the same sound is heard with the mechanism and without it.

    python -m benchmarks.ablation [--only NAME,...] [--conditions NAME,...] [--modes first] [--sentences 8]
        [--minutes 3] [--names Mia,Ted,Gus,Rex] [--seed 7] [--data DIR] [--out FILE.csv]

Sentences are those of `python -m benchmarks.hearing --rows worlds`, each heard by the fresh ears of a whole robot, and
minutes of made sounds in which nobody speaks. A line tells what taking the mechanism out changed, sentence by sentence:
how many right ones were lost and others won, how many more were wrong or fewer, with the probability of so uneven a
change by chance (McNemar's exact test); sentences and stops made of sounds; the processor's time against the whole
ear's; and the lines of code that would go. `nothing` marks what costs nothing that is significant (5 %): with few
sentences that says little, so see how many changed.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from scipy.stats import binomtest

from benchmarks.ablation.mechanisms import ALL, Mechanism
from benchmarks.ablation.switches import Switch
from benchmarks.hearing.material import Team, make_team
from benchmarks.hearing.worlds import sounds
from benchmarks.hearing.worlds.conditions import conditions
from benchmarks.hearing.worlds.run import robot_recogniser
from benchmarks.hearing.worlds.trials import Tally, Trial, make_trial, ours

CONDITIONS = "small-living,chain,good-vacuum,clock,doppler,measured,measured-5,next-room,chapel,two+6,stop,drawn"
SIGNIFICANT = 0.05
HEADING = (
    f"{'without':20} {'right':>9} {'lost':>5} {'won':>4} {'p':>6}  {'wrong':>5} {'more':>5} {'less':>5} {'p':>6}"
    f"  {'made up':>7} {'stops':>5}  {'time':>5}  lines"
)


@dataclass(frozen=True)
class Outcome:
    """What the ears made of all trials and of the sounds."""

    tally: Tally
    sounds: sounds.Heard

    @property
    def seconds(self) -> float:
        """Of the processor."""
        return self.tally.seconds + self.sounds.seconds


@dataclass(frozen=True)
class Change:
    """Of one outcome, sentence by sentence: so many have it no more, and so many have it now."""

    less: int
    more: int

    @property
    def p(self) -> float:
        """The probability of a change at least so uneven by chance (McNemar's exact test)."""
        n = self.less + self.more
        return float(binomtest(self.less, n).pvalue) if n else 1.0


def change(before: Tally, after: Tally, outcome: str) -> Change:
    """What became of those with that outcome."""
    pairs = [(b.outcome == outcome, a.outcome == outcome) for b, a in zip(before.verdicts, after.verdicts, strict=True)]
    return Change(pairs.count((True, False)), pairs.count((False, True)))


class Bench:
    """The sound that all ears hear, made once."""

    def __init__(self, team: Team, trials: Sequence[Trial], minutes: float, seed: int) -> None:
        self.team, self.trials = team, trials
        self.clips = list(sounds.made(minutes, seed))

    def hear(self, switch: Switch = nullcontext) -> Outcome:
        """With the ears as they are, or with a part switched off. Raises LookupError if there is no such part."""
        tally = Tally()
        with switch():
            for trial in self.trials:
                tally.add(ours(robot_recogniser, self.team, trial))
            return Outcome(tally, sounds.listened(robot_recogniser, self.team, iter(self.clips)))


def line(name: str, lines: int, found: Outcome, whole: Outcome) -> str:
    """One line of the table."""
    right, wrong = (change(whole.tally, found.tally, outcome) for outcome in ("right", "wrong"))
    text = (
        f"{name:20} {found.tally.count('right'):4d}/{len(found.tally.verdicts):<4d} {right.less:5d} {right.more:4d} "
        f"{right.p:6.3f}  {found.tally.count('wrong'):5d} {wrong.more:5d} {wrong.less:5d} {wrong.p:6.3f}"
        f"  {len(found.sounds.sentences):7d} {len(found.sounds.stops):5d}  {found.seconds / whole.seconds:5.2f}"
        f"  {lines or '':5}"
    )
    made_up = Change(*sorted((len(found.sounds.sentences), len(whole.sounds.sentences))))
    stops = Change(*sorted((len(found.sounds.stops), len(whole.sounds.stops))))
    nothing = min(right.p, wrong.p, made_up.p, stops.p) >= SIGNIFICANT
    return text + ("  nothing" if nothing and found is not whole else "")


def row(mechanism: Mechanism, found: Outcome, whole: Outcome) -> list[object]:
    """The same for a file."""
    right, wrong = (change(whole.tally, found.tally, outcome) for outcome in ("right", "wrong"))
    counts = [found.tally.count(outcome) for outcome in ("right", "wrong", "lost")]
    made_up = [len(found.sounds.sentences), len(found.sounds.stops)]
    share = f"{found.seconds / whole.seconds:.3f}"
    changes = [right.less, right.more, f"{right.p:.4f}", wrong.more, wrong.less, f"{wrong.p:.4f}"]
    first = [mechanism.name, mechanism.what, len(found.tally.verdicts)]
    return [*first, *counts, *changes, *made_up, share, mechanism.lines]


COLUMNS = (
    "without what sentences right wrong lost right_lost right_won right_p wrong_more wrong_less wrong_p "
    "sentences_of_sounds stops_of_sounds time_share lines"
).split()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help=f"of {', '.join(m.name for m in ALL)}")
    parser.add_argument("--conditions", default=CONDITIONS, help=f"of the row worlds (default {CONDITIONS})")
    parser.add_argument("--modes", default="first", help="first, acquainted or both (default first)")
    parser.add_argument("--sentences", type=int, default=8, help="of each condition and mode")
    parser.add_argument("--minutes", type=float, default=3.0, help="of made sounds")
    parser.add_argument("--names", default="Mia,Ted,Gus,Rex")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--data", type=Path, help="folder of rooms, noises and talk")
    parser.add_argument("--out", type=Path, help="the table as CSV")
    return parser


def main() -> None:
    o = _parser().parse_args()
    console = Console(width=250, soft_wrap=True, highlight=False)
    known = {m.name: m for m in ALL}
    unknown = [name for name in filter(None, o.only.split(",")) if name not in known]
    if unknown:
        sys.exit(f"--only: there is no {unknown[0]!r}; there are {', '.join(known)}")
    wanted = [known[name] for name in o.only.split(",")] if o.only else list(ALL)
    team = make_team(o.names.split(","))
    named = {condition.name: condition for condition in conditions(o.seed, o.data)}
    chosen = [named[name] for name in o.conditions.split(",") if name in named]
    trials = [
        make_trial(team, condition, number, o.seed, mode == "acquainted", o.data)
        for condition in chosen
        for mode in o.modes.split(",")
        for number in range(o.sentences)
    ]
    bench = Bench(team, trials, o.minutes, o.seed)
    whole = bench.hear()
    names = ", ".join(c.name for c in chosen)
    console.print(f"{names}: {len(whole.tally.verdicts)} sentences; {o.minutes:g} min of sounds", markup=False)
    console.print(HEADING, markup=False)
    console.print(line("(nothing)", 0, whole, whole), markup=False)
    rows = []
    for mechanism in wanted:
        try:
            found = bench.hear(mechanism.without)
        except LookupError as error:
            console.print(f"{mechanism.name:20} is gone: there is no {error.args[0]}", markup=False)
            continue
        console.print(line(mechanism.name, mechanism.lines, found, whole), markup=False)
        rows.append(row(mechanism, found, whole))
        if o.out is not None:
            with o.out.open("w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows([COLUMNS, *rows])


if __name__ == "__main__":
    main()
