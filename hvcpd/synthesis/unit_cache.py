"""Rendered units on disk, filed under a digest of everything that made them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np

from hvcpd.ports import Samples


@lru_cache(maxsize=1)
def recipe() -> str:
    """A digest of the synthesizer's own source: units that an older one rendered are not found any more."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    return hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()


class UnitCache:
    """A folder of `.npy` files. A file that cannot be read or written costs time, never an utterance."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def get(self, content: object, make: Callable[[], Samples]) -> Samples:
        """The unit of that content, from disk or made now; `content` must have a stable repr."""
        path = self._folder / (hashlib.sha256(f"{recipe()} {content!r}".encode()).hexdigest()[:32] + ".npy")
        found = _load(path)
        if found is not None:
            return found
        unit = make()
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            partial = path.with_suffix(".part")
            with partial.open("wb") as file:
                np.save(file, unit, allow_pickle=False)
            partial.replace(path)
        except OSError:
            pass  # a full or read-only disk must not silence the robot
        return unit


def _load(path: Path) -> Samples | None:
    try:
        unit = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    return unit if unit.dtype == np.float32 and unit.ndim == 1 and bool(np.isfinite(unit).all()) else None
