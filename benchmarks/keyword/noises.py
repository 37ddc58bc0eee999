"""Noises that the keyword is mixed with."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.hearing.noises import steady
from hil_fakes.robot_noise import fan, motor
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ

SIGNALS, SIGNAL_S = 12, 3.6
"""Signals in one noise, and the time for each."""
SIGNAL_NOISES = 3
KITCHEN = 4
"""Its share, in noises: it changes most, and sounds most like the word."""
MODES = 6
"""Resonances of a thing that is struck: a plate, a glass, a pan."""


def noises(data: Path | None, seed: int) -> list[NDArray[np.float64]]:
    """Long ones, the first two those of a microphone; without those for tests. The last ones are horns, beeps, claps
    and dishes."""
    n, rng = 40 * SAMPLE_RATE_HZ, np.random.default_rng(seed)
    found = [steady("white", n, seed), steady("pink", n, seed), fan(n, rng), motor(n, rng)]
    for path in sorted((data / "noises").glob("*.wav")) if data is not None else ():
        if path.stem not in ("aircon_2", "dishwasher_3"):
            found.append(np.asarray(read_wav(path), np.float64))
    if data is not None:
        kitchen = np.asarray(read_wav(data / "kitchen.wav"), np.float64)
        found += [kitchen[: len(kitchen) // 2]] * KITCHEN
    return [*found, *(np.concatenate([_signal(rng) for _ in range(SIGNALS)]) for _ in range(SIGNAL_NOISES))]


def _signal(rng: np.random.Generator) -> NDArray[np.float64]:
    """A horn, beeps, claps, or dishes, RMS 1."""
    n = round(SIGNAL_S * SAMPLE_RATE_HZ)
    t, out = np.arange(n) / SAMPLE_RATE_HZ, np.zeros(n)
    kind = rng.integers(4)
    for _ in range(int(rng.integers(1, 12 if kind == 3 else 6))):
        at, long_s = rng.uniform(0.0, SIGNAL_S), rng.uniform(0.05, 0.8)
        inside = (t >= at) & (t < at + long_s)
        if kind == 3:
            out += rng.uniform(0.1, 1.0) * _struck(np.clip(t - at, 0.0, None), rng)
        elif kind == 2:
            out += np.where(t >= at, np.exp(-(t - at) / rng.uniform(0.005, 0.05)), 0.0) * rng.standard_normal(n)
        else:
            hz = rng.uniform(200.0, 700.0) if kind == 0 else rng.uniform(500.0, 3500.0)
            n_tones = 12 if kind == 0 else 1
            out += inside * sum(np.sin(2 * np.pi * hz * k * t + k * k) / k**0.7 for k in range(1, n_tones + 1))
    out += 1e-4 * rng.standard_normal(n)
    return np.asarray(out / np.sqrt(np.mean(out**2)))


def _struck(t: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """A thing that is struck when `t`, s, ceases to be 0: its resonances die away, the high ones sooner."""
    hz = rng.uniform(300.0, 1500.0) * rng.uniform(1.0, 6.0, MODES)
    decay_s = rng.uniform(0.02, 0.3) * (1000.0 / hz) ** 0.7
    modes = rng.uniform(0.2, 1.0, MODES)[:, None] * np.sin(2 * np.pi * hz[:, None] * t)
    return np.asarray((modes * np.exp(-t / decay_s[:, None])).sum(axis=0))
