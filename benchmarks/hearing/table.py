"""The table: a line for each condition, ours and PocketSphinx's; the same as CSV."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.hearing.conditions import Condition
from benchmarks.hearing.scoring import Outcome, Score

HEADING = (
    f"{'condition':58} {'right':>8} {'95 % interval':>13} wrong garbled missed made-up  delay: mean, 95 %"
    f"  least conf.    rtf"
)
PEER_HEADING = " | PocketSphinx: right  wrong    rtf"


@dataclass(frozen=True)
class Result:
    """Both listeners' results for a condition; the sound itself is released."""

    group: str
    name: str
    value: float
    label: str
    ours: Score
    peer: Score | None


def result(condition: Condition, ours: Score, peer: Score | None) -> Result:
    c = condition
    return Result(c.group, c.name, c.value, c.label, ours, peer)


def line(r: Result) -> str:
    """One line of the table."""
    s = r.ours
    low, high = s.interval
    delays = s.delays_s or [float("nan")]
    text = (
        f"{r.label:58} {s.count(Outcome.RIGHT):4d}/{s.sentences:<4d}"
        f" {100 * low:5.1f}-{100 * high:5.1f} % {s.count(Outcome.WRONG):5d} {s.count(Outcome.GARBLED):7d}"
        f" {s.count(Outcome.MISSED):6d} {s.made_up:7d}     {np.mean(delays):5.2f}, {np.percentile(delays, 95):4.2f} s"
        f"  {min(s.confidences, default=float('nan')):11.2f} {s.realtime_factor:6.3f}"
    )
    if r.peer is not None:
        p = r.peer
        text += (
            f" | {p.count(Outcome.RIGHT):13d}/{p.sentences:<4d} {p.count(Outcome.WRONG):5d} {p.realtime_factor:6.3f}"
        )
    return text


def totals(results: Sequence[Result]) -> str:
    """Substitutions over all conditions."""
    sentences = sum(r.ours.sentences for r in results)
    wrong = sum(r.ours.count(Outcome.WRONG) for r in results)
    made_up = sum(r.ours.made_up for r in results)
    rate = 1000.0 * wrong / max(sentences, 1)
    text = f"{sentences} sentences: {wrong} substitutions ({rate:.1f} in 1,000), {made_up} made up"
    peers = [r.peer for r in results if r.peer is not None]
    if peers:
        theirs, n = sum(p.count(Outcome.WRONG) for p in peers), sum(p.sentences for p in peers)
        text += f"; PocketSphinx {theirs} of {n}"
    return text


COLUMNS = "group name value label listener sentences right wrong garbled missed made_up low high delay_s rtf".split()
OURS, THEIRS = "hvcpd", "PocketSphinx"


def write_csv(path: Path, results: Sequence[Result]) -> None:
    """One row for each condition and listener."""
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(COLUMNS)
        for r in results:
            for listener, s in ((OURS, r.ours), (THEIRS, r.peer)):
                if s is None:
                    continue
                counts = [s.count(o) for o in (Outcome.RIGHT, Outcome.WRONG, Outcome.GARBLED, Outcome.MISSED)]
                delay_s = f"{np.mean(s.delays_s):.3f}" if s.delays_s else ""
                out.writerow(
                    [r.group, r.name, f"{r.value:g}", r.label, listener, s.sentences, *counts, s.made_up]
                    + [f"{x:.4f}" for x in s.interval]
                    + [delay_s, f"{s.realtime_factor:.4f}"]
                )


def read_csv(path: Path) -> list[Result]:
    """An earlier run's counts, mean delay and real-time factor; nothing when there is no file."""
    if not path.exists():
        return []
    found: dict[tuple[str, str, float], dict[str, Score]] = {}
    labels: dict[tuple[str, str, float], str] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            key = (row["group"], row["name"], float(row["value"]))
            outcomes = [o for o in Outcome for _ in range(int(row[o.value]))]
            delays_s = [float(row["delay_s"])] if row["delay_s"] else []
            score = Score(outcomes, int(row["made_up"]), delays_s, seconds=float(row["rtf"]), heard_s=1.0)
            found.setdefault(key, {})[row["listener"]] = score
            labels[key] = row["label"]
    return [Result(*key, labels[key], scores[OURS], scores.get(THEIRS)) for key, scores in found.items()]


def joined(before: Sequence[Result], now: Sequence[Result]) -> list[Result]:
    """The results of an earlier run and of this one, which replace those of the same condition."""
    again = {(r.group, r.name, r.value) for r in now}
    return [*(r for r in before if (r.group, r.name, r.value) not in again), *now]
