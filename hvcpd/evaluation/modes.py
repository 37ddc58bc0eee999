"""Common parts of the experiments with the paper's two working modes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hvcpd.evaluation import plots
from hvcpd.evaluation.listeners import OURS
from hvcpd.evaluation.trials import Scale, Table, Trial

SAID_ONCE, WHOLE = "said once", "whole robots"
QUICK_CALLS = 8
"""At each distance for a quick look."""


def calls_each(scale: Scale) -> int:
    """Number of repetitions at each distance."""
    return min(scale.trials, QUICK_CALLS) if scale.quick else scale.trials


def mission_distances(quick: bool) -> tuple[float, ...]:
    """Fewer than of calls, for missions cost more: round the pivotal distances of the paper and of ours."""
    if quick:
        return (4.0, 8.0, 12.0)
    return (0.4, 0.7, 1.0, 1.2, 1.4, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 14.0, 17.0)


def missions(
    experiment: str, scale: Scale, variant: str, noise_db_spl: float, at_m: Sequence[float], **settings: Any
) -> list[Trial]:
    """Trials of one mission of whole robots each."""
    common = {"variant": variant, "robot_noise_db_spl": noise_db_spl, "listeners": [OURS], "calls": 1, **settings}
    return [
        Trial(experiment, scale.seed, {**common, "distance_m": distance_m, "mission": k})
        for distance_m in at_m
        for k in range(scale.missions_each)
    ]


def table_of(series: Sequence[plots.Series]) -> Table:
    """The points of lines over distance."""
    return Table(
        ("variant", "listener", "distance_m", "trials", "right", "share", "low", "high"),
        tuple((s.condition, s.listener, at.at, at.n, at.right, *at.shares) for s in series for at in s.steps),
    )
