"""The simulated bench: a robot's microphone signal for another robot's speech, somewhere along a hall.

Speech passes the loudspeaker's band and the hall (image sources), and meets three noises at the microphone: the
ambient one, the microphone's own, and what the robot itself makes. All levels are dB SPL over 0 to 8 kHz.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hil_fakes.reverberation import START_M, Hall, response, through
from hil_fakes.robot_noise import fan
from hil_fakes.room import Air, PinkNoise, amplitude, digitize
from hil_fakes.transducers import band
from hvcpd.evaluation.listeners import Said
from hvcpd.ports import Samples, samples_in
from hvcpd.synthesis.leveling import audible

LEAD_S = 3.0
"""Noise before the first sentence: a robot has listened for a while before it is called."""
GAP_S = (1.2, 2.5)
"""Silence between two sentences, shortest and longest."""
SHIFT_M = 1.5
"""Largest shift of both robots along the hall, drawn for each block of trials."""
FITTED_ROBOT_NOISE_DB_SPL = 57.5
"""At which PocketSphinx, a recogniser for general speech as the paper's is, understands half of the calls at 120 cm, as
the paper's does: 95 % interval 56.6 to 58.3 dB (`hvcpctl evaluate fit --trials 12`, seed 1)."""


@dataclass(frozen=True)
class Bench:
    """Every assumption about the room and the equipment, each printed on the plots."""

    hall: Hall = field(default_factory=lambda: Hall((24.0, 6.0, 3.0), 0.45))
    """An office corridor or class room with furniture has 0.4 to 0.6 s (DIN 18041:2016, figure 2, class A4)."""
    speech_db_spl: float = Air().speech_db_spl
    """RMS level of the sentence's audible part at 1 m in front of the loudspeaker."""
    loudspeaker_hz: tuple[float, float] = (300.0, 6000.0)
    """Corners of a small loudspeaker, 12 dB an octave beyond."""
    ambient_db_spl: float = 20.0
    """Pink: as the paper states it."""
    self_noise_db_spl: float = 33.0
    """White: a MEMS microphone with 61 dB of SNR re 94 dB SPL (InvenSense ICS-43432, datasheet)."""
    robot_noise_db_spl: float | None = FITTED_ROBOT_NOISE_DB_SPL
    """Fan and electronics of the robot that listens, at its own microphone; None: it is silent."""
    full_scale_db_spl: float = Air().microphone_full_scale_db_spl

    def assumptions(self, robot: str | None = None) -> tuple[str, ...]:
        """The assumptions in the form for a plot; `robot`: its noise level, where it is not constant over the plot."""
        length, width, height = self.hall.size_m
        low, high = self.loudspeaker_hz
        if robot is None:
            robot = "none" if self.robot_noise_db_spl is None else f"{self.robot_noise_db_spl:g} dB (fan)"
        return (
            f"hall {length:g} × {width:g} × {height:g} m, RT60 {self.hall.rt60_s:g} s (image sources); both 25 cm high",
            f"speech {self.speech_db_spl:g} dB SPL at 1 m, loudspeaker {low:g} to {high:g} Hz",
            f"noise at the microphone, dB SPL: ambient {self.ambient_db_spl:g} dB (pink), microphone "
            f"{self.self_noise_db_spl:g} dB (white), robot {robot}; full scale {self.full_scale_db_spl:g} dB, 16 bits",
        )


def stream(
    sentences: Sequence[tuple[tuple[str, ...], Samples]], bench: Bench, rng: np.random.Generator
) -> tuple[Samples, list[Said]]:
    """Return sentences, words and sound of shape (k,), one after the other as they leave the loudspeaker, at its
    level at 1 m, and where each is: shape (n,), float32, 1.0 = the microphone's full scale."""
    pieces = [np.zeros(samples_in(LEAD_S), np.float32)]
    at = len(pieces[0])
    said = []
    for words, sound in sentences:
        first, last = audible(sound)
        loud = np.sqrt(np.mean(np.square(sound[first:last], dtype=np.float64)))
        gain = amplitude(bench.speech_db_spl - bench.full_scale_db_spl) / loud
        said.append(Said(words, at, at + last))
        gap = np.zeros(samples_in(rng.uniform(*GAP_S)), np.float32)
        pieces += [(gain * sound).astype(np.float32), gap]
        at += len(sound) + len(gap)
    return np.concatenate(pieces), said


def heard_at(sound: Samples, distance_m: float, bench: Bench, rng: np.random.Generator) -> Samples:
    """Return the microphone signal for such a stream, shape (n,), at that distance: shape (n,), float32 in steps of 16
    bits, without the propagation delay.

    Raises ImportError without pyroomacoustics.
    """
    room_m = bench.hall.size_m[0] - START_M - 0.5 - distance_m
    shift_m = round(float(rng.uniform(0.0, max(min(SHIFT_M, room_m), 0.0))), 3)
    impulse, delay = response(bench.hall, distance_m, shift_m)
    n = len(sound)
    far = through(np.pad(band(sound, *bench.loudspeaker_hz), (0, delay)), impulse)[delay:]
    return digitize(far.astype(np.float64) + noise(n, bench, rng))


def noise(n: int, bench: Bench, rng: np.random.Generator) -> Samples:
    """Return the microphone signal while nobody speaks, shape (n,), float32, 1.0 = its full scale."""

    def rms(level_db_spl: float) -> float:
        return amplitude(level_db_spl - bench.full_scale_db_spl)

    total = PinkNoise(rms(bench.ambient_db_spl), int(rng.integers(2**31))).take(n).astype(np.float64)
    total += rms(bench.self_noise_db_spl) * rng.standard_normal(n)
    if bench.robot_noise_db_spl is not None:
        total += rms(bench.robot_noise_db_spl) * fan(n, rng)
    return total.astype(np.float32)
