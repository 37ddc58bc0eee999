"""The paper's five-plant mission: both robots' trails. Whole robots with sound and wheels, as `simulate` runs them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from hil_fakes.bench import Bench, BenchPlan
from hil_fakes.room import Air
from hvcpd.evaluation import listeners
from hvcpd.evaluation.trials import Comparison, Experiment, Findings, Row, Scale, Table, Trial
from hvcpd.reporting.events import Performed, Summary
from hvcpd.reporting.palette import ROBOT_LIGHT, task_colour

ROBOTS = ("Rob", "Bot")
PAPER_SHARES = (3, 2)
"""The plants that the paper's Rob and Bot watered (its figure 6)."""
EVERY = 20
"""Step between the points of a trail that are kept, which lie 25 ms apart: every half second, 10 cm of way."""
NOISE_DB_SPL = Air().noise_db_spl


def _trials(scale: Scale) -> Sequence[Trial]:
    plants = len(listeners.tasks().tasks)
    return [Trial("trails", scale.seed, {"robots": list(ROBOTS), "plants": plants, "noise_db_spl": NOISE_DB_SPL})]


def _run(trial: Trial) -> Row:
    s, tasks = trial.settings, listeners.tasks()
    tasks = replace(tasks, tasks=tasks.tasks[: s["plants"]])
    seed = int(trial.generator().integers(2**31))
    plan = BenchPlan(tuple(s["robots"]), tasks, seed, air=Air(noise_db_spl=s["noise_db_spl"]))
    record = Bench(plan, listeners.sound()).run()
    summary = next(e for e in record.events if isinstance(e, Summary))
    watered = [e for e in record.events if isinstance(e, Performed)]
    return {
        "plants": [[t.number, t.name, t.place.x_m, t.place.y_m] for t in tasks.tasks if t.place is not None],
        "trails": {
            t.robot: [
                [round(float(x), 3), round(float(y), 3)] for x, y in zip(t.x_m[::EVERY], t.y_m[::EVERY], strict=True)
            ]
            for t in record.trails
        },
        "watered": [[e.robot, e.task, round(e.at_s, 2)] for e in watered],
        "lost": summary.lost,
        "duplicates": summary.duplicates,
        "virtual_s": summary.virtual_s,
    }


def _summarise(rows: Sequence[Row]) -> Findings:
    (row,) = rows
    names = {number: name for number, name, _, _ in row["plants"]}
    table = tuple((robot, number, names[number], at_s) for robot, number, at_s in row["watered"])
    shares = [f"{robot} {sum(who == robot for who, *_ in row['watered'])}" for robot in ROBOTS]
    end = (
        "each exactly once"
        if not row["lost"] and not row["duplicates"]
        else (f"{row['lost']} lost, {row['duplicates']} done more than once")
    )
    return Findings(
        "Who waters which plant (the paper's trails)",
        (
            f"{len(row['watered'])} of {len(names)} plants were watered, {end}, in {row['virtual_s'] / 60:.1f} min: "
            f"{' and '.join(shares)}. The paper's Rob and Bot watered {PAPER_SHARES[0]} and {PAPER_SHARES[1]}, at "
            "the same places. The seed decides which robot takes which.",
        ),
        Table(("robot", "task", "name", "watered_s"), table),
        lambda figure: _draw(figure, row),
        (
            "two whole robots; sound in free field, speech 65 dB SPL at 1 m, "
            f"noise {NOISE_DB_SPL:g} dB SPL; wheels as TurtleBot3 Burger",
        ),
        (7.2, 4.2),
        beside=(
            Comparison(
                f"plants watered by {' and '.join(ROBOTS)}",
                " and ".join(map(str, PAPER_SHARES)),
                f"{' and '.join(shares)}, {end}",
            ),
        ),
    )


def _draw(figure: Any, row: Row) -> None:
    panels = figure.subplots(1, len(ROBOTS), sharex=True, sharey=True, squeeze=False)[0]
    for axes, robot, colour in zip(panels, ROBOTS, ROBOT_LIGHT, strict=False):
        points = row["trails"][robot]
        mine = {number for who, number, _ in row["watered"] if who == robot}
        for number, name, x_m, y_m in row["plants"]:
            face = task_colour(name) if number in mine else "none"
            axes.plot(x_m, y_m, "o", ms=11, mfc=face, mec=task_colour(name), mew=1.5)
        axes.plot([x for x, _ in points], [y for _, y in points], color=colour, lw=1.2)
        axes.plot(*points[0], "s", color=colour, ms=5)
        axes.set(title=f"{robot}: waters {len(mine)}", xlabel="x, m", ylabel="y, m", aspect="equal")
        axes.grid(alpha=0.25)


EXPERIMENT = Experiment("trails", _trials, _run, _summarise)
