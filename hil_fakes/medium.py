"""Open air and open water: sound that goes straight on, spreads over a sphere, and is absorbed the more the higher."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hil_fakes.room import DelayLine, FreeField
from hvcpd.ports import SAMPLE_RATE_HZ

Absorption = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Of frequencies (Hz), dB a metre."""

WATER_C, DEPTH_KM = 10.0, 0.01
WATER_M_S = 1490.0
"""Sea water of 10 °C, 35 g of salt a kilogram, at 10 m (K. V. Mackenzie, JASA 70, 1981: 1489.97 m/s)."""
TAPS = 65
"""Length of the filter: 4 ms, because absorption changes slowly with frequency."""
_HALF = TAPS // 2
_STEPS_A_DOUBLING = 48
"""A filter serves for distances of so fine a step: absorption within 1.5 %."""


def air_db_m(hz: NDArray[np.float64], celsius: float = 20.0, humidity_percent: float = 50.0) -> NDArray[np.float64]:
    """Return the absorption of still air at sea level, dB/m, shape as `hz` (ISO 9613-1:1993, equations 3 to 5 and
    B.3)."""
    kelvin = celsius + 273.15
    warmth = kelvin / 293.15
    vapour = humidity_percent * 10.0 ** (-6.8346 * (273.16 / kelvin) ** 1.261 + 4.6151)
    oxygen_hz = 24.0 + 4.04e4 * vapour * (0.02 + vapour) / (0.391 + vapour)
    nitrogen_hz = warmth**-0.5 * (9.0 + 280.0 * vapour * math.exp(-4.170 * (warmth ** (-1.0 / 3.0) - 1.0)))
    classical = 1.84e-11 * warmth**0.5
    oxygen = 0.01275 * math.exp(-2239.1 / kelvin) / (oxygen_hz + hz**2 / oxygen_hz)
    nitrogen = 0.1068 * math.exp(-3352.0 / kelvin) / (nitrogen_hz + hz**2 / nitrogen_hz)
    return np.asarray(8.686 * hz**2 * (classical + warmth**-2.5 * (oxygen + nitrogen)))


def water_db_m(hz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the absorption of that sea water, of pH 8, dB/m, shape as `hz` (M. A. Ainslie & J. G. McColm, JASA 103,
    1998)."""
    khz = hz / 1000.0
    boric, magnesium = 0.78 * math.exp(WATER_C / 26.0), 42.0 * math.exp(WATER_C / 17.0)
    db_km = (
        0.106 * boric * khz**2 / (boric**2 + khz**2)
        + 0.52 * (1.0 + WATER_C / 43.0) * magnesium * khz**2 / (magnesium**2 + khz**2) * math.exp(-DEPTH_KM / 6.0)
        + 0.00049 * khz**2 * math.exp(-(WATER_C / 27.0 + DEPTH_KM / 17.0))
    )
    return np.asarray(db_km / 1000.0)


class Absorbing(FreeField):
    """Free field in a medium that absorbs."""

    def __init__(self, sound_speed_m_s: float, max_distance_m: float, absorption: Absorption) -> None:
        super().__init__(sound_speed_m_s, max_distance_m)
        self._taps = lru_cache(maxsize=64)(lambda step: taps(absorption, 2.0 ** (step / _STEPS_A_DOUBLING)))

    def carry(self, line: DelayLine, n: int, before_m: float, distance_m: float, gain: float) -> NDArray[np.float64]:
        ways_m = np.concatenate([np.full(TAPS - 1, before_m), np.linspace(before_m, distance_m, n)])
        delays = np.maximum(ways_m * self._samples_a_m - _HALF, 2.0)  # the filter's own delay is taken off the way's
        arrived = gain / ways_m * line.read(len(ways_m), delays)
        return np.convolve(arrived, self._taps(round(_STEPS_A_DOUBLING * math.log2(distance_m))), "valid")


def taps(absorption: Absorption, distance_m: float) -> NDArray[np.float64]:
    """Return a filter of linear phase, shape (TAPS,), with the medium's absorption over that distance (frequency
    sampling, Hann window)."""
    hz = np.asarray(np.fft.rfftfreq(512, 1.0 / SAMPLE_RATE_HZ), np.float64)
    impulse = np.fft.irfft(10.0 ** (-absorption(hz) * distance_m / 20.0))
    return np.asarray(np.roll(impulse, _HALF)[:TAPS] * np.hanning(TAPS + 2)[1:-1])
