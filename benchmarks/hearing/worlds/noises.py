"""Background sounds: noises made here, and recordings from a folder of data. All of RMS 1 and seeded."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfilt

from benchmarks.hearing.material import Team
from benchmarks.hearing.noises import KINDS, babble, make_noise
from hil_fakes.robot_noise import unit
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ

MADE = (*KINDS, "vacuum", "talk")
"""Made without data; `talk` is one voice that no robot has, and says any words."""
RECORDED = {
    "appliances": "noises/*.wav",
    "air conditioner": "noises/aircon_*.wav",
    "kitchen": "kitchen.wav",
    "rain": "sounds/rain_*.wav",
    "chainsaw": "sounds/chainsaw_*.wav",
    "clocks": "sounds/clock_*.wav",
    "coffee orders": "negatives/*.wav",
}
"""Where they are below the folder of data."""


def kinds(data: Path | None) -> tuple[str, ...]:
    """The available noises."""
    there = (kind for kind, pattern in RECORDED.items() if data is not None and any(data.glob(pattern)))
    return (*MADE, *there)


def noise(kind: str, n: int, seed: int, team: Team, data: Path | None) -> NDArray[np.float64]:
    """`n` samples of RMS 1. Raises ValueError for an unknown kind, or where there is no recording of it."""
    rng = np.random.default_rng([seed, len(kind)])
    if kind == "vacuum":
        return unit(vacuum(n, rng))
    if kind == "talk":
        return unit(babble(n, seed, team, data / "negatives" if data is not None else None, talkers=1))
    if kind in RECORDED:
        return unit(_recorded(data, RECORDED[kind], n, rng))
    return make_noise(kind, n, seed, team, data / "words" if data is not None else None)


def vacuum(n: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """A vacuum cleaner: air through a nozzle, the motor's turns and the fan's blades, all wandering a little.

    A universal motor makes 400 to 600 turns a second under load, its fan has seven to nine blades; the air's noise
    falls by 6 dB an octave from some corner between 400 and 1,200 Hz on.
    """
    pole = np.exp(-2.0 * np.pi * rng.uniform(400.0, 1200.0) / SAMPLE_RATE_HZ)
    air = lfilter([1.0], [1.0, -pole], rng.standard_normal(n))
    air = sosfilt(butter(1, 100.0, "highpass", fs=SAMPLE_RATE_HZ, output="sos"), air)
    turns_hz = rng.uniform(400.0, 600.0)
    points = max(n // 4000, 1) + 2
    drift = np.interp(np.linspace(0, points - 1, n), np.arange(points), rng.standard_normal(points))
    phase = 2.0 * np.pi * np.cumsum(turns_hz * (1.0 + 0.004 * drift)) / SAMPLE_RATE_HZ
    blades = int(rng.integers(7, 10))
    tones = sum(level * np.sin(order * phase + order) for order, level in ((1, 1.0), (2, 0.7), (3, 0.3), (blades, 0.8)))
    return np.asarray(unit(air) + unit(np.asarray(tones)) * 10.0 ** (rng.uniform(-12.0, -5.0) / 20.0))


@lru_cache(maxsize=64)
def _read(path: Path) -> NDArray[np.float64]:
    return read_wav(path).astype(np.float64)


def _recorded(data: Path | None, pattern: str, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """A stretch of one of the recordings from anywhere in it, and of others when it is over, faded into each other."""
    paths = sorted(data.glob(pattern)) if data is not None else []
    if not paths:
        raise ValueError(f"there is no {pattern} in {data}")
    fade = SAMPLE_RATE_HZ // 50
    ramp = np.sin(np.linspace(0.0, np.pi / 2, fade)) ** 2
    out = np.zeros(0)
    while len(out) < n:
        whole = _read(paths[int(rng.integers(len(paths)))])
        piece = whole[int(rng.integers(max(len(whole) - n, 0) + 1)) :][: n + fade]
        if len(piece) < 2 * fade or not np.any(piece):
            continue
        if len(out):
            joined = out[-fade:] * ramp[::-1] + piece[:fade] * ramp
            out = np.concatenate([out[:-fade], joined, piece[fade:]])
        else:
            out = piece
    return out[:n]
