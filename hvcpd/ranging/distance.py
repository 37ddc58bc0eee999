"""The distance between two robots from the intervals between two sentences, each measured at both microphones.

Robot A says the first sentence, robot B the second. The difference of the two intervals is the time that sound takes
there and back: no clock needs to be set (Peng et al., as in `arrival`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.ranging.arrival import Arrival

SOUND_SPEED_M_S = 343.0
"""Dry air at 20 °C (Kinsler et al., *Fundamentals of Acoustics*, appendix A10)."""
WARMTH = 0.006
"""Relative standard deviation of it where nobody knows the temperature: 3.5 °C, 0.6 m/s for each."""
TICKS = 10_000
"""The interval is stated modulo this number of samples, 0.625 s: distances are known modulo 107 m."""
NEAREST_M, FARTHEST_M = -0.2, 50.0
"""What else comes out is a misheard number; a little below 0 is an error."""
STILL = 250e-6
"""Stretches beyond it are no crystals': somebody moves."""
CLEAR = 8.0
"""Least amplitude of a first arrival over the noise: those taken too early had 7 (`benchmarks/ranging.py`)."""
LEAST_FIRST, MOST_FORERUN = 0.8, 0.45
"""Behind something that takes 20 dB of the direct sound away, echoes are mostly louder, or it is still seen before what
was taken for it; in line of sight, down to 0 dB, neither (`benchmarks/ranging.py --behind`)."""
ERROR_M = 0.02
"""Standard deviation of what is measured: floors and walls echo within the first arrival, and a sample is 1 cm."""


@dataclass(frozen=True)
class Distance:
    """How far away a robot is, m; `deviation_m` is the standard deviation; not `sure`: an echo may have been taken for
    it, or somebody moved."""

    distance_m: float
    deviation_m: float
    sure: bool


def interval_ticks(first: Arrival, own: Arrival, own_way_m: float) -> int:
    """The interval that B tells, from A's sentence to its own at its microphone.

    It is in samples of its own player, and as if its loudspeaker were at its microphone, `own_way_m` away.
    """
    interval = (own.at - first.at) / (1.0 + own.stretch)
    return round(interval - own_way_m / SOUND_SPEED_M_S * SAMPLE_RATE_HZ) % TICKS


def is_sure(arrival: Arrival) -> bool:
    """Whether an arrival stands out, is the direct one as far as one can tell, and nobody seems to have moved."""
    is_direct = arrival.first >= LEAST_FIRST and arrival.forerun <= MOST_FORERUN
    return arrival.clear >= CLEAR and is_direct and abs(arrival.stretch) <= STILL


def distance(own: Arrival, answer: Arrival, ticks: int, own_way_m: float) -> Distance | None:
    """How far B is, from A's own sentence and B's answer at A's microphone, and B's interval; None if they fit no
    distance. `own_way_m`: from A's loudspeaker to its microphone."""
    interval = answer.at - own.at
    stated = ticks + TICKS * round((interval / (1.0 + answer.stretch) - ticks) / TICKS - 0.25)
    metre = SOUND_SPEED_M_S / SAMPLE_RATE_HZ
    distance_m = 0.5 * (metre * (interval - stated * (1.0 + answer.stretch)) + own_way_m)
    if not NEAREST_M <= distance_m <= FARTHEST_M:
        return None
    deviation_m = math.hypot(ERROR_M, WARMTH * distance_m)
    return Distance(max(distance_m, 0.0), deviation_m, is_sure(own) and is_sure(answer))
