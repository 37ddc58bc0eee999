"""Rendered units that come with the package, so that a robot's first start need not make them.

`release/words.py` writes them while the package is built: for each voice a FLAC file, its units one after another, and
one index of all, by the keys of the unit cache. A key is a digest of the synthesizer's source too, so what was built
from another source is never found.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import Samples

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

    def get(self, key: str) -> Samples | None:
        """Return the unit of that key, shape (n,), float32; None if it is not among them.

        Opens the file each time, 0.15 ms more: several threads ask, and an open file has one position for all of them.
        """
        at = self._places.get(key)
        if at is None:
            return None
        from soundfile import SoundFile

        voice, start, length = at
        try:
            with SoundFile(str(self._folder / f"{voice}.flac")) as file:
                file.seek(start)
                steps: Steps = file.read(length, dtype="int16")
        except (OSError, RuntimeError):  # libsndfile's errors are of the second kind
            return None
        return from_steps(steps) if steps.shape == (length,) else None

    def forget(self) -> None:
        """Give the memory back."""
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
