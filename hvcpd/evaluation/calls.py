"""A block of trials with sound: the same sentences through all listeners, at one distance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hvcpd.evaluation import listeners, plots
from hvcpd.evaluation.scene import Bench, heard_at, stream
from hvcpd.evaluation.sphinx import sphinx_installed
from hvcpd.evaluation.statistics import Step, pivot
from hvcpd.evaluation.trials import Row, Trial
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import Samples

BLOCK_CALLS = 4
"""Calls in one stream, from one pair of places in the hall: few, because places differ more than calls."""
WAKE = f"Hi {listeners.CALLED}, I am {listeners.CALLER}"
"""One robot's call to another: the counterpart of the paper's wake word."""


def blocks(experiment: str, seed: int, trials: int, at_m: Sequence[float], **settings: Any) -> list[Trial]:
    """`trials` calls at each distance, in blocks of BLOCK_CALLS."""
    sizes = [min(BLOCK_CALLS, trials - first) for first in range(0, trials, BLOCK_CALLS)]
    return [
        Trial(experiment, seed, {**settings, "distance_m": distance_m, "calls": n, "block": k})
        for distance_m in at_m
        for k, n in enumerate(sizes)
    ]


def call(trial: Trial) -> Row:
    """Run a block: count the calls that each listener understands correctly, and its confusions.

    Settings: `text`, `calls`, `distance_m`, `robot_noise_db_spl` (or null), `listeners`.
    """
    s, rng = trial.settings, trial.generator()
    bench = replace(Bench(), robot_noise_db_spl=s["robot_noise_db_spl"])
    book = listeners.book()
    sentence = listeners.spoken(s["text"], book)
    words = " ".join(sentence[0])
    row: dict[str, Any] = dict(s)
    for name, got in hear([sentence] * s["calls"], s["distance_m"], bench, rng, s["listeners"], book).items():
        row[name] = sum(text == words for text in got)
        row[f"{name} wrong"] = sorted(text for text in got if text not in ("", words))
    return row


def hear(
    sentences: Sequence[tuple[tuple[str, ...], Samples]],
    distance_m: float,
    bench: Bench,
    rng: np.random.Generator,
    who_listens: Sequence[str],
    book: Phrasebook,
) -> dict[str, list[str]]:
    """Return each listener's result for each sentence, "" for nothing: the sentences, words and sound of shape (n,),
    float32, are said one after the other at that distance."""
    sound, said = stream(sentences, bench, rng)
    heard = heard_at(sound, distance_m, bench, rng)
    return {name: LISTENERS[name](heard, said, book) for name in who_listens}


LISTENERS = {listeners.OURS: listeners.ours, listeners.PEER: listeners.peer}


def who() -> list[str]:
    """The listeners available on this machine."""
    return [listeners.OURS, *([listeners.PEER] if sphinx_installed() else [])]


def summed(rows: Sequence[Row], by: Sequence[str]) -> dict[tuple[Any, ...], dict[str, Any]]:
    """Rows of blocks with the same settings `by`, added up: calls, right ones and substitutions of each listener."""
    found: dict[tuple[Any, ...], dict[str, Any]] = {}
    for row in rows:
        total = found.setdefault(tuple(row[name] for name in by), {"calls": 0})
        total["calls"] += row["calls"]
        for name in row["listeners"]:
            total[name] = total.get(name, 0) + row[name]
            total[f"{name} wrong"] = total.get(f"{name} wrong", 0) + len(row[f"{name} wrong"])
    return found


def series_by_noise(rows: Sequence[Row], condition: Callable[[float | None], str]) -> list[plots.Series]:
    """A line for each noise of the robot itself, with its name by `condition`, and each listener."""
    found = summed(rows, ("robot_noise_db_spl", "distance_m"))
    series = []
    for noise in dict.fromkeys(of for of, _ in found):
        here = sorted((distance_m, total) for (of, distance_m), total in found.items() if of == noise)
        for name in rows[0]["listeners"]:
            steps = tuple(Step(at, total[name], total["calls"], total[f"{name} wrong"]) for at, total in here)
            series.append(plots.Series(condition(noise), name, steps, pivot(steps)))
    return series


def distances(quick: bool) -> tuple[float, ...]:
    """The paper's steps of 10 cm up to 4 m, then on to 20 m; for a quick run a few of them, densest around the paper's
    pivotal point."""
    if quick:
        return (0.6, 1.0, 1.2, 1.4, 2.0, 4.0, 7.0, 10.0, 14.0, 20.0)
    near = tuple(round(float(x), 1) for x in np.arange(1, 41) / 10.0)
    return (*near, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 14.0, 17.0, 20.0)
