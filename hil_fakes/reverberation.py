"""Rooms by the image-source method (Allen & Berkley, JASA 65, 1979), from pyroomacoustics (the `eval` extra)."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

HEIGHT_M = 0.25
"""Of loudspeakers and microphones above the floor, as on a TurtleBot3."""
START_M = 2.0
"""From the end wall to the speaker."""
SPEAKER_SHARE = 0.45
"""Position of the speaker across the hall, as a share of its width."""
ASIDE_M = 0.4
"""The listener stands this far aside of the straight line along the hall."""
MAX_ORDER = 40
"""Reflections of higher order are left out, as their number grows with the cube: of the shortest way, between floor and
ceiling of 3 m, they arrive after 0.35 s and about 35 dB down."""
SOUND_SPEED_M_S = 343.0


def available() -> bool:
    """Whether pyroomacoustics is installed."""
    return importlib.util.find_spec("pyroomacoustics") is not None


@dataclass(frozen=True)
class Hall:
    """A box with walls of one material: length, width and height in m, and its reverberation time T20 in s."""

    size_m: tuple[float, float, float]
    rt60_s: float


@lru_cache(maxsize=64)  # about 180 KB each
def response(hall: Hall, distance_m: float, shift_m: float = 0.0) -> tuple[Samples, int]:
    """Return the impulse response at that distance, shape (n,), float32, and its delay, samples; direct sound at 1 m
    has power 1.

    `shift_m` moves both robots along the hall. Raises ImportError without pyroomacoustics.
    """
    import pyroomacoustics

    impulse = _simulated(hall, _absorption(hall), MAX_ORDER, distance_m, shift_m) / _direct_gain()
    lead = pyroomacoustics.constants.get("frac_delay_length") // 2
    return impulse, lead + round(distance_m / SOUND_SPEED_M_S * SAMPLE_RATE_HZ)


def _simulated(hall: Hall, absorption: float, order: int, distance_m: float, shift_m: float = 0.0) -> Samples:
    import pyroomacoustics

    room = pyroomacoustics.ShoeBox(
        list(hall.size_m),
        fs=SAMPLE_RATE_HZ,
        materials=pyroomacoustics.Material(absorption),
        max_order=order,
        air_absorption=True,
    )
    aside_m = min(ASIDE_M, 0.5 * distance_m)
    along_m = float(np.sqrt(distance_m**2 - aside_m**2))
    x, y, z = START_M + shift_m, SPEAKER_SHARE * hall.size_m[1], HEIGHT_M
    room.add_source([x, y, z])
    room.add_microphone([x + along_m, y + aside_m, z])
    room.compute_rir()
    return np.asarray(room.rir[0][0], np.float32)


@cache
def _direct_gain() -> float:
    """The library's own scale, which differs between its versions."""
    return float(np.sqrt(np.square(_simulated(Hall((14.0, 6.0, 3.0), 0.0), 1.0 - 1e-6, 0, 1.0)).sum()))


@cache
def _absorption(hall: Hall) -> float:
    """Of all six walls: Sabine's, made greater until the response at 5 m decays as fast as is wanted.

    Sabine's formula supposes a diffuse field; in a low hall of even walls the sound decays half as slowly again.
    """
    import pyroomacoustics

    absorption = float(pyroomacoustics.inverse_sabine(hall.rt60_s, list(hall.size_m))[0])
    for _ in range(6):
        measured_s = decay_s(_simulated(hall, absorption, MAX_ORDER, 5.0))
        # Eyring: RT60 is as 1 / -log(1 - absorption)
        absorption = 1.0 - (1.0 - absorption) ** (measured_s / hall.rt60_s)
    return absorption


def decay_s(impulse: Samples) -> float:
    """Return the reverberation time T20 (ISO 3382-2) of an impulse response, shape (n,): from -5 to -25 dB of
    Schroeder's backward integral, times three."""
    left = np.cumsum(np.square(impulse[::-1].astype(np.float64)))[::-1]
    level_db = 10.0 * np.log10(np.maximum(left / left[0], 1e-12))
    return 3.0 * float(np.argmax(level_db < -25.0) - np.argmax(level_db < -5.0)) / SAMPLE_RATE_HZ


def through(sound: Samples, impulse: Samples) -> Samples:
    """Return the sound, shape (n,), as it is heard through an impulse response, shape (k,): shape (n,), float32."""
    size = 1 << (len(sound) + len(impulse) - 1).bit_length()
    heard = np.fft.irfft(np.fft.rfft(sound, size) * np.fft.rfft(impulse, size), size)
    return np.asarray(heard[: len(sound)], np.float32)
