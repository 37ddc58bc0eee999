"""The paper's future work: teams of 2 to 12 robots. State machines as on the robots, over air of words."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from typing import Any

import numpy as np

from hil_fakes.word_mission import WordMission, WordPlan
from hil_fakes.word_plans import NAMES, omniscient_airtime_s, random_tasks
from hvcpd.evaluation.statistics import wilson
from hvcpd.evaluation.trials import Comparison, Experiment, Findings, Row, Scale, Table, Trial

TEAMS = (2, 3, 4, 6, 8, 10, 12)
TASKS_EACH = 3
ASSUMPTIONS = (
    "air of words: who speaks alone is understood by all, who speaks at once with another by nobody",
    f"{TASKS_EACH} tasks a robot at random places of a room of 12 by 12 m; robots drive 0.2 m/s and cannot collide",
)


def _trials(scale: Scale) -> Sequence[Trial]:
    missions = min(scale.trials, 5) if scale.quick else scale.trials
    return [Trial("robots", scale.seed, {"robots": n, "mission": k}) for n in TEAMS for k in range(missions)]


def _run(trial: Trial) -> Row:
    n = trial.settings["robots"]
    seed = int(trial.generator().integers(2**31))
    plan = WordPlan(NAMES[:n], random_tasks(TASKS_EACH * n, random.Random(seed)), seed)
    result = WordMission(plan).run()
    ended = math.isfinite(result.ended_s)
    return {
        "robots": n,
        "complete": ended and result.lost == 0 and result.duplicates == 0,
        "ended_s": result.ended_s if ended else None,
        "sent": result.sent,
        "collisions": result.collisions,
        "airtime_s": result.airtime_s,
        "least_s": omniscient_airtime_s(plan),
    }


def _summarise(rows: Sequence[Row]) -> Findings:
    teams = list(dict.fromkeys(row["robots"] for row in rows))
    table = tuple(_line(n, [row for row in rows if row["robots"] == n]) for n in teams)
    columns = "robots missions complete low high sentences collisions airtime_s times_least air_busy ended_s".split()
    good, of = (sum(row[k] for row in table) for k in (2, 1))
    first, last = table[0], table[-1]
    return Findings(
        "2 to 12 robots (the paper's future work)",
        (
            f"{good} of {of} missions ended with every task done exactly once. From {first[0]} to {last[0]} robots, "
            f"{TASKS_EACH} tasks each, the air is busy {first[9]:.0%} to {last[9]:.0%} of the time, with "
            f"{first[8]:.2f} to {last[8]:.2f} times the talk of a scheduler that knows all and is never interrupted; a "
            f"mission has {first[6]:.1f} to {last[6]:.1f} collisions. These missions are of words, not of sound.",
        ),
        Table(tuple(columns), table),
        lambda figure: _draw(figure, table),
        ASSUMPTIONS,
        beside=(
            Comparison(
                "robots in a team",
                "2; more is future work",
                f"{first[0]} to {last[0]}: {good} of {of} missions with every task done exactly once",
            ),
        ),
    )


def _line(n: int, rows: Sequence[Row]) -> tuple[Any, ...]:
    """A team's row of the table; shares and means, the last two over the missions that ended (nan if none did)."""

    def mean(values: Sequence[float], digits: int) -> float:
        return round(float(np.mean(values)), digits) if values else math.nan

    complete, ended = sum(row["complete"] for row in rows), [row for row in rows if row["ended_s"] is not None]
    return (
        n,
        len(rows),
        complete,
        *(round(end, 4) for end in wilson(complete, len(rows))),
        *(mean([row[k] for row in rows], 2) for k in ("sent", "collisions", "airtime_s")),
        mean([row["airtime_s"] / row["least_s"] for row in rows], 3),
        mean([row["airtime_s"] / row["ended_s"] for row in ended], 3),
        mean([row["ended_s"] for row in ended], 1),
    )


def _draw(figure: Any, table: Sequence[tuple[Any, ...]]) -> None:
    robots = [row[0] for row in table]
    panels = (
        ("missions complete, %", [100 * row[2] / row[1] for row in table], (0, 102)),
        ("air busy, %", [100 * row[9] for row in table], (0, None)),
        ("collisions a mission", [row[6] for row in table], (0, None)),
    )
    for axes, (label, values, limits) in zip(figure.subplots(1, 3), panels, strict=True):
        axes.plot(robots, values, marker="o", ms=4, color="#0072b2")
        axes.set(xlabel="robots", title=label, ylim=limits, xticks=robots[::2])
        axes.grid(alpha=0.25)


EXPERIMENT = Experiment("robots", _trials, _run, _summarise)
