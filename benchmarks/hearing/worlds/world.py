"""A world is the path from one robot's speech to another's samples; worlds are drawn at random."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from benchmarks.hearing import mixing
from benchmarks.hearing.material import Spoken, Team
from benchmarks.hearing.worlds import noises, rooms
from benchmarks.hearing.worlds.loudspeakers import draw_loudspeaker
from benchmarks.hearing.worlds.microphones import Microphone, draw_microphone, moved
from benchmarks.hearing.worlds.rooms import LEAD, Place
from hil_fakes.loudspeakers import IDEAL, Loudspeaker
from hil_fakes.reverberation import SOUND_SPEED_M_S
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

FASTEST_M_S = 0.44
"""Two TurtleBot3 Burgers (0.22 m/s, ROBOTIS e-Manual) that drive apart or together."""
WORST_PPM = 1300.0
NEAREST_M, FARTHEST_M = 0.5, 4.0
"""Robots that move do so between these distances, there and back."""


@dataclass(frozen=True)
class World:
    """Between one robot's loudspeaker and another's ears.

    `room`: a simulated place, or the file of a measured response; None for free field. `speed_m_s` of approach, at
    first; `ppm` by which the listener's clock is fast. `snr_db` is of the mean power while somebody speaks, as it
    arrives, to the noise's, over 0 to 8 kHz; `level_dbfs` is that of the speech before the microphone's own doings.
    """

    loudspeaker: Loudspeaker = IDEAL
    room: Place | Path | None = None
    speed_m_s: float = 0.0
    ppm: float = 0.0
    noise: str = "pink"
    snr_db: float = 20.0
    level_dbfs: float = -30.0
    microphone: Microphone = field(default_factory=Microphone)
    seed: int = 0

    @property
    def response(self) -> rooms.Response:
        """Of the room, its direct sound at LEAD."""
        if isinstance(self.room, Place):
            return rooms.response(self.room)
        if self.room is not None:
            return rooms.read_response(self.room)
        return np.asarray(np.arange(LEAD + 1) == LEAD, np.float32)

    def __str__(self) -> str:
        where = "free field"
        if self.room is not None:
            found = rooms.acoustic(self.response)
            where = f"room of RT60 {found.rt60_s:.1f} s, DRR {found.drr_db:+.0f} dB"
        clock = f"{self.ppm:+.0f} ppm, {self.speed_m_s:+.2f} m/s"
        return f"{self.loudspeaker.name}, {where}, {clock}, {self.noise} {self.snr_db:.0f} dB, {self.microphone}"

    def carried(self, sound: Samples) -> NDArray[np.float64]:
        """What of the sound arrives, of the same length: played, moved in time, and through the room.

        The whole response moves with the robots: what an echo's way changes by is taken for what the direct one's does.
        """
        out = self.loudspeaker.play(sound)
        if self.speed_m_s or self.ppm:
            out = moved(out, self._lag_s(len(out)))
        return np.asarray(fftconvolve(out, self.response)[LEAD : LEAD + len(out)])

    def when(self, spoken: Sequence[Spoken], n: int) -> list[Spoken]:
        """The places of the sentences in the arriving sound; `n`: samples of the whole."""
        if not self.speed_m_s and not self.ppm:
            return list(spoken)
        at = np.arange(n) - self._lag_s(n) * SAMPLE_RATE_HZ
        return [
            replace(s, start=int(np.searchsorted(at, s.start)), end=int(np.searchsorted(at, s.end))) for s in spoken
        ]

    def _lag_s(self, n: int) -> NDArray[np.float64]:
        """The extra delay of the sound at each sample, relative to that at the shortest distance."""
        t_s = np.arange(n) / SAMPLE_RATE_HZ
        lag_s = t_s * self.ppm * 1e-6
        if self.speed_m_s:
            span_m = FARTHEST_M - NEAREST_M
            start_m = span_m * (0.9 if self.speed_m_s > 0 else 0.1)
            driven_m = (start_m - self.speed_m_s * t_s) % (2 * span_m)
            lag_s += np.minimum(driven_m, 2 * span_m - driven_m) / SOUND_SPEED_M_S
        return lag_s

    def heard(
        self, arrived: NDArray[np.float64], spoken: Sequence[Spoken], team: Team, data: Path | None = None
    ) -> Samples:
        """The listener's samples of the arriving sound, with this world's noise over all of it, as 16 bits."""
        gain = 10.0 ** (self.level_dbfs / 20.0) / mixing.speech_rms(np.asarray(arrived, np.float64), spoken)
        noise = noises.noise(self.noise, len(arrived), self.seed, team, data)
        noise *= 10.0 ** ((self.level_dbfs - self.snr_db) / 20.0)
        return mixing.digitized(self.microphone.take(arrived * gain + noise))


def draw_world(seed: int, data: Path | None = None, simulated: bool = True) -> World:
    """Any world; the same for the same seed and data."""
    rng = np.random.default_rng([seed, 77])
    kind = rng.random()
    measured = rooms.measured(data) if data is not None else []
    room: Place | Path | None = None
    if kind < 0.25 and measured:
        room = measured[int(rng.integers(len(measured)))]
    elif kind < 0.85 and simulated:
        room = rooms.draw_place(seed)
    there = noises.kinds(data)
    ppm = rng.normal(0.0, 80.0) if rng.random() < 0.7 else rng.uniform(-WORST_PPM, WORST_PPM)
    return World(
        draw_loudspeaker(rng),
        room,
        float(rng.choice([0.0, rng.uniform(-FASTEST_M_S, FASTEST_M_S)], p=[0.75, 0.25])),
        float(np.clip(ppm, -WORST_PPM, WORST_PPM)),
        there[int(rng.integers(len(there)))],
        float(rng.uniform(-10.0, 20.0)),
        float(rng.uniform(-42.0, -20.0)),
        draw_microphone(rng),
        seed,
    )
