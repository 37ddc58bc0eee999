"""Ours and the recognisers that people would pick instead, on the same audio: success, processor time, memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

from hvcpd.evaluation import plots
from hvcpd.evaluation.calls import BLOCK_CALLS, counted, hear, series_of
from hvcpd.evaluation.footprint import measured
from hvcpd.evaluation.listeners import CALLER, MAKERS, OURS, PEER, PORCUPINE, WAKE_WORDS, available, book, spoken
from hvcpd.evaluation.scene import FITTED_ROBOT_NOISE_DB_SPL, Bench, heard_at, stream
from hvcpd.evaluation.trials import Comparison, Experiment, Findings, Row, Scale, Table, Trial
from hvcpd.ports import Samples

NOISES_DB_SPL = (None, 40.0, 50.0, FITTED_ROBOT_NOISE_DB_SPL)
QUICK_NOISES_DB_SPL = (None, FITTED_ROBOT_NOISE_DB_SPL)
DISTANCES_M = (0.3, 0.6, 1.0, 1.2, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 14.0, 20.0)
QUICK_DISTANCES_M = (0.6, 1.2, 2.0, 4.0, 8.0, 14.0)
SUCCESS, COST = "success", "cost"
COST_CALLS = 12
"""In the sound that processor time is measured with: about a minute, half of it speech."""
COST_DISTANCE_M = 1.0


def _trials(scale: Scale) -> Sequence[Trial]:
    quick = scale.quick
    names, blocks = available(*MAKERS), -(-scale.trials // BLOCK_CALLS)
    found = [
        Trial(
            "peers",
            scale.seed,
            {"part": SUCCESS, "robot_noise_db_spl": noise, "distance_m": d, "listeners": names, "block": k},
        )
        for noise in (QUICK_NOISES_DB_SPL if quick else NOISES_DB_SPL)
        for d in (QUICK_DISTANCES_M if quick else DISTANCES_M)
        for k in range(blocks)
    ]
    noise = FITTED_ROBOT_NOISE_DB_SPL
    return [
        *found,
        *(Trial("peers", scale.seed, {"part": COST, "listener": n, "robot_noise_db_spl": noise}) for n in names),
    ]


def _run(trial: Trial) -> Row:
    return _success(trial) if trial.settings["part"] == SUCCESS else _cost(trial)


def _calls(names: Sequence[str]) -> list[tuple[tuple[str, ...], Samples]]:
    """Words and sound of a call to each of these robots."""
    return [spoken(f"Hi {name}, I am {CALLER}", book(*WAKE_WORDS, CALLER)) for name in names]


def _success(trial: Trial) -> Row:
    """Call each of the robots once; count the calls that each listener understands, Porcupine by the name alone."""
    s, rng = trial.settings, trial.generator()
    names = [WAKE_WORDS[k] for k in rng.permutation(len(WAKE_WORDS))]
    calls, bench = _calls(names), Bench(robot_noise_db_spl=s["robot_noise_db_spl"])
    row: dict[str, Any] = {**s, "calls": len(names)}
    heard = hear(calls, s["distance_m"], bench, rng, s["listeners"], book(*WAKE_WORDS, CALLER))
    for listener, got in heard.items():
        alone = listener == PORCUPINE
        wanted = [name.lower() if alone else " ".join(words) for name, (words, _) in zip(names, calls, strict=True)]
        row |= counted(listener, got, wanted)
    return row


def _cost(trial: Trial) -> Row:
    """Measured in a process of its own; it is the only result that varies from run to run."""
    s = trial.settings
    rng = replace(trial, settings={"part": COST}).generator()  # the same sound for all
    bench = Bench(robot_noise_db_spl=s["robot_noise_db_spl"])
    sound, said = stream(_calls(WAKE_WORDS) * (COST_CALLS // len(WAKE_WORDS)), bench, rng)
    return {**s, **asdict(measured(s["listener"], heard_at(sound, COST_DISTANCE_M, bench, rng), said))}


def _summarise(rows: Sequence[Row]) -> Findings:
    success = [row for row in rows if row["part"] == SUCCESS]
    costs = {row["listener"]: row for row in rows if row["part"] == COST}
    series = series_of(success, _condition)
    table = tuple(
        (line.condition, line.listener, step.at, step.n, step.right, step.wrong, *step.shares, *cost)
        for line in series
        for cost in [[costs.get(line.listener, {}).get(key, "") for key in ("share", "memory_mb")]]
        for step in line.steps
    )
    columns = "condition listener distance_m calls right wrong share low high processor_share memory_mb".split()
    return Findings(
        "Other recognisers on the same audio",
        (_about(), *_reached(series), *(_costs(name, row) for name, row in costs.items())),
        Table(tuple(columns), table),
        lambda figure: _draw(figure, series),
        Bench().assumptions("as titled"),
        (3.6 * len({s.condition for s in series}), 4.6),
        beside=(
            Comparison(
                "recogniser",
                "Picovoice, with a key from its vendor",
                "; ".join(f"{name}: {100 * row['share']:.1f} % of a core" for name, row in costs.items()),
            ),
        ),
    )


def _condition(row: Row) -> str:
    noise = row["robot_noise_db_spl"]
    return "robot silent" if noise is None else f"robot {noise:g} dB"


def _about() -> str:
    return (
        f"“Hi {WAKE_WORDS[0]}, I am {CALLER}” and the same to {', '.join(WAKE_WORDS[1:])}: names that are Porcupine's "
        f"built-in words. {OURS} and {PEER} must have every word right, with the same grammar; {PEER} is told where "
        f"each sentence begins and ends, {OURS} and {PORCUPINE} listen all the time. {PORCUPINE} (1.9, the last of "
        "the paper's vendor that needs no key) must hear the name alone. The voice is one of ours, which ours knows "
        "and the others do not."
    )


def _reached(series: Sequence[plots.Series]) -> list[str]:
    return [
        f"{s.listener}, {s.condition}: half of the calls at {s.pivot.text()}, {s.steps[0].right} of {s.steps[0].n} at "
        f"{s.steps[0].at:g} m."
        for s in series
    ]


def _costs(name: str, row: Row) -> str:
    return (
        f"{name}: {100 * row['share']:.1f} % of one core while it listens, {row['memory_mb']:.0f} MB resident at most "
        f"({row['bare_mb']:.0f} MB of it before the listener is made: Python, numpy and the grammar's modules), "
        f"{row['start_s']:.1f} s of processor time to start, on the machine that ran this."
    )


def _draw(figure: Any, series: Sequence[plots.Series]) -> None:
    conditions = list(dict.fromkeys(s.condition for s in series))
    for axes, condition in zip(
        figure.subplots(1, len(conditions), sharey=True, squeeze=False)[0], conditions, strict=True
    ):
        here = [s for s in series if s.condition == condition]
        plots.shares(axes, here, "distance, m", "calls understood, %" if condition == conditions[0] else "")
        plots.by_distance(axes, here)
        axes.set_title(condition, pad=30, fontsize=9)


EXPERIMENT = Experiment("peers", _trials, _run, _summarise, ("pyroomacoustics",))
