"""What microphones and their drivers do to sound, in the front end's energies: noise suppression and automatic gain
control. A gain that falls when speech begins is a burst and a fall, like the keyword: the net has to know it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.frontend import HOP_SAMPLES, Energies, power_weights

FRAME_S = HOP_SAMPLES / SAMPLE_RATE_HZ
CONTROLLED = 0.35
"""Share of takes through automatic gain control."""
TARGET_DBFS, MOST_DB = (-32.0, -14.0), (6.0, 30.0)
"""Ranges of the level that it leads to, and of the most that it changes it by."""
ATTACK_S, RELEASE_S = (0.01, 0.2), (0.15, 3.0)
"""Ranges of its time constants while sound grows louder, and quieter: from a limiter to a slow control."""
SUPPRESSED = 0.12
"""Share of takes through a noise suppressor."""
LOWERED_DB = (6.0, 20.0)
"""Range of the most that it lowers a noise by."""
START = 10
"""Frames whose mean it begins from: it has listened before."""
SMOOTHED, PRIOR, RISE = 0.85, 0.97, 1.003
"""Of the suppressor, per frame: smoothing of the power whose minima are the noise, weight of what was left of the frame
before, and how fast the noise may rise (1.3 dB/s)."""
UNDERESTIMATED = 1.7
"""Ratio of a noise's mean to the minima of its smoothed power."""

_WEIGHTS = power_weights()


def received(takes: Energies, rng: np.random.Generator) -> Energies:
    """Takes as a driver hands them on; shape (takes, frames, bands), energies of full scale 1."""
    some = rng.random(len(takes)) < SUPPRESSED
    takes[some] = _suppressed(takes[some], rng)
    some = rng.random(len(takes)) < CONTROLLED
    takes[some] = _controlled(takes[some], rng)
    return takes


def _controlled(takes: Energies, rng: np.random.Generator) -> Energies:
    """By the level, which follows the power, and a gain that follows the level."""
    n = len(takes)
    target_db, most_db = rng.uniform(*TARGET_DBFS, n), rng.uniform(*MOST_DB, n)
    up, down = (_step(np.exp(rng.uniform(np.log(a), np.log(b), n))) for a, b in (ATTACK_S, RELEASE_S))
    powers = np.maximum(takes @ _WEIGHTS, 1e-10).astype(np.float64)
    level = powers[:, :START].mean(axis=1)
    gain_db = np.clip(target_db - 10.0 * np.log10(level), -most_db, most_db)
    gains_db = np.empty_like(powers)
    for k, power in enumerate(powers.T):
        level += (power - level) * np.where(power > level, up, down)
        wanted_db = np.clip(target_db - 10.0 * np.log10(level), -most_db, most_db)
        gain_db = gain_db + (wanted_db - gain_db) * np.where(wanted_db < gain_db, up, down)
        gains_db[:, k] = gain_db
    return np.asarray(takes * 10.0 ** (gains_db / 10.0)[:, :, None], np.float32)


def _suppressed(takes: Energies, rng: np.random.Generator) -> Energies:
    """By Wiener's gain in each band, with the decision-directed estimate of Y. Ephraim & D. Malah, IEEE Trans. ASSP
    32(6), 1984, and the noise by its minima."""
    floor = 10.0 ** (-rng.uniform(*LOWERED_DB, len(takes)) / 20.0)[:, None]
    smooth = takes[:, :START].mean(axis=1)
    least, clean = smooth, np.zeros_like(smooth)
    out = np.empty_like(takes)
    for k in range(takes.shape[1]):
        power = takes[:, k]
        smooth = SMOOTHED * smooth + (1.0 - SMOOTHED) * power
        least = np.minimum(least * RISE, smooth)
        noise = np.maximum(UNDERESTIMATED * least, 1e-12)
        prior = PRIOR * clean / noise + (1.0 - PRIOR) * np.maximum(power / noise - 1.0, 0.0)
        gain = np.maximum(prior / (1.0 + prior), floor)
        clean = gain**2 * power
        out[:, k] = clean
    return out


def _step(time_constant_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much of the difference is made up for in a frame."""
    return np.asarray(1.0 - np.exp(-FRAME_S / time_constant_s))
