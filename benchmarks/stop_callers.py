"""The callers of `benchmarks.stop`, and the acoustic path of their calls to the robot."""

from __future__ import annotations

import random
from collections.abc import Callable
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.signal import fftconvolve, lfilter

from benchmarks.keyword.clips import part_of, trimmed
from benchmarks.people_material import RATES_WPM, Foreigner, foreigners
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

CALLS = ("stop", "rob stop", "all stop")
HELD_OUT_VOICES = ("espeak-ng", "flite rms")
"""Of the foreign voices those of which the net has learned nothing."""
SMALL_HZ = (400.0, 5000.0)
"""A small loudspeaker's band."""


def ended(sound: Samples) -> Samples:
    """Cut off where it is no longer audible."""
    loud = np.flatnonzero(np.abs(sound) > 1e-3 * np.abs(sound).max())
    return sound[: loud[-1] + 1]


def is_held_out(path: Path) -> bool:
    """Whether the net has not learned from this recording: by speaker, if the file says who that is."""
    if path.parent.parent.name == "words":
        return part_of(path.name.split("_")[0]) == "test"
    return part_of(path.stem, half=True) == "test"


class Callers:
    """Calls in voices that no robot has, and the ways that they take."""

    def __init__(self, robots: Callable[[random.Random], Samples], data: Path | None) -> None:
        """`robots`: a call in a voice of the synthesizer's; `data`: with words/ and rooms/, if they are asked for."""
        self._robots = robots
        self._data = data

    def call(self, kind: str, chooser: random.Random) -> Samples:
        """A call by one of that kind."""
        if kind == "robots":
            return self._robots(chooser)
        if kind == "people":
            return ended(trimmed(np.asarray(read_wav(chooser.choice(self._people)), np.float32)))
        voices = [v for v in self._foreigners if v.name.startswith(kind)]
        said = chooser.choice(voices).say([chooser.choice(CALLS).split()], chooser.choice(RATES_WPM))
        return ended(trimmed(said))

    def through(self, sound: Samples, world: str, chooser: random.Random) -> Samples:
        """As it arrives: "near", from across a "room" that the net does not know, through a small "loudspeaker"."""
        if world == "near":
            return sound
        if world == "room":
            response = np.asarray(read_wav(chooser.choice(self._rooms)), np.float64)
            out = fftconvolve(sound, response / np.sqrt(np.sum(response**2)))
        else:
            low, high = (float(np.exp(-2.0 * np.pi * hz / SAMPLE_RATE_HZ)) for hz in SMALL_HZ)
            out = sound - lfilter([1.0 - low], [1.0, -low], sound)
            out = lfilter([1.0 - high], [1.0, -high], lfilter([1.0 - high], [1.0, -high], out))
        return np.asarray(out, np.float32)

    @cached_property
    def _foreigners(self) -> list[Foreigner]:
        return [f for f in foreigners() if f.name.startswith(HELD_OUT_VOICES)]

    @cached_property
    def _people(self) -> list[Path]:
        return [path for path in sorted(self._folder("words/stop").glob("*.wav")) if is_held_out(path)]

    @cached_property
    def _rooms(self) -> list[Path]:
        return sorted(self._folder("rooms").glob("bbc_*.wav"))

    def _folder(self, name: str) -> Path:
        if self._data is None or not (self._data / name).is_dir():
            raise SystemExit(f"{name}: there are no recordings (--data)")
        return self._data / name
