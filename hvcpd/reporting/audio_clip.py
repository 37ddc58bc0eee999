"""The mission's sound, levelled for a listener and packed in a format that every browser plays."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import soundfile

from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in

KEPT_BITS = 10
"""Of each sample: quantization noise lies 62 dB below full scale, far below the room's own, and a minute takes 0.6 MB,
0.8 MB in base64."""
SPEECH_DBFS = -20.0
"""RMS that the median utterance is brought to: EBU R 128's −23 LUFS and a little more, for laptops' loudspeakers."""
MAX_GAIN_DB = 70.0
"""More would only show the converter's last bit."""
KNEE = 0.6
"""Amplitude, of full scale, above which a near robot's speech is bent towards full scale and not cut off."""


@dataclass(frozen=True)
class Clip:
    """A FLAC file. `gain_db` is what the sound was raised by before it was limited."""

    flac: bytes
    gain_db: float


def make_clip(sound: Samples, spoken_s: Iterable[tuple[float, float]]) -> Clip:
    """Pack sound, shape (n,), float32 at 16 kHz, not empty.

    `spoken_s` are the utterances' beginnings and ends, s, by which it is levelled; without any the loudest sample is.
    """
    clean = np.nan_to_num(sound.astype(np.float32), posinf=0.0, neginf=0.0)
    gain = _gain(clean, spoken_s)
    return Clip(flac(limited(clean * np.float32(gain)), KEPT_BITS), 20.0 * math.log10(gain))


def flac(sound: Samples, bits: int) -> bytes:
    """Sound, shape (n,), at 16 kHz, as a FLAC file that keeps so many bits; a whole step stays clear of full scale."""
    steps = np.rint(np.clip(sound, -1.0, 1.0) * (2 ** (bits - 1) - 1)).astype(np.int16) << (16 - bits)
    # By a file's number: a Python file would be written by callbacks, in which a signal such as Ctrl-C is lost.
    with os.fdopen(os.memfd_create("flac"), "w+b") as packed:
        soundfile.write(packed.fileno(), steps, SAMPLE_RATE_HZ, format="FLAC", subtype="PCM_16", closefd=False)
        packed.seek(0)
        return packed.read()


def _gain(sound: Samples, spoken_s: Iterable[tuple[float, float]]) -> float:
    levels = []
    for from_s, to_s in spoken_s:
        part = sound[slice_of(from_s, to_s, len(sound))]
        if len(part) and np.any(part):
            levels.append(float(np.sqrt(np.mean(np.square(part, dtype=np.float64)))))
    most = 10.0 ** (MAX_GAIN_DB / 20.0)
    if levels:
        return float(min(10.0 ** (SPEECH_DBFS / 20.0) / np.median(levels), most))
    peak = float(np.max(np.abs(sound), initial=0.0))
    return min(KNEE / peak, most) if peak > 0.0 else 1.0


def slice_of(from_s: float, to_s: float, n: int) -> slice:
    """The samples from one time to another, of `n` at 16 kHz; empty if the times are not finite or not in order."""
    if not (math.isfinite(from_s) and math.isfinite(to_s)):
        return slice(0, 0)
    end_s = n / SAMPLE_RATE_HZ
    first, last = (samples_in(min(max(at_s, 0.0), end_s)) for at_s in (from_s, to_s))
    return slice(first, max(first, last))


def limited(sound: Samples) -> Samples:
    """Return sound, shape (n,), float32, unchanged up to `KNEE`, above it bent smoothly, never beyond full scale."""
    size = np.abs(sound)
    room = np.float32(1.0 - KNEE)
    bent = KNEE + room * np.tanh((size - KNEE) / room)
    return np.where(size <= KNEE, sound, np.sign(sound) * bent).astype(np.float32)
