"""A room full of air at the level of samples: the sound of every loudspeaker at every microphone.

Free field, unless other ways are handed in: each source reaches each microphone with the inverse distance as gain and
the flight time as delay (Kinsler et al., *Fundamentals of Acoustics*, ch. 5), both following the positions sample by
sample, over ambient noise. Levels are in dB SPL re 20 µPa.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hil_fakes.filters import one_pole
from hil_fakes.loudspeakers import IDEAL, Loudspeaker, Playing
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

Point = tuple[float, float]


@dataclass(frozen=True)
class Air:
    """The medium and the equipment, the same for all robots."""

    sound_speed_m_s: float = 343.0
    """Dry air at 20 °C (Kinsler et al., appendix A10)."""
    speech_db_spl: float = 65.0
    """Level of a robot's speech at 1 m: raised conversation (ISO 9921:2003, table A.1: normal 60, raised 66 dB)."""
    speech_dbfs: float = -20.0
    """RMS of the samples that stand for that level."""
    microphone_full_scale_db_spl: float = 106.0
    """A tone of this level (RMS) has amplitude √2 in the microphone's samples: a MEMS microphone of −26 dBFS at
    94 dB SPL (InvenSense ICS-43434) with 14 dB of gain."""
    own_distance_m: float = 0.1
    """From a robot's loudspeaker to its own microphone."""
    noise_db_spl: float = 40.0
    """Ambient noise over 0 to 8 kHz: a quiet living room."""
    muted: bool = False
    """No loudspeaker reaches another's microphone: for the proof that nothing else passes."""

    @property
    def source_gain(self) -> float:
        """From a loudspeaker's samples to a microphone's samples at 1 m."""
        return amplitude(self.speech_db_spl - self.microphone_full_scale_db_spl - self.speech_dbfs)

    @property
    def noise_rms(self) -> float:
        return amplitude(self.noise_db_spl - self.microphone_full_scale_db_spl)


def amplitude(level_db: float) -> float:
    """The factor that a level in dB stands for."""
    return float(10.0 ** (level_db / 20.0))


# Paul Kellet's filter: white to pink noise within ±0.05 dB above 9.2 Hz at 44.1 kHz, as a sum of one-pole filters
# (musicdsp.org, "Pink noise filter"); at 16 kHz its corners lie lower by the ratio of the rates.
_PINK_POLES = (0.99765, 0.96300, 0.57000)
_PINK_GAINS = (0.0990460, 0.2965164, 1.0526913)
_PINK_DIRECT = 0.1848
_PINK_RMS = math.sqrt(
    _PINK_DIRECT**2
    + 2 * _PINK_DIRECT * sum(_PINK_GAINS)
    + sum(
        a * b / (1 - p * q)
        for a, p in zip(_PINK_GAINS, _PINK_POLES, strict=True)
        for b, q in zip(_PINK_GAINS, _PINK_POLES, strict=True)
    )
)
"""RMS of the filtered noise for white noise of RMS 1: the root of the energy of the joint impulse response."""


