"""Success rate of the call against distance, in the paper's steps."""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.evaluation import plots
from hvcpd.evaluation.calls import WAKE, blocks, call, distances, series_of, who
from hvcpd.evaluation.listeners import CALLED, CALLER, OURS, PEER
from hvcpd.evaluation.scene import FITTED_ROBOT_NOISE_DB_SPL, Bench
from hvcpd.evaluation.statistics import Pivot
from hvcpd.evaluation.trials import Comparison, Experiment, Findings, Row, Scale, Table, Trial

PAPER_PIVOT_M = 1.2
"""The paper's section IV-A: success falls sharply after 120 cm (20 trials a step; its source gives no points)."""
AS_STATED, AS_FITTED = "20 dB as stated", "with the robot's own noise"


def _trials(scale: Scale) -> Sequence[Trial]:
    noises = (FITTED_ROBOT_NOISE_DB_SPL,) if scale.quick else (FITTED_ROBOT_NOISE_DB_SPL, None)
    at_m, common = distances(scale.quick), {"text": WAKE, "listeners": who()}
    return [
        trial
        for noise in noises
        for trial in blocks("wake", scale.seed, scale.trials, at_m, robot_noise_db_spl=noise, **common)
    ]


def _summarise(rows: Sequence[Row]) -> Findings:
    series = series_of(rows, lambda row: AS_STATED if row["robot_noise_db_spl"] is None else AS_FITTED)
    table = tuple(
        (line.condition, line.listener, step.at, step.n, step.right, step.wrong, *step.shares)
        for line in series
        for step in line.steps
    )
    columns = ("condition", "listener", "distance_m", "calls", "right", "wrong", "share", "low", "high")
    return Findings(
        "The call",
        _paragraphs(series),
        Table(columns, table),
        lambda figure: plots.against_distance(figure, series, "calls understood, %", PAPER_PIVOT_M),
        Bench().assumptions(),
        beside=(
            Comparison(
                "half of the calls are understood at", f"{PAPER_PIVOT_M * 100:.0f} cm", "; ".join(reached(series))
            ),
        ),
    )


def reached(series: Sequence[plots.Series]) -> tuple[str, ...]:
    """The lines' pivotal distances, in the report's form."""
    return tuple(f"{s.listener}, {s.condition}: {s.pivot.text()}" for s in series)


def _paragraphs(series: Sequence[plots.Series]) -> tuple[str, ...]:
    texts = [
        f"“{WAKE}”, in {CALLER}'s voice, as {CALLED}'s microphone takes it. {CALLED} listens all the time and is not "
        f"told when it is called; {PEER} is told where each call begins and ends. Right is every word right. "
        f"The paper's robots have their pivotal distance at {PAPER_PIVOT_M * 100:.0f} cm. "
        "Where half of the calls are understood here:"
    ]
    texts += [f"{text}." for text in reached(series)]
    ours, theirs = (_of(series, AS_FITTED, name) for name in (OURS, PEER))
    if ours is not None and theirs is not None and ours.bounded and theirs.bounded and not theirs.sign:
        bound = {">": "more than ", "<": "less than "}.get(ours.sign, "")
        texts.append(
            f"In the room where the paper's class of recogniser reaches {theirs.at:.2f} m, ours reaches {bound}"
            f"{ours.at:.1f} m: {bound}{ours.at / theirs.at:.1f} times as far."
        )
    return tuple(texts)


def _of(series: Sequence[plots.Series], condition: str, listener: str) -> Pivot | None:
    return next((s.pivot for s in series if (s.condition, s.listener) == (condition, listener)), None)


EXPERIMENT = Experiment("wake", _trials, call, _summarise, ("pyroomacoustics",))
