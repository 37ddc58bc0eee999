"""A block of trials with sound: the same sentences through all listeners, at one distance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hvcpd.evaluation import listeners, plots
from hvcpd.evaluation.listeners import CALLED, CALLER
from hvcpd.evaluation.scene import Bench, heard_at, stream
from hvcpd.evaluation.statistics import Step, pivot
from hvcpd.evaluation.trials import Row, Trial
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import Samples

BLOCK_CALLS = 4
"""Calls in one stream, from one pair of places in the hall: few, because places differ more than calls."""
WAKE = f"Hi {CALLED}, I am {CALLER}"
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
    s, book = trial.settings, listeners.book(CALLED, CALLER)
    sentence = listeners.spoken(s["text"], book)
    heard = hear(
        [sentence] * s["calls"],
        s["distance_m"],
        Bench(robot_noise_db_spl=s["robot_noise_db_spl"]),
        trial.generator(),
        s["listeners"],
        book,
    )
    row: dict[str, Any] = dict(s)
    for name, got in heard.items():
        row |= counted(name, got, [" ".join(sentence[0])] * s["calls"])
    return row


def counted(listener: str, got: Sequence[str], wanted: Sequence[str]) -> Row:
    """The part of a row for one listener: how many of its results are those wanted, and those that are wrong."""
    pairs = list(zip(got, wanted, strict=True))
    return {
        listener: sum(a == b for a, b in pairs),
        f"{listener} wrong": sorted(a for a, b in pairs if a not in ("", b)),
    }


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
    return {name: listeners.MAKERS[name](book)(heard, said) for name in who_listens}


def who() -> list[str]:
    """The listeners on this machine that have the whole grammar."""
    return listeners.available(listeners.OURS, listeners.PEER)


def step(at: float, listener: str, rows: Sequence[Row]) -> Step:
    """Rows of one step added up for a listener."""
    right, calls = (sum(row[key] for row in rows) for key in (listener, "calls"))
    return Step(at, right, calls, sum(len(row[f"{listener} wrong"]) for row in rows))


def series_of(
    rows: Sequence[Row], condition: Callable[[Row], str] = lambda row: str(row["variant"])
) -> list[plots.Series]:
    """A line over distance for each condition and listener, in the rows' order."""
    found: dict[tuple[str, str], dict[float, list[Row]]] = {}
    for row in rows:
        for listener in row["listeners"]:
            found.setdefault((condition(row), listener), {}).setdefault(row["distance_m"], []).append(row)
    series = []
    for (name, listener), by_distance in found.items():
        steps = tuple(step(at, listener, here) for at, here in sorted(by_distance.items()))
        series.append(plots.Series(name, listener, steps, pivot(steps)))
    return series


def distances(quick: bool) -> tuple[float, ...]:
    """The paper's steps of 10 cm up to 4 m, then on to 20 m; for a quick run a few of them, densest around the paper's
    pivotal point."""
    if quick:
        return (0.6, 1.0, 1.2, 1.4, 2.0, 4.0, 7.0, 10.0, 14.0, 20.0)
    near = tuple(round(float(x), 1) for x in np.arange(1, 41) / 10.0)
    return (*near, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 14.0, 17.0, 20.0)
