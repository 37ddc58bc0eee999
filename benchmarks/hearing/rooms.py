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
"""Reflections of higher order, which arrive after 0.35 s and more, are left out: their number grows with the cube."""
SOUND_SPEED_M_S = 343.0


def available() -> bool:
    """Whether pyroomacoustics is installed."""
    return importlib.util.find_spec("pyroomacoustics") is not None


@cache
def response(rt60_s: float, distance_m: float) -> tuple[Samples, int]:
    """Impulse response at that distance, scaled so that the direct sound at 1 m has gain 1; and its delay, samples."""
    import pyroomacoustics

    absorption, order = pyroomacoustics.inverse_sabine(rt60_s, list(SIZE_M))
    room = pyroomacoustics.ShoeBox(
        list(SIZE_M),
        SAMPLE_RATE_HZ,
        pyroomacoustics.Material(absorption),
        max_order=min(order, MAX_ORDER),
        air_absorption=True,
    )
    aside_m = min(ASIDE_M, 0.5 * distance_m)
    along_m = float(np.sqrt(distance_m**2 - aside_m**2))
    x, y, z = SPEAKER_M
    room.add_source([x, y, z])
    room.add_microphone([x + along_m, y + aside_m, z])
    room.compute_rir()
    impulse = np.asarray(room.rir[0][0], np.float32) * np.float32(4.0 * np.pi)
    lead = pyroomacoustics.constants.get("frac_delay_length") // 2
    return impulse, lead + round(distance_m / SOUND_SPEED_M_S * SAMPLE_RATE_HZ)


def through(sound: Samples, impulse: Samples) -> Samples:
    """The sound as it is heard there, of the same length."""
    return np.asarray(fftconvolve(sound, impulse)[: len(sound)], np.float32)
