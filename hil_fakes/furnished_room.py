"""Ways of sound in a furnished room, for the room of `room.py`: cheap enough for every mission, and needs no library.

Between two robots there are the direct way; the first reflections of floor, ceiling and walls (mirror images: Allen &
Berkley, JASA 65, 1979), each with its own delay that follows the robots sample by sample, so that echoes are shifted
as the direct sound is when robots drive; and a diffuse tail, noise that decays (Polack's model), as loud everywhere in
the room as its size and reverberation time make it. Memory does not grow with time or with where robots have been.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil_fakes.room import DelayLine, FreeField
from hvcpd.ports import SAMPLE_RATE_HZ


@dataclass(frozen=True)
class Wall:
    """A mirror: the image of the speaker lies `aside_m` to its side and `behind_m` behind it.

    `reflects` is the share of sound that it reflects.
    """

    aside_m: float
    behind_m: float
    reflects: float


@dataclass(frozen=True)
class Furniture:
    """Of the room: its walls as they lie around two robots, its volume in m³ and its reverberation time in s.

    By default a hall with furniture of 12 by 12 by 3 m, in which the paper's plants have their places. Loudspeakers and
    microphones are 0.25 m above a floor with a carpet, and 2.75 m below the ceiling.
    """

    walls: tuple[Wall, ...] = (
        Wall(0.5, 0.0, 0.5),
        Wall(5.5, 0.0, 0.7),
        Wall(7.0, 0.0, 0.6),
        Wall(11.0, 0.0, 0.6),
        Wall(0.0, 4.0, 0.6),
        Wall(0.0, 9.0, 0.6),
    )
    volume_m3: float = 430.0
    rt60_s: float = 0.45
    tail_from_s: float = 0.02
    """Reflections are single ones before and countless after it."""

    @property
    def critical_m(self) -> float:
        """As far from a loudspeaker its direct sound is as loud as the tail (Kuttruff, *Room Acoustics*, ch. 5)."""
        return 0.057 * math.sqrt(self.volume_m3 / self.rt60_s)

    def tail(self) -> NDArray[np.float64]:
        """The response to a pulse of energy 1 at 1 m, until it has decayed by 60 dB; the same every time.

        A room that has decayed before `tail_from_s` has none.
        """
        if self.rt60_s <= self.tail_from_s:
            return np.zeros(1)
        t_s = np.arange(round(self.rt60_s * SAMPLE_RATE_HZ)) / SAMPLE_RATE_HZ
        noise = np.random.default_rng(1).standard_normal(len(t_s)) * 10.0 ** (-3.0 * t_s / self.rt60_s)
        noise[: round(self.tail_from_s * SAMPLE_RATE_HZ)] = 0.0
        share = 10.0 ** (-6.0 * self.tail_from_s / self.rt60_s)  # the late part of the diffuse energy
        return np.asarray(noise * math.sqrt(share / float(np.sum(noise**2))) / self.critical_m)


STEP = 80
"""Samples to which the beginning of the tail is rounded up, 5 ms: there are not many spectra to keep."""


class FurnishedRoom(FreeField):
    """`Ways` with the echoes of a furnished room."""

    def __init__(self, furniture: Furniture | None = None) -> None:
        super().__init__()
        furniture = furniture or Furniture()
        self._walls, self._tail = furniture.walls, furniture.tail()
        self._spectra: dict[tuple[int, int], NDArray[np.complex128]] = {}
        self.reach = max(math.ceil(self._longest(self.max_distance_m)), self.reach) + len(self._tail)

    def latest(self, distance_m: float) -> float:
        return self._longest(distance_m) + len(self._tail)

    def carry(self, line: DelayLine, n: int, before_m: float, distance_m: float, gain: float) -> NDArray[np.float64]:
        heard = super().carry(line, n, before_m, distance_m, gain)
        for wall in self._walls:
            before, now = (math.hypot(wall.aside_m, wall.behind_m + d) for d in (before_m, distance_m))
            heard += wall.reflects * super().carry(line, n, before, now, gain)
        return heard + gain * self._diffuse(line, n, distance_m)

    def _longest(self, distance_m: float) -> float:
        images = (math.hypot(wall.aside_m, wall.behind_m + distance_m) for wall in self._walls)
        return max(images, default=distance_m) * self._samples_a_m

    def _diffuse(self, line: DelayLine, n: int, distance_m: float) -> NDArray[np.float64]:
        """The tail: none of it arrives before the direct sound."""
        length = len(self._tail)
        key = size, first = 1 << (length + n - 2).bit_length(), STEP * math.ceil(distance_m * self._samples_a_m / STEP)
        if key not in self._spectra:
            later = np.where(np.arange(length) < first, 0.0, self._tail)
            self._spectra[key] = np.asarray(np.fft.rfft(later, size))
        heard = np.fft.irfft(np.fft.rfft(line.last(length + n - 1), size) * self._spectra[key], size)
        return np.asarray(heard[length - 1 : length + n - 1])
