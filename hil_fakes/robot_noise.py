"""The robot's own noise at its microphone: a fan, wheel motors. Of RMS 1, seeded by the generator handed in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hil_fakes.filters import one_pole
from hvcpd.ports import SAMPLE_RATE_HZ

FAN_BLADES_HZ = 280.0
"""A 40 mm fan of 7 blades at 2,400 rpm; its tones are the harmonics of this."""
FAN_CORNER_HZ = 700.0
"""Broad-band noise of the air falls by 6 dB an octave above."""
FAN_TONE_DB = -6.0
"""Its tones together, relative to the broad-band noise."""

MOTOR_HZ = 258.0
"""A Burger's wheel motor turns 258.5 times (ROBOTIS e-Manual) as fast as the wheel, which turns about once a second."""
MESH = (1.0, 3.0, 6.0, 10.0, 20.0)
"""Orders of that rotation which sound: the shaft, the commutator (three poles, both brushes) and the first pinion."""
MOTOR_HISS_DB = -10.0
"""The gears' broad-band noise, relative to the tones."""
MOTOR_SPEEDS = (0.5, 1.0)
"""Slowest and fastest of the full speed; a robot that drives to a place changes it every few seconds."""


def unit(sound: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sound, shape (n,), at RMS 1."""
    return np.asarray(sound / np.sqrt(np.mean(sound**2)))


def fan(n: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return air noise that falls above FAN_CORNER_HZ, and blade tones of slightly wandering speed: shape (n,),
    float64."""
    pole = np.exp(-2.0 * np.pi * FAN_CORNER_HZ / SAMPLE_RATE_HZ)
    air = unit(one_pole(rng.standard_normal(n), pole))
    phase = np.cumsum(FAN_BLADES_HZ * (1.0 + 0.004 * _wander(n, 2.0, rng))) * 2.0 * np.pi / SAMPLE_RATE_HZ
    tones = sum(np.sin(k * phase + k * k) / k for k in range(1, 6))
    return unit(air + unit(np.asarray(tones)) * 10.0 ** (FAN_TONE_DB / 20.0))


def motor(n: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return gears and commutator of a motor that changes its speed every 2 to 6 s, within 0.3 s, and wobbles by 1
    %: shape (n,), float64."""
    speed = np.empty(n)
    at = 0
    while at < n:
        length = int(rng.uniform(2.0, 6.0) * SAMPLE_RATE_HZ)
        speed[at : at + length] = rng.uniform(*MOTOR_SPEEDS)
        at += length
    ramp = int(0.3 * SAMPLE_RATE_HZ)
    sums = np.cumsum(np.concatenate([np.full(ramp, speed[0]), speed]))
    speed = (sums[ramp:] - sums[:-ramp]) / ramp * (1.0 + 0.01 * _wander(n, 8.0, rng))
    phase = np.cumsum(MOTOR_HZ * speed) * 2.0 * np.pi / SAMPLE_RATE_HZ
    tones = sum(np.sin(order * phase + order) / np.sqrt(order) for order in MESH)
    pole = np.exp(-2.0 * np.pi * 2000.0 / SAMPLE_RATE_HZ)
    hiss = unit(one_pole(rng.standard_normal(n), pole)) * 10.0 ** (MOTOR_HISS_DB / 20.0)
    return unit((unit(np.asarray(tones)) + hiss) * speed)


def _wander(n: int, hz: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """A slow random walk around 0, standard deviation about 1, that changes at rates up to `hz`."""
    points = max(int(n / SAMPLE_RATE_HZ * hz), 2) + 2
    values = rng.standard_normal(points)
    return np.interp(np.linspace(0.0, points - 1.0, n), np.arange(points), values)
