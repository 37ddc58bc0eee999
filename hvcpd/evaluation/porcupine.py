"""Porcupine 1.9, the last wake-word engine of the paper's vendor that needs no key: listens for its built-in words."""

from __future__ import annotations

import importlib.metadata
import importlib.util
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np

from hvcpd.evaluation.listeners import Said
from hvcpd.ports import Samples, samples_in

PORCUPINE = "Porcupine"
NAMES = ("Jarvis", "Bumblebee", "Terminator", "Computer")
"""Built-in words of Porcupine that can be a robot's name."""
LATE_S = 0.5
"""Longest delay from the end of a word to its report."""


def available() -> bool:
    """Whether a version that needs no key is installed."""
    if importlib.util.find_spec("pvporcupine") is None:
        return False
    return int(importlib.metadata.version("pvporcupine").split(".")[0]) < 2


@cache
def _engine() -> Any:
    import pvporcupine

    return pvporcupine.create(keywords=[name.lower() for name in NAMES])


def detections(heard: Samples) -> list[tuple[int, str]]:
    """Return every built-in word that Porcupine hears in the sound, shape (n,), float32, with the sample at which it
    reports it. Raises ImportError."""
    engine, found = _engine(), []
    sound = (np.clip(heard, -1, 1) * 32767).astype("<i2")
    for at in range(0, len(sound) - engine.frame_length + 1, engine.frame_length):
        index = engine.process(sound[at : at + engine.frame_length].tolist())
        if index >= 0:
            found.append((at + engine.frame_length, NAMES[index]))
    return found


def called(found: Iterable[tuple[int, str]], said: Sequence[Said]) -> list[str]:
    """The robots called in each sentence: the names reported while it was said, in order."""
    late, found = samples_in(LATE_S), list(found)
    return [" ".join(name.lower() for at, name in found if s.start < at <= s.end + late) for s in said]
