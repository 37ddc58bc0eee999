"""Level of a rendered word: equal loudness, no DC, a bounded peak, soft ends."""

from __future__ import annotations

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.loudness import SILENCE_LUFS, loudness_lufs

TARGET_LUFS = -20.0
"""Loudness of every word (BS.1770), so that words and voices are equally loud. Vowels' crests lie up to 15 dB above, so
that the peaks keep clear of `PEAK`; broadcast's -23 LUFS (EBU R 128) would waste 3 dB against a robot's noise."""

PEAK = 10.0 ** (-1.5 / 20.0)
"""No sample is larger: -1.5 dBFS, so that two overlapping fades stay below -1."""


def leveled(sound: Samples) -> Samples:
    """Return the sound, shape (n,), float32, at `TARGET_LUFS`, or lower where its peak would pass `PEAK`; without
    DC."""
    sound = sound - sound.mean(dtype=np.float64).astype(np.float32)
    return (sound * level_gain(sound[slice(*audible(sound))])).astype(np.float32)


def level_gain(sound: Samples) -> np.float32:
    """Return the factor that brings a sound, shape (n,), to `TARGET_LUFS`, or as near as `PEAK` allows; 1 for
    silence."""
    loudness = loudness_lufs(sound)
    if loudness <= SILENCE_LUFS:
        return np.float32(1.0)
    return np.float32(min(10.0 ** ((TARGET_LUFS - loudness) / 20.0), PEAK / float(np.max(np.abs(sound)))))


def fade(sound: Samples, fade_s: float) -> Samples:
    """Return the sound, shape (n,), float32, with raised-cosine ends of `fade_s`: two of them overlapped add up to
    one."""
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
    """Return where the audible part of a unit, shape (n,), begins and ends, in samples; (0, 0) for an empty one."""
    n = len(samples) // _FRAME
    if n == 0:
        return 0, len(samples)
    power = np.square(samples[: n * _FRAME].reshape(n, _FRAME)).sum(axis=1)
    heard = np.flatnonzero(power >= power.max() * 10.0 ** (-AUDIBLE_DB / 10.0))
    return int(heard[0]) * _FRAME, min(int(heard[-1] + 1) * _FRAME, len(samples))
