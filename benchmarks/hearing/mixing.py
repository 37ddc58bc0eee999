"""Mixes speech and noise at the microphone: level, channel, sample clock, steps of the noise, 16 bits."""

from __future__ import annotations

import random
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import resample

from benchmarks.hearing.material import Spoken
from benchmarks.hearing.noises import steady
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

STEP_DB = 20.0
"""Of the noise, up and down in turn."""


def add_noise(
    sound: Samples, spoken: Sequence[Spoken], snr_db: float, colour: str, level_dbfs: float, seed: int
) -> Samples:
    """The stream with its speech at `level_dbfs` RMS, in white or pink noise `snr_db` below it, as 16 bits."""
    return mix(sound, spoken, steady(colour, len(sound), seed), snr_db, level_dbfs)


def speech_rms(sound: Samples, spoken: Sequence[Spoken]) -> float:
    """RMS of the stream while somebody speaks."""
    active = np.concatenate([sound[s.start : s.end] for s in spoken]).astype(np.float64)
    return float(np.sqrt(np.mean(active**2)))


def mix(
    sound: Samples, spoken: Sequence[Spoken], noise: NDArray[np.float64], snr_db: float, level_dbfs: float
) -> Samples:
    """Speech at `level_dbfs` RMS and noise (given with RMS 1) `snr_db` below it, both over 0 to 8 kHz, as 16 bits."""
    gain = 10.0 ** (level_dbfs / 20.0) / speech_rms(sound, spoken)
    return digitized(sound * gain + noise * 10.0 ** ((level_dbfs - snr_db) / 20.0))


def digitized(sound: NDArray[np.float64]) -> Samples:
    """The output of a 16-bit converter, clipped at full scale."""
    return np.asarray(np.round(np.clip(sound, -1.0, 1.0) * 32767.0) / 32767.0, np.float32)


def off_clock(sound: Samples, spoken: Sequence[Spoken], ppm: float) -> tuple[Samples, list[Spoken]]:
    """The signal of a microphone whose clock is slow by `ppm` millionths against the speaker's: fewer samples."""
    ratio = 1.0 - ppm * 1e-6
    moved = [Spoken(s.words, round(s.start * ratio), round(s.end * ratio), s.number) for s in spoken]
    taken = np.zeros(round(len(sound) * ratio), np.float32)
    for s, m in zip(spoken, moved, strict=True):
        margin = SAMPLE_RATE_HZ // 2
        piece = sound[s.start : s.end + margin]
        piece = np.asarray(resample(piece, round(len(piece) * ratio)), np.float32)[: len(taken) - m.start]
        taken[m.start : m.start + len(piece)] = piece
    return taken, moved


def own_levels(sound: Samples, spoken: Sequence[Spoken], low_dbfs: float, high_dbfs: float, seed: int) -> Samples:
    """Every sentence at a random level of its own, RMS."""
    chooser = random.Random(seed)
    out = np.zeros_like(sound)
    ends = [s.start for s in spoken[1:]] + [len(sound)]
    for s, end in zip(spoken, ends, strict=True):
        gain = 10.0 ** (chooser.uniform(low_dbfs, high_dbfs) / 20.0) / speech_rms(sound, [s])
        out[s.start : end] = sound[s.start : end] * gain
    return out


def stepped(noise: NDArray[np.float64], spoken: Sequence[Spoken], amid: bool, seed: int) -> NDArray[np.float64]:
    """Noise that rises and falls by STEP_DB in turn: before every third sentence, or `amid` it at any moment."""
    chooser = random.Random(seed)
    gain = np.ones(len(noise))
    high = False
    for before, s in zip(spoken[1::3], spoken[2::3], strict=False):
        at = chooser.randrange(s.start, s.end) if amid else before.end + round(0.5 * SAMPLE_RATE_HZ)
        high = not high
        gain[at:] = 10.0 ** (STEP_DB / 20.0) if high else 1.0
    return noise * gain
