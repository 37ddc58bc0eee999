"""The eight voices, and which robot speaks with which: it follows from the name, so that every peer knows it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Voice:
    """A way of speaking.

    `f0_hz` is the mean pitch, `pitch_range` scales accents and the final fall, `formant_scale` multiplies the formants
    (1 = adult male tract of 17.5 cm), `rate` divides durations, `breathiness_db` is the breath noise in voiced sounds
    relative to a vowel, `open_quotient` the share of the glottal cycle that is open, `tilt_hz` the corner of the
    source's low-pass (low = dark). A `natural` voice is a recorded talker's, made over to the same pitch, formants,
    rate, breath and brightness (`natural.py`); the others are the formant synthesizer's.
    """

    name: str
    f0_hz: float
    formant_scale: float
    rate: float
    breathiness_db: float
    open_quotient: float
    tilt_hz: float
    pitch_range: float = 1.0
    natural: bool = False


VOICES: tuple[Voice, ...] = (
    Voice("oak", 112.0, 1.00, 1.00, -38.0, 0.55, 3500.0),
    Voice("rose", 166.0, 1.16, 1.00, -32.0, 0.62, 2950.0),
    Voice("granite", 89.0, 0.94, 0.98, -42.0, 0.50, 2700.0, 0.6),
    Voice("wren", 203.0, 1.15, 1.04, -34.0, 0.60, 3800.0),
    Voice("brook", 135.0, 1.05, 1.05, -30.0, 0.66, 2300.0, 1.2),
    Voice("lark", 184.0, 1.18, 1.06, -38.0, 0.54, 4600.0, 1.2),
    Voice("cedar", 98.0, 1.07, 1.02, -40.0, 0.46, 4850.0),
    Voice("willow", 150.0, 1.10, 0.96, -27.0, 0.70, 2050.0, 0.8),
)
"""Male and female voices of low, medium and high pitch, bright and dark; each differs from every other by at
least a tenth in pitch or formants. Adult male pitch is 85 to 155 Hz, female 165 to 255 Hz; female formants lie about
17 % above male (Peterson and Barney 1952). The high voices are rather low in pitch for their formants: above about
200 Hz the harmonics are so sparse that they no longer show where the formants are, to listeners and templates alike."""


def voice_for(robot_name: str) -> Voice:
    """The voice of the robot of that name, the same everywhere and for ever; upper and lower case are one.

    The first byte of the name's SHA-256 picks a row of `VOICES`.
    """
    digest = hashlib.sha256(robot_name.strip().casefold().encode()).digest()
    return VOICES[digest[0] % len(VOICES)]


def voice_named(name: str) -> Voice:
    """The voice called `name`; KeyError when there is none."""
    return {voice.name: voice for voice in VOICES}[name]


def varied(voice: Voice, pitch: float, rate: float) -> Voice:
    """That voice with its pitch and its rate multiplied, under a name of its own: two robots may have one voice, and
    listeners tell them apart by name."""
    if (pitch, rate) == (1.0, 1.0):
        return voice
    name = f"{voice.name}, pitch {pitch:g}, rate {rate:g}"
    return replace(voice, name=name, f0_hz=pitch * voice.f0_hz, rate=rate * voice.rate)
