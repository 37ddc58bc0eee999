"""Level of a rendered word: equal loudness, no DC, a bounded peak, soft ends."""

from __future__ import annotations

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

ACTIVE_RMS = 0.1
"""Level of the loud part of each word: -20 dBFS, which leaves room for vowels' crests."""

PEAK = 10.0 ** (-1.5 / 20.0)
"""No sample is larger: -1.5 dBFS, so that two overlapping fades stay below -1."""

FRAME_SAMPLES = 320
"""Stretch over which the level is taken: 20 ms."""

ACTIVE_RANGE_DB = 15.0
"""Frames this far below the loudest are silence, closures or weak consonants, and don't count."""


def active_rms(sound: Samples) -> float:
    """The rms of the frames within `ACTIVE_RANGE_DB` of the loudest one; 0 for silence."""
    whole = len(sound) // FRAME_SAMPLES * FRAME_SAMPLES
    frames = sound[:whole].reshape(-1, FRAME_SAMPLES).astype(np.float64)
    power = np.mean(frames**2, axis=1) if len(frames) else np.zeros(1)
    loud = power[power >= power.max() * 10.0 ** (-ACTIVE_RANGE_DB / 10.0)]
    return float(np.sqrt(loud.mean()))


def leveled(sound: Samples) -> Samples:
    """The sound at `ACTIVE_RMS`, or lower where its peak would pass `PEAK`; without DC."""
    sound = sound - sound.mean(dtype=np.float64).astype(np.float32)
    level = active_rms(sound)
    if level <= 0.0:
        return sound
    gain = min(ACTIVE_RMS / level, PEAK / float(np.max(np.abs(sound))))
    return (sound * np.float32(gain)).astype(np.float32)


def fade(sound: Samples, fade_s: float) -> Samples:
    """The sound with raised-cosine ends of `fade_s`: two of them overlapped add up to one."""
    count = min(len(sound) // 2, round(fade_s * SAMPLE_RATE_HZ))
    ramp = (0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)).astype(np.float32)
    out = sound.copy()
    out[:count] *= ramp
    out[len(out) - count :] *= ramp[::-1]
    return out


AUDIBLE_DB = 30.0
"""Sound this far below a unit's loudest 10 ms is no longer heard beside it: forward masking after a vowel is about that
deep (Zwicker and Fastl, *Psychoacoustics*, ch. 4)."""
_FRAME = SAMPLE_RATE_HZ // 100


def audible(samples: Samples) -> tuple[int, int]:
    """Where the audible part of a unit begins and ends, in samples; (0, 0) for an empty one."""
    n = len(samples) // _FRAME
    if n == 0:
        return 0, len(samples)
    power = np.square(samples[: n * _FRAME].reshape(n, _FRAME)).sum(axis=1)
    heard = np.flatnonzero(power >= power.max() * 10.0 ** (-AUDIBLE_DB / 10.0))
    return int(heard[0]) * _FRAME, min(int(heard[-1] + 1) * _FRAME, len(samples))
