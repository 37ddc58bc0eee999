"""Fitted weights: one reviewed file, `fitted.json`, which `make fit` writes; and the logistic curve."""

from __future__ import annotations

import importlib.resources
import json
import math
from collections.abc import Iterable
from functools import cache
from typing import Any

CERTAIN = 1e-4
"""As good as impossible, or as certain: the recognisers know nothing better than that."""


def fitted(section: str) -> dict[str, Any]:
    """The weights of one model: `fitted` (the date), `by`, `data` and `score` document their origin. Raises KeyError if
    there is no such model."""
    found: dict[str, Any] = _file()[section]
    return found


def logistic(logit: float) -> float:
    """The probability whose odds have this natural logarithm."""
    return 1.0 / (1.0 + math.exp(-max(logit, -700.0)))


def curve(bias: float, weights: Iterable[float], features: Iterable[float]) -> float:
    """The probability by a logistic curve: the features times their weights are log odds."""
    return logistic(bias + sum(w * x for w, x in zip(weights, features, strict=True)))


def logit(probability: float) -> float:
    """The natural logarithm of a probability's odds, within CERTAIN of 0 and 1."""
    probability = min(max(probability, CERTAIN), 1.0 - CERTAIN)
    return math.log(probability / (1.0 - probability))


@cache
def _file() -> dict[str, Any]:
    text = importlib.resources.files("hvcpd.recognition").joinpath("fitted.json").read_text(encoding="utf-8")
    sections: dict[str, Any] = json.loads(text)
    return sections
