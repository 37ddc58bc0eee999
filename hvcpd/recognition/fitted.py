"""Fitted weights: one reviewed file, `fitted.json`, which `make fit` writes."""

from __future__ import annotations

import importlib.resources
import json
from functools import cache
from typing import Any


def fitted(section: str) -> dict[str, Any]:
    """The weights of one model: `fitted` (the date), `by`, `data` and `score` document their origin. Raises KeyError if
    there is no such model."""
    found: dict[str, Any] = _file()[section]
    return found


@cache
def _file() -> dict[str, Any]:
    text = importlib.resources.files("hvcpd.recognition").joinpath("fitted.json").read_text(encoding="utf-8")
    sections: dict[str, Any] = json.loads(text)
    return sections
