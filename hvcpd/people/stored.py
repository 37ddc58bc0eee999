"""Numbers that were learned beforehand and come with the package."""

from __future__ import annotations

import importlib.resources
from typing import Any

import numpy as np
from numpy.typing import NDArray


def stored(name: str) -> dict[str, NDArray[Any]]:
    """The arrays in a file of this folder, by name, as they were written."""
    with (importlib.resources.files("hvcpd.people") / name).open("rb") as file:
        return dict(np.load(file, allow_pickle=False))
