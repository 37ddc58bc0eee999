"""The delivery of a sentence: faster or slower, louder or softer, or as people speak in noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hvcpd.ports import Samples
from hvcpd.synthesis.leveling import PEAK
from hvcpd.synthesis.voices import Voice

RATES = (0.5, 2.0)
"""Slowest and fastest `rate`: beyond, consonants run together or fall apart."""

GAINS_DB = (-60.0, 20.0)
"""Least and greatest `gain_db`; more than 20 dB above the usual level no peak could follow."""

LOMBARD_RATE = 0.85
"""People in noise stretch vowels and speak about 10 to 25 % slower (Junqua, JASA 93, 1993)."""

LOMBARD_PITCH = 1.1
"""Factor of the pitch of speech in noise: talkers raise it by one to three semitones (Junqua 1993; Lu and Cooke, JASA
124, 2008)."""

LOMBARD_TILT = 2.2
"""Factor of the source's low-pass frequency in noise. Talkers flatten the spectrum, the one change that helps listeners
by itself (Lu and Cooke, *Speech Communication* 51, 2009)."""

LOMBARD_OPEN = 0.75
"""Factor of the glottis's open share in noise. The voice is tenser: more sound in the formants, less in the first
harmonics (Junqua 1993)."""

LOMBARD_GAIN_DB = 6.0
"""Gain of speech in noise: the middle of what talkers add in 65 to 85 dB of noise."""


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
        if not self.lombard:
            return replace(voice, rate=voice.rate * self.rate)
        return replace(
            voice,
            rate=voice.rate * self.rate * LOMBARD_RATE,
            f0_hz=voice.f0_hz * LOMBARD_PITCH,
            tilt_hz=voice.tilt_hz * LOMBARD_TILT,
            open_quotient=voice.open_quotient * LOMBARD_OPEN,
            breathiness_db=voice.breathiness_db - 4.0,
        )

    def level(self, sound: Samples) -> tuple[Samples, float]:
        """Return the sound, shape (n,), at its level, and its gain, dB: less than asked for where its peak would
        pass `PEAK`."""
        wanted_db = self.gain_db + (LOMBARD_GAIN_DB if self.lombard else 0.0)
        peak = float(np.max(np.abs(sound), initial=0.0))
        gain_db = min(wanted_db, float(20.0 * np.log10(PEAK / peak))) if peak > 0.0 else wanted_db
        return (sound * np.float32(10.0 ** (gain_db / 20.0))).astype(np.float32), gain_db
