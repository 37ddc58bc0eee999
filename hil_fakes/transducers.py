"""Loudspeakers and microphones as filters of the sound's magnitude; its phase is left alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples


def band(sound: Samples, low_hz: float, high_hz: float) -> Samples:
    """Return sound, shape (n,), float32, through a small loudspeaker: 12 dB an octave below `low_hz` and above
    `high_hz` (Butterworth of order 2)."""
    return _filtered(
        sound,
        lambda hz: (1.0 + (low_hz / np.maximum(hz, 1.0)) ** 4) ** -0.5 * (1.0 + (hz / high_hz) ** 4) ** -0.5,
    )


def tilt(sound: Samples, db_per_octave: float) -> Samples:
    """Return sound, shape (n,), float32, through a microphone whose sensitivity rises by `db_per_octave`: 0 dB at 1
    kHz, constant below 100 Hz."""
    return _filtered(sound, lambda hz: 10.0 ** (db_per_octave / 20.0 * np.log2(np.clip(hz, 100.0, None) / 1000.0)))


def _filtered(sound: Samples, gain_at: Callable[[NDArray[np.floating]], NDArray[np.floating]]) -> Samples:
    size = 1 << (len(sound) - 1).bit_length()
    hz = np.fft.rfftfreq(size, 1.0 / SAMPLE_RATE_HZ)
    gain = gain_at(hz)
    return np.asarray(np.fft.irfft(np.fft.rfft(sound, size) * gain, size)[: len(sound)], np.float32)
