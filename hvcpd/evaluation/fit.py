"""Fits the bench's one free value: the robot's own noise at which the paper's class of recogniser has its 120 cm."""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.evaluation import plots
from hvcpd.evaluation.calls import WAKE, blocks, call, step
from hvcpd.evaluation.listeners import PEER
from hvcpd.evaluation.scene import FITTED_ROBOT_NOISE_DB_SPL, Bench
from hvcpd.evaluation.statistics import pivot
from hvcpd.evaluation.trials import Experiment, Findings, Row, Scale, Table, Trial
from hvcpd.evaluation.wake import PAPER_PIVOT_M

LEVELS_DB_SPL = (50.0, 54.0, 56.0, 58.0, 60.0, 62.0, 66.0)


def _trials(scale: Scale) -> Sequence[Trial]:
    common = {"text": WAKE, "listeners": [PEER]}
    return [
        trial
        for level in LEVELS_DB_SPL
        for trial in blocks("fit", scale.seed, scale.trials, [PAPER_PIVOT_M], robot_noise_db_spl=level, **common)
    ]


def _summarise(rows: Sequence[Row]) -> Findings:
    levels = sorted({row["robot_noise_db_spl"] for row in rows})
    steps = tuple(step(at, PEER, [row for row in rows if row["robot_noise_db_spl"] == at]) for at in levels)
    half = pivot(steps)
    return Findings(
        "The room's one fitted value",
        (
            f"At {PAPER_PIVOT_M} m {PEER} understands half of the calls when the listening robot's own noise is "
            f"{half.text('dB SPL', 1)}. The bench has {FITTED_ROBOT_NOISE_DB_SPL:g} dB SPL "
            "(FITTED_ROBOT_NOISE_DB_SPL in hvcpd/evaluation/scene.py).",
        ),
        Table(("robot_noise_db_spl", "calls", "right"), tuple((s.at, s.n, s.right) for s in steps)),
        lambda figure: plots.shares(
            figure.add_subplot(),
            [plots.Series("at 1.2 m", PEER, steps, half)],
            "noise of the robot itself, dB SPL",
            "calls understood, %",
        ),
        Bench().assumptions(),
    )


EXPERIMENT = Experiment("fit", _trials, call, _summarise, ("pyroomacoustics", PEER.lower()))
