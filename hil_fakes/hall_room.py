"""Ways of sound in a hall with echoes, for the room of `room.py`: robots that stand or drive in it."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hil_fakes.room import DelayLine
from hvcpd.ports import Samples

STEP_M = 0.25
"""Impulse responses are taken this far apart; from one to the next sound is cross-faded over a block."""
KEPT_DB = 60.0
"""A response is cut off where its remaining energy is this far below the whole, as in the reverberation time."""
LONGEST = 20_000
"""Samples that a response keeps at most, 1.25 s."""
_BLOCK = 400
"""Samples that are usually asked for at once; others work, a little more slowly."""
_FFT_STEP = 1024
"""Transforms are a multiple of this long: so all their prime factors are 2 or at most 19, and they are quick."""

Respond = Callable[[float], Samples]
"""The impulse response at a distance (m) that is a multiple of STEP_M: the flight time is in it, and direct sound has
power 1 at 1 m."""


class Echoing:
    """Between two robots at this distance, wherever in the hall they are."""

    def __init__(self, respond: Respond, max_distance_m: float) -> None:
        self.max_distance_m = max_distance_m
        self.reach = LONGEST
        self._respond = lru_cache(maxsize=128)(lambda step: shortened(respond(step * STEP_M)))
        self._spectrum = lru_cache(maxsize=128)(self._spectrum_of)

    def latest(self, distance_m: float) -> float:
        return len(self._respond(self._step(distance_m)))

    def carry(self, line: DelayLine, n: int, before_m: float, distance_m: float, gain: float) -> NDArray[np.float64]:
        now = self._step(distance_m)
        before = self._step(before_m)
        heard = self._convolved(line, n, now)
        if before != now:
            share = np.arange(1, n + 1) / n
            heard = share * heard + (1.0 - share) * self._convolved(line, n, before)
        return gain * heard

    def _step(self, distance_m: float) -> int:
        return max(round(distance_m / STEP_M), 1)

    def _convolved(self, line: DelayLine, n: int, step: int) -> NDArray[np.float64]:
        length = len(self._respond(step))
        size = -(-(length + max(n, _BLOCK) - 1) // _FFT_STEP) * _FFT_STEP
        heard = np.fft.irfft(np.fft.rfft(line.last(length + n - 1), size) * self._spectrum(step, size), size)
        return np.asarray(heard[length - 1 : length + n - 1], np.float64)

    def _spectrum_of(self, step: int, size: int) -> NDArray[np.complex128]:
        return np.asarray(np.fft.rfft(self._respond(step).astype(np.float64), size))


def shortened(response: Samples) -> Samples:
    """Return an impulse response, shape (n,), without its end, which holds so little of its energy that KEPT_DB lie
    between."""
    left = np.cumsum(np.square(response[::-1].astype(np.float64)))[::-1]
    end = int(np.searchsorted(-left, -left[0] * 10.0 ** (-KEPT_DB / 10.0)))
    return response[: min(max(end, 1), LONGEST)]


class Recorded:
    """Noise generated in advance; it starts again when it ends."""

    def __init__(self, sound: Samples) -> None:
        self._sound = sound
        self._at = 0

    def take(self, n: int) -> Samples:
        """Return the next samples, shape (n,), float32."""
        wanted = (self._at + np.arange(n)) % len(self._sound)
        self._at += n
        return self._sound[wanted]
