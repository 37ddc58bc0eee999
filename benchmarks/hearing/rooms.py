"""Rooms by the image-source method (Allen & Berkley, JASA 65, 1979), from pyroomacoustics (the `eval` extra)."""

from __future__ import annotations

import importlib.util
from functools import cache

import numpy as np
from scipy.signal import fftconvolve

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

RT60_S = (0.3, 0.45, 0.6)
DISTANCES_M = (0.5, 1.0, 2.0, 5.0, 10.0)
SIZE_M = (14.0, 6.0, 3.0)
"""A hall in which 10 m fit."""
SPEAKER_M = (2.0, 2.7, 0.25)
"""Where the speaker stands; loudspeakers and microphones are 25 cm above the floor, as on a TurtleBot3."""
ASIDE_M = 0.4
"""The listener stands this far aside of the straight line along the hall."""
MAX_ORDER = 40
"""Reflections of higher order are left out, as their number grows with the cube: of the shortest way, between floor and
ceiling, they arrive after 0.35 s and some 35 dB down."""
SOUND_SPEED_M_S = 343.0


def available() -> bool:
    """Whether pyroomacoustics is installed."""
    return importlib.util.find_spec("pyroomacoustics") is not None


@cache
def response(rt60_s: float, distance_m: float) -> tuple[Samples, int]:
    """Impulse response at that distance, scaled so that the direct sound at 1 m has power 1; and its delay, samples."""
    import pyroomacoustics

    impulse = _simulated(_absorption(rt60_s), MAX_ORDER, distance_m) / _direct_gain()
    lead = pyroomacoustics.constants.get("frac_delay_length") // 2
    return impulse, lead + round(distance_m / SOUND_SPEED_M_S * SAMPLE_RATE_HZ)


def _simulated(absorption: float, order: int, distance_m: float) -> Samples:
    import pyroomacoustics

    room = pyroomacoustics.ShoeBox(
        list(SIZE_M),
        fs=SAMPLE_RATE_HZ,
        materials=pyroomacoustics.Material(absorption),
        max_order=order,
        air_absorption=True,
    )
    aside_m = min(ASIDE_M, 0.5 * distance_m)
    along_m = float(np.sqrt(distance_m**2 - aside_m**2))
    x, y, z = SPEAKER_M
    room.add_source([x, y, z])
    room.add_microphone([x + along_m, y + aside_m, z])
    room.compute_rir()
    return np.asarray(room.rir[0][0], np.float32)


@cache
def _direct_gain() -> float:
    """The library's own scale, which differs between its versions."""
    return float(np.sqrt(np.square(_simulated(1.0 - 1e-6, 0, 1.0)).sum()))


@cache
def _absorption(rt60_s: float) -> float:
    """Of all six walls: Sabine's, made greater until the response at 5 m decays as fast as is wanted.

    Sabine's formula supposes a diffuse field; in a low hall of even walls the sound decays half as slowly again.
    """
    import pyroomacoustics

    absorption = float(pyroomacoustics.inverse_sabine(rt60_s, list(SIZE_M))[0])
    for _ in range(6):
        measured_s = decay_s(_simulated(absorption, MAX_ORDER, 5.0))
        absorption = 1.0 - (1.0 - absorption) ** (measured_s / rt60_s)  # Eyring: RT60 is as 1 / -log(1 - absorption)
    return absorption


def decay_s(impulse: Samples) -> float:
    """Reverberation time T20 (ISO 3382-2): from -5 to -25 dB of Schroeder's backward integral, times three."""
    left = np.cumsum(np.square(impulse[::-1].astype(np.float64)))[::-1]
    level_db = 10.0 * np.log10(np.maximum(left / left[0], 1e-12))
    return 3.0 * float(np.argmax(level_db < -25.0) - np.argmax(level_db < -5.0)) / SAMPLE_RATE_HZ


def through(sound: Samples, impulse: Samples) -> Samples:
    """The sound as it is heard there, of the same length."""
    return np.asarray(fftconvolve(sound, impulse)[: len(sound)], np.float32)