class PinkNoise:
    """Endless pink noise of a given RMS, made in blocks from its own seed."""

    def __init__(self, rms: float, seed: int) -> None:
        self._scale = rms / _PINK_RMS
        self._generator = np.random.default_rng(seed)
        self._states = [0.0 for _ in _PINK_POLES]
        self._ready: Samples = np.zeros(0, np.float32)

    def take(self, n: int) -> Samples:
        """Return the next samples, shape (n,), float32."""
        while len(self._ready) < n:
            self._ready = np.concatenate([self._ready, self._block()])
        taken, self._ready = self._ready[:n], self._ready[n:]
        return taken

    def _block(self) -> Samples:
        white = self._generator.standard_normal(SAMPLE_RATE_HZ // 4)
        total = _PINK_DIRECT * white
        for k, (pole, gain) in enumerate(zip(_PINK_POLES, _PINK_GAINS, strict=True)):
            part = one_pole(gain * white, pole, self._states[k])
            self._states[k] = float(part[-1])
            total += part
        return (self._scale * total).astype(np.float32)


MAX_DISTANCE_M = 60.0
"""Longest way in free air: at it speech is at 29 dB SPL, below any room's noise."""
CARRIED_M = 5.0
"""Largest move in a block by driving: a robot that moves farther was carried, and no sound follows its way."""
_MARGIN = 1024
"""Samples that a delay line holds beyond the longest way: a block, and a margin for interpolation."""


class DelayLine:
    """The last samples of one loudspeaker, read at fractional delays by cubic interpolation (Lagrange).

    It holds `longest` samples and some more.
    """

    def __init__(self, longest: int) -> None:
        self._size = 1 << (longest + _MARGIN - 1).bit_length()
        self._ring = np.zeros(self._size)
        self._written = 0
        self._loud_until = -1

    def write(self, block: Samples | NDArray[np.float64]) -> None:
        n = len(block)
        at = (self._written + np.arange(n)) % self._size
        self._ring[at] = block
        self._written += n
        if np.any(block):
            self._loud_until = self._written

    def is_silent(self, n: int, delay: float) -> bool:
        """Whether the last `n` samples as heard after `delay` samples are all zero."""
        return self._loud_until < self._written - n - delay - 4

    def read(self, n: int, delays: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the last `n` samples, shape (n,), float64, each `delays[i]` samples earlier; delays, shape (n,),
        are 2 or more."""
        time = self._written - n + np.arange(n) - delays
        base = np.floor(time).astype(np.int64)
        x = time - base
        y = [self._ring[(base + k) % self._size] for k in (-1, 0, 1, 2)]
        interpolated: NDArray[np.float64] = (
            y[0] * (-x * (x - 1) * (x - 2) / 6)
            + y[1] * ((x + 1) * (x - 1) * (x - 2) / 2)
            + y[2] * (-(x + 1) * x * (x - 2) / 2)
            + y[3] * ((x + 1) * x * (x - 1) / 6)
        )
        return interpolated

    def last(self, n: int) -> NDArray[np.float64]:
        """Return the last `n` samples, shape (n,), float64."""
        recent: NDArray[np.float64] = self._ring[(self._written - n + np.arange(n)) % self._size]
        return recent


class Ways(Protocol):
    """The propagation of sound from a loudspeaker to a microphone."""

    max_distance_m: float
    """Distance to which greater ones are clipped."""
    reach: int
    """The latest that any of a sound still arrives, samples."""

    def latest(self, distance_m: float) -> float:
        """The latest arrival of a sound from this distance, samples."""
        ...

    def carry(self, line: DelayLine, n: int, before_m: float, distance_m: float, gain: float) -> NDArray[np.float64]:
        """Return what arrives of `line` over the last `n` samples, shape (n,), float64, while the distance changed
        from `before_m` to `distance_m`; `gain`: at 1 m."""
        ...


class FreeField:
    """Straight on, without echo."""

    def __init__(self, sound_speed_m_s: float = 343.0, max_distance_m: float = MAX_DISTANCE_M) -> None:
        self._samples_a_m = SAMPLE_RATE_HZ / sound_speed_m_s
        self.max_distance_m = max_distance_m
        self.reach = math.ceil(max_distance_m * self._samples_a_m)

    def latest(self, distance_m: float) -> float:
        return distance_m * self._samples_a_m

    def carry(self, line: DelayLine, n: int, before_m: float, distance_m: float, gain: float) -> NDArray[np.float64]:
        ways_m = np.linspace(before_m, distance_m, n)
        return gain / ways_m * line.read(n, np.maximum(ways_m * self._samples_a_m, 2.0))


class Noise(Protocol):
    """The sound at a microphone while nobody speaks."""

    def take(self, n: int) -> Samples:
        """Return the next samples, shape (n,), float32."""
        ...


class Room:
    """Loudspeakers and microphones of `n_robots`, and one more microphone for a listener at `listener`.

    `ways`: between two robots, in place of free air. `noises`: at each robot's microphone, in place of pink noise.
    `loudspeaker`: the model that all use, in place of an ideal one. Robots hear themselves, and the listener hears
    them, through free air.
    """

    def __init__(
        self,
        n_robots: int,
        air: Air,
        seed: int,
        listener: Point = (0.0, 0.0),
        ways: Ways | None = None,
        noises: Sequence[Noise] | None = None,
        loudspeaker: Loudspeaker = IDEAL,
    ) -> None:
        self.air = air
        self._playing = [Playing(loudspeaker) for _ in range(n_robots)] if loudspeaker != IDEAL else []
        self._free = FreeField(air.sound_speed_m_s)
        self._ways = ways or self._free
        self._lines = [DelayLine(max(self._free.reach, self._ways.reach)) for _ in range(n_robots)]
        pink = [PinkNoise(air.noise_rms, seed=seed * 1000 + k) for k in range(n_robots + 1)]
        self._noises: list[Noise] = [*(noises if noises is not None else pink[:-1]), pink[-1]]
        self._listener = listener
        self._before: dict[tuple[int, int], float] = {}
        self.earshot_m = math.inf
        """Robots farther from each other than this hear nothing of each other, as behind walls; the listener does."""

    def advance(self, played: Sequence[Samples], places: Sequence[Point]) -> list[Samples]:
        """Let one block pass: `played` by each loudspeaker, shape (n,) each, while the robots moved to `places` (m).

        Returns the sound at each microphone, the listener's last: shape (n,) each, float32, in steps of a 16-bit
        converter and clipped at its full scale.
        """
        for source, (line, block) in enumerate(zip(self._lines, played, strict=True)):
            line.write(self._playing[source].play(block) if self._playing else block)
        n = len(played[0])
        taken = []
        for ear, place in enumerate([*places, self._listener]):
            heard = self._noises[ear].take(n).astype(np.float64)
            for source, line in enumerate(self._lines):
                ways = self._free if ear in (source, len(places)) else self._ways
                distance_m = self._distance_m(source, ear, places[source], place, ways)
                before_m = self._before.get((source, ear), distance_m)
                if abs(distance_m - before_m) > CARRIED_M:
                    before_m = distance_m
                self._before[source, ear] = distance_m
                if source != ear and (self.air.muted or (ear < len(places) and distance_m > self.earshot_m)):
                    continue
                if not line.is_silent(n, ways.latest(distance_m)):
                    heard += ways.carry(line, n, before_m, distance_m, self.air.source_gain)
            taken.append(digitize(heard))
        return taken

    def _distance_m(self, source: int, ear: int, a: Point, b: Point, ways: Ways) -> float:
        if source == ear:
            return self.air.own_distance_m
        return min(max(math.dist(a, b), self.air.own_distance_m), ways.max_distance_m)


def digitize(sound: NDArray[np.float64]) -> Samples:
    """Return sound, any shape, as a 16-bit converter gives it, float32: in steps of 2^-15, clipped at full scale."""
    return (np.clip(np.rint(sound * 32768.0), -32768, 32767) / 32768.0).astype(np.float32)
