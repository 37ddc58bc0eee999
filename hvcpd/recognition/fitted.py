"""Fitted weights: one reviewed file, `fitted.json`, which `make fit` writes; and logistic regression."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

from hvcpd.errors import reading_own

LEAST_PROBABILITY = 1e-4
"""Smallest probability of an event, and of its opposite: no recogniser is more certain."""


def fitted(section: str) -> dict[str, Any]:
    """The weights of one model: `fitted` (the date), `by`, `data` and `score` document their origin. Raises KeyError if
    there is no such model."""
    return _file()[section]


def logistic(logit: float) -> float:
    """The probability with these log odds."""
    return 0.5 + 0.5 * math.tanh(0.5 * logit)


def fitted_probability(section: str, features: Iterable[float]) -> float:
    """The probability by a model of logistic regression: its log odds are the bias and the weighted sum of the
    features, in the order of the weights. Raises KeyError as `fitted`."""
    model = fitted(section)
    return logistic(model["bias"] + sum(w * x for w, x in zip(model["weights"].values(), features, strict=True)))


def logit(probability: float) -> float:
    """The log odds of a probability, which counts as LEAST_PROBABILITY away from 0 and 1 at least."""
    probability = min(max(probability, LEAST_PROBABILITY), 1.0 - LEAST_PROBABILITY)
    return math.log(probability / (1.0 - probability))


@cache
def _file() -> dict[str, dict[str, Any]]:
    path = Path(__file__).with_name("fitted.json")
    with reading_own(path):
        sections: dict[str, dict[str, Any]] = json.loads(path.read_text("utf-8"))
    return sections
