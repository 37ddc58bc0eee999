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


DAY_S = 86_400.0
KEPT_S = 30 * DAY_S
"""A unit that no start has needed for a month is deleted: of other names and tasks, or of an older synthesizer."""


class UnitCache:
    """A folder of `.npy` files. A file that cannot be read or written costs time, never an utterance."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._needed: set[Path] | None = set()
        """Until `tidy`."""

    def tidy(self, now_s: float) -> None:
        """Delete what nobody has needed for long; `now_s`: of the clock that files are dated by.

        To be called once, when all that is usually needed was asked for: that is dated anew, once a day at most, and
        kept whatever its date, for a robot may have been switched off for months, or have no clock.
        """
        needed, self._needed = self._needed or set(), None
        try:
            for path in self._folder.iterdir():
                age_s = now_s - path.stat().st_mtime
                if path in needed and age_s > DAY_S:
                    path.touch()
                elif path not in needed and age_s > KEPT_S and path.suffix in (".npy", ".part"):
                    path.unlink()
        except OSError:
            pass  # read-only, or another robot of this computer has just deleted it: the next start tries again

    def get(self, content: object, make: Callable[[], Samples]) -> Samples:
        """The unit of that content, from disk or made now; `content` must have a stable repr."""
        path = self._folder / (hashlib.sha256(f"{recipe()} {content!r}".encode()).hexdigest()[:32] + ".npy")
        if self._needed is not None:
            self._needed.add(path)
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
