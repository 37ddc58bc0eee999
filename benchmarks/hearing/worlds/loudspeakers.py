"""Loudspeakers drawn at random."""

from __future__ import annotations

import numpy as np

from hil_fakes.loudspeakers import IDEAL, Loudspeaker, Peak


def draw_loudspeaker(chance: np.random.Generator) -> Loudspeaker:
    """Any from a telephone's to a good one; one in ten is ideal."""
    if chance.random() < 0.1:
        return IDEAL
    peaks = [Peak(_log_uniform(chance, 300.0, 1500.0), chance.uniform(0, 10), chance.uniform(1, 4))]
    for _ in range(chance.integers(0, 4)):
        peaks.append(Peak(_log_uniform(chance, 1000.0, 6500.0), chance.uniform(-8, 6), chance.uniform(1, 6)))
    return Loudspeaker(
        "drawn",
        _log_uniform(chance, 80.0, 500.0),
        int(chance.integers(2, 5)),
        float(chance.uniform(4500, 8000)),
        int(chance.integers(1, 5)),
        tuple(peaks),
        float(chance.choice([0.0, chance.uniform(0.0, 0.08)])),
    )


def _log_uniform(chance: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(chance.uniform(np.log(low), np.log(high))))
