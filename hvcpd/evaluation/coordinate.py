"""The paper's coordinating mode: one robot orders the other to do a task. Success against distance."""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.evaluation import plots
from hvcpd.evaluation.calls import blocks, call, distances, series_of, who
from hvcpd.evaluation.listeners import CALLED, CALLER, OURS
from hvcpd.evaluation.missions import LIMIT_S, ONE, OTHER, Plot, doers, knows, repository, run
from hvcpd.evaluation.modes import SAID_ONCE, WHOLE, calls_each, mission_distances, missions, table_of
from hvcpd.evaluation.scene import FITTED_ROBOT_NOISE_DB_SPL, Bench
from hvcpd.evaluation.trials import Comparison, Experiment, Findings, Row, Scale, Trial
from hvcpd.evaluation.wake import PAPER_PIVOT_M, reached

PLANT = 5
ORDER = f"Hi {CALLED}, I am {CALLER}, water the yellow rose"
"""The paper's own example of an order, among our names."""


def _trials(scale: Scale) -> Sequence[Trial]:
    noise = FITTED_ROBOT_NOISE_DB_SPL
    said = {"variant": SAID_ONCE, "text": ORDER, "robot_noise_db_spl": noise, "listeners": who()}
    orders = blocks("coordinate", scale.seed, calls_each(scale), distances(scale.quick), **said)
    return [*orders, *missions("coordinate", scale, WHOLE, noise, mission_distances(scale.quick))]


def _run(trial: Trial) -> Row:
    """A block of orders, or a mission: whether the ordered robot watered the plant once, and the other knows."""
    if trial.settings["variant"] == SAID_ONCE:
        return call(trial)
    events, _ = run(trial, repository([Plot(PLANT)]), coordinator=ONE)
    done = doers(events) == {PLANT: [OTHER]} and knows(events, ONE, PLANT, OTHER)
    return {**trial.settings, OURS: int(done), f"{OURS} wrong": []}


def _summarise(rows: Sequence[Row]) -> Findings:
    series = series_of(rows)
    return Findings(
        "Coordinating: one robot orders, the other does",
        (
            f"Said once: “{ORDER}”, heard word for word, as the paper's robots say it. {WHOLE.capitalize()}: they "
            f"greet; {ONE} orders {OTHER} to water a plant, {OTHER} reads the order back, {ONE} confirms, {OTHER} "
            "waters and reports; what is not answered is said again. A mission counts if the plant was watered once, "
            f"by {OTHER}, within {LIMIT_S:g} s, and {ONE} knows. The paper's success falls after "
            f"{PAPER_PIVOT_M * 100:.0f} cm. Half succeed here:",
            *(f"{text}." for text in reached(series)),
        ),
        table_of(series),
        lambda figure: plots.against_distance(figure, series, "success, %", PAPER_PIVOT_M),
        Bench().assumptions(),
        beside=(
            Comparison("half of the orders succeed at", f"{PAPER_PIVOT_M * 100:.0f} cm", "; ".join(reached(series))),
        ),
    )


EXPERIMENT = Experiment("coordinate", _trials, _run, _summarise, ("pyroomacoustics",))
