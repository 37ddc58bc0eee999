"""Rendered units that come with the package, so that a robot's first start need not make them.

`release/words.py` writes them while the package is built: for each voice a FLAC file, its units one after another, and
one index of all, by the keys of the unit cache. A key is a digest of the synthesizer's source too, so what was built
from another source is never found.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import Samples

if TYPE_CHECKING:
    from soundfile import SoundFile

FOLDER = Path(__file__).parent / "shipped"
"""In an installed package; a working copy has none."""
INDEX = "index.json"
STEPS = np.float32(4_096.0)
"""Steps of a unit in a full scale of 1: their noise is 83 dB below it, and in each unit 60 dB or more below the speech.
One bit more makes the shipped words an eighth larger."""

Steps = NDArray[np.int16]


def in_steps(unit: Samples) -> Steps:
    """Return a unit, shape (n,), in whole steps; what is beyond 8 is cut off."""
    return np.asarray(np.clip(np.rint(unit * STEPS), -32_768, 32_767), np.int16)


def from_steps(steps: Steps) -> Samples:
    """Return the unit, shape (n,), float32, 1.0 = full scale."""
    return steps.astype(np.float32) / STEPS


class ShippedUnits:
    """The units of a folder as `release/words.py` writes it; none where the folder is missing or damaged."""

    def __init__(self, folder: Path = FOLDER) -> None:
        self._folder = folder
        self._open = lru_cache(1)(self._opened)  # the words of one voice are asked for together

    def get(self, key: str) -> Samples | None:
        """Return the unit of that key, shape (n,), float32; None if it is not among them."""
        at = self._places.get(key)
        if at is None:
            return None
        voice, start, length = at
        try:
            file = self._open(voice)
            file.seek(start)
            steps: Steps = file.read(length, dtype="int16")
        except (OSError, RuntimeError):  # libsndfile's errors are of the second kind
            return None
        return from_steps(steps) if steps.shape == (length,) else None

    def forget(self) -> None:
        """Give the memory back."""
        self._open.cache_clear()
        self.__dict__.pop("_places", None)

    @cached_property
    def _places(self) -> Mapping[str, tuple[str, int, int]]:
        """For each key the voice, and in its file the first sample and how many."""
        places: dict[str, tuple[str, int, int]] = {}
        try:
            index: dict[str, list[list[object]]] = json.loads((self._folder / INDEX).read_text(encoding="ascii"))
            for voice, units in index.items():
                start = 0
                for key, length in units:
                    places[str(key)] = voice, start, int(str(length))
                    start += int(str(length))
        except (OSError, ValueError, TypeError, AttributeError):
            return {}
        return places

    def _opened(self, voice: str) -> SoundFile:
        from soundfile import SoundFile

        return SoundFile(str(self._folder / f"{voice}.flac"))
