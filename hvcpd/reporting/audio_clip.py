"""The mission's sound, levelled for a listener and packed as a WAV file that every browser plays."""

from __future__ import annotations

import io
import math
import wave
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.hardware.audio_resample import resample
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.reporting.pcm import pcm_16

BUDGET_BYTES = 4_200_000
"""For the packed sound: 5.6 MB in base64, so that a page of a mission of three minutes stays under 6 MB."""
SPEECH_DBFS = -20.0
"""RMS that the median utterance is brought to: EBU R 128's −23 LUFS and a little more, for laptops' loudspeakers."""
MAX_GAIN_DB = 70.0
"""More would only show the converter's last bit."""
KNEE = 0.6
"""Amplitude, of full scale, above which a near robot's speech is bent towards full scale and not cut off."""
_DITHER_SEED = 20


@dataclass(frozen=True)
class Clip:
    """A WAV file, mono PCM. `gain_db` is what the sound was raised by before it was limited."""

    wav: bytes
    rate_hz: int
    bits: int
    gain_db: float
    duration_s: float

    @property
    def described(self) -> str:
        """The format in words."""
        return f"{self.rate_hz // 1000} kHz, {self.bits} bit"


def make_clip(sound: Samples, spoken_s: Iterable[tuple[float, float]], budget_bytes: int = BUDGET_BYTES) -> Clip:
    """Pack sound, shape (n,), float32 at 16 kHz, in the best format that `budget_bytes` allows.

    16 bit, else 8 bit, else 8 bit at 8 kHz however long it gets. `spoken_s` are the utterances' beginnings and ends,
    s, by which it is levelled; without any the loudest sample is.
    """
    clean = np.nan_to_num(sound.astype(np.float32), posinf=0.0, neginf=0.0)
    gain = _gain(clean, spoken_s)
    duration_s = len(clean) / SAMPLE_RATE_HZ
    rate_hz, bits = SAMPLE_RATE_HZ, 16
    if 2 * len(clean) > budget_bytes:
        bits = 8
    if len(clean) > budget_bytes:
        rate_hz = SAMPLE_RATE_HZ // 2
        clean = resample(clean, SAMPLE_RATE_HZ, rate_hz)
    packed = _pack(limited(clean * np.float32(gain)), bits)
    return Clip(_wav(packed, rate_hz, bits), rate_hz, bits, 20.0 * math.log10(gain), duration_s)


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


def _pack(sound: Samples, bits: int) -> bytes:
    if bits == 16:
        return pcm_16(sound)
    # Triangular dither of one step each way makes the error of 8 bits a steady hiss below the room's own noise
    # (Lipshitz, Wannamaker & Vanderkooy 1992); its seed is fixed, so that the same mission gives the same page.
    rng = np.random.default_rng(_DITHER_SEED)
    dither: NDArray[np.float32] = rng.random(len(sound), np.float32) - rng.random(len(sound), np.float32)
    return bytes(np.clip(np.rint(sound * 126.0 + dither) + 128.0, 0, 255).astype(np.uint8).tobytes())


def _wav(packed: bytes, rate_hz: int, bits: int) -> bytes:
    """Return a WAV file, mono; 8-bit samples are unsigned, others signed, as the format has it."""
    file = io.BytesIO()
    with wave.open(file, "wb") as writer:
        writer.setparams((1, bits // 8, rate_hz, 0, "NONE", ""))
        writer.writeframes(packed)
    return file.getvalue() + b"\0" * (len(packed) % 2)  # chunks are padded to even lengths
