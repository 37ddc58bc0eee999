"""A trial: the smallest part of an experiment that is run, saved and repeated by itself."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Row = Mapping[str, Any]
"""The result of a trial, in types that JSON can hold."""


@dataclass(frozen=True)
class Trial:
    """The identity of a trial: the experiment, its settings, and the seed of the whole."""

    experiment: str
    seed: int
    settings: Mapping[str, Any]

    @property
    def key(self) -> str:
        """A key that is equal for equal trials, whatever the order of their settings."""
        return json.dumps([self.experiment, self.seed, self.settings], sort_keys=True)

    def generator(self) -> np.random.Generator:
        """Its own random generator: independent of every other trial's, the same wherever and whenever it is run."""
        digest = hashlib.sha256(self.key.encode()).digest()
        return np.random.default_rng(np.random.SeedSequence([self.seed, int.from_bytes(digest[:16], "big")]))


@dataclass(frozen=True)
class Scale:
    """The size of a run: `trials` at each step, and `missions` of whole robots."""

    seed: int = 1
    trials: int = 20
    quick: bool = False
    missions: int | None = None
    """None: as many as trials, or one for a quick look."""

    @property
    def missions_each(self) -> int:
        """Missions of whole robots at each step; one is a minute and more of two robots' life."""
        return self.missions or (1 if self.quick else self.trials)


@dataclass(frozen=True)
class Table:
    """Columns and rows of text or numbers, as the CSV and the report have them."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]


@dataclass(frozen=True)
class Comparison:
    """A figure of the paper's, and the same of this run."""

    what: str
    paper: str
    here: str


@dataclass(frozen=True)
class Findings:
    """The result of an experiment: paragraphs for the report, its table, a function that draws its plot on a matplotlib
    figure (if it has one), and the assumptions printed on that plot."""

    title: str
    paragraphs: tuple[str, ...]
    table: Table
    draw: Callable[[Any], None] | None = None
    assumptions: tuple[str, ...] = ()
    size_in: tuple[float, float] = (7.2, 4.6)
    beside: tuple[Comparison, ...] = ()
    """What stands at the head of the report."""


@dataclass(frozen=True)
class Experiment:
    """One of the paper's experiments: its trials, the function that runs one, and the summary of all their rows.

    `run` must be a function of a module, for it is sent to other processes; it raises nothing that a trial can bring
    about. `needs` names the modules without which it cannot be run.
    """

    name: str
    trials: Callable[[Scale], Sequence[Trial]]
    run: Callable[[Trial], Row]
    summarise: Callable[[Sequence[Row]], Findings]
    needs: tuple[str, ...] = ()
