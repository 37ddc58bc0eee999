"""The list of experiments."""

from __future__ import annotations

import importlib
import importlib.util
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hvcpd.evaluation.trials import Experiment  # numpy, which a list of names does not need

NAMES = ("wake", "coordinate", "volunteer", "trails", "pronunciation", "confusions", "robots", "medium", "peers", "fit")
ALL = tuple(name for name in NAMES if name != "fit")
"""What `all` runs: `fit` finds the room's one free value and is no experiment of the paper's."""


@cache
def experiment(name: str) -> Experiment:
    """The experiment of that name."""
    found: Experiment = importlib.import_module(f"hvcpd.evaluation.{name}").EXPERIMENT
    return found


def missing(name: str) -> tuple[str, ...]:
    """The modules that an experiment needs and that are not installed."""
    return tuple(module for module in experiment(name).needs if importlib.util.find_spec(module) is None)
