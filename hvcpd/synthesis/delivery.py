"""The delivery of a sentence: faster or slower, louder or softer, or shaped for noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.leveling import PEAK, fade, level_gain
from hvcpd.synthesis.voices import Voice

RATES = (0.5, 2.0)
"""Slowest and fastest `rate`: beyond, consonants run together or fall apart."""

GAINS_DB = (-60.0, 20.0)
"""Least and greatest `gain_db`; more than 20 dB above the usual level no peak could follow."""

LOMBARD_GAIN_DB = 6.0
"""Gain of speech in noise: the middle of what talkers add in 65 to 85 dB of noise (Junqua, JASA 93, 1993)."""

SHAPE_HZ = (0.0, 200.0, 400.0, 700.0, 1200.0, 2000.0, 3500.0, 4500.0, 6000.0, 8000.0)
SHAPE_DB = (-20.0, -16.0, -8.0, -3.0, 2.0, 4.0, 4.0, 1.0, -3.0, -6.0)
"""Spectrum of speech in noise beside plain speech's: power from the first harmonics goes to the second and third
formant, as talkers do it (Lu and Cooke, *Speech Communication* 51, 2009)."""

ENVELOPE_S = 0.04
LEFT = 0.1
"""Share of the differences of level, in dB, that is left when the level is followed over `ENVELOPE_S`: soft consonants
come up beside the vowels (spectral shaping and dynamic range compression: Zorila, Kandia and Stylianou, Interspeech
2012). With 0.3 left PocketSphinx had .65 of the words wrong instead of .51 (12 sentences, pink noise, a steeper
shape)."""
MOST_LIFT_DB = 15.0
"""Nothing is raised by more: the ends of words would hiss."""
LEAST_POWER = 1e-6
"""Of the mean: rounding may leave less than nothing in pauses."""

FADE_S = 0.005


@dataclass(frozen=True)
class Delivery:
    """`rate` above 1 is faster; `gain_db` changes the level; `lombard` is speech for noise."""

    rate: float = 1.0
    gain_db: float = 0.0
    lombard: bool = False

    def __post_init__(self) -> None:
        if not RATES[0] <= self.rate <= RATES[1]:
            raise ValueError(f"rate {self.rate} is not from {RATES[0]} to {RATES[1]}")
        if not GAINS_DB[0] <= self.gain_db <= GAINS_DB[1]:
            raise ValueError(f"gain {self.gain_db} dB is not from {GAINS_DB[0]} to {GAINS_DB[1]} dB")

    def voice(self, voice: Voice) -> Voice:
        """The voice as it speaks then."""
        return replace(voice, rate=voice.rate * self.rate)

    def level(self, sound: Samples) -> tuple[Samples, float]:
        """Return the sound, shape (n,), shaped and at its level, and its gain, dB: less than asked for where its peak
        would pass `PEAK`."""
        wanted_db = self.gain_db + (LOMBARD_GAIN_DB if self.lombard else 0.0)
        sound = for_noise(sound) if self.lombard else sound
        peak = float(np.max(np.abs(sound), initial=0.0))
        gain_db = min(wanted_db, float(20.0 * np.log10(PEAK / peak))) if peak > 0.0 else wanted_db
        return (sound * np.float32(10.0 ** (gain_db / 20.0))).astype(np.float32), gain_db


def for_noise(sound: Samples) -> Samples:
    """Return a sentence, shape (n,), float32, as it is better understood in noise at the same loudness."""
    if not sound.any():
        return sound
    window = np.hanning(round(ENVELOPE_S * SAMPLE_RATE_HZ))
    size = 1 << (len(sound) + len(window)).bit_length()
    gains = 10.0 ** (np.interp(np.fft.rfftfreq(size, 1.0 / SAMPLE_RATE_HZ), SHAPE_HZ, SHAPE_DB) / 20.0)
    shaped = np.fft.irfft(np.fft.rfft(sound, size) * gains, size)[: len(sound)]
    power = np.fft.irfft(np.fft.rfft(np.square(shaped), size) * np.fft.rfft(window / window.sum(), size), size)
    power = power[(len(window) - 1) // 2 :][: len(sound)]  # of the middle of the window
    lift = np.maximum(power / np.mean(np.square(shaped)), LEAST_POWER) ** (0.5 * (LEFT - 1.0))
    out = (shaped * np.minimum(lift, 10.0 ** (MOST_LIFT_DB / 20.0))).astype(np.float32)
    return fade(out * level_gain(out), FADE_S)
