"""Loudspeakers drawn at random."""

from __future__ import annotations

import numpy as np

from hil_fakes.loudspeakers import IDEAL, Loudspeaker, Peak


def draw_loudspeaker(rng: np.random.Generator) -> Loudspeaker:
    """Any from a telephone's to a good one; one in ten is ideal."""
    if rng.random() < 0.1:
        return IDEAL
    peaks = [Peak(_log_uniform(rng, 300.0, 1500.0), rng.uniform(0, 10), rng.uniform(1, 4))]
    for _ in range(rng.integers(0, 4)):
        peaks.append(Peak(_log_uniform(rng, 1000.0, 6500.0), rng.uniform(-8, 6), rng.uniform(1, 6)))
    return Loudspeaker(
        "drawn",
        _log_uniform(rng, 80.0, 500.0),
        int(rng.integers(2, 5)),
        float(rng.uniform(4500, 8000)),
        int(rng.integers(1, 5)),
        tuple(peaks),
        float(rng.choice([0.0, rng.uniform(0.0, 0.08)])),
    )


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
