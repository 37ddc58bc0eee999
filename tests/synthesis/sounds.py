"""Measures of sound, independent of the synthesizer that made it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples


def pitch_hz(sound: Samples, low_hz: float = 60.0, high_hz: float = 320.0) -> float:
    """The pitch of the loudest 80 ms by autocorrelation, normalised for the overlap; parabolic interpolation.

    Only what is below 500 Hz is looked at, so that no formant is taken for the pitch.
    """
    spectrum = np.fft.rfft(sound.astype(float))
    spectrum[np.fft.rfftfreq(len(sound), 1.0 / SAMPLE_RATE_HZ) > 500.0] = 0.0
    sound = np.fft.irfft(spectrum, len(sound)).astype(np.float32)
    size = round(0.08 * SAMPLE_RATE_HZ)
    energy = np.convolve(sound.astype(float) ** 2, np.ones(size), "valid")
    start = int(np.argmax(energy))
    frame = sound[start : start + size].astype(float)
    frame = frame - frame.mean()
    lags = np.arange(int(SAMPLE_RATE_HZ / high_hz), int(SAMPLE_RATE_HZ / low_hz) + 1)
    score = np.array(
        [
            np.dot(frame[:-lag], frame[lag:])
            / np.sqrt(np.dot(frame[:-lag], frame[:-lag]) * np.dot(frame[lag:], frame[lag:]))
            for lag in lags
        ]
    )
    peaks = [k for k in range(1, len(lags) - 1) if score[k - 1] < score[k] >= score[k + 1]]
    # The shortest lag that is nearly the best: longer ones are whole multiples of it.
    best = next(k for k in peaks if score[k] > 0.9 * max(score[p] for p in peaks))
    a, b, c = score[best - 1 : best + 2]
    return SAMPLE_RATE_HZ / (lags[best] + 0.5 * (a - c) / (a - 2 * b + c))


def spectrum_db(sound: Samples, size: int = 4096) -> NDArray[np.float64]:
    """Magnitudes of a Hann-windowed stretch from the middle of a sound, dB, bins of 16 kHz / `size`."""
    middle = max(0, len(sound) // 2 - size // 2)
    frame = np.zeros(size)
    part = sound[middle : middle + size]
    frame[: len(part)] = part * np.hanning(len(part))
    return np.asarray(20.0 * np.log10(np.abs(np.fft.rfft(frame)) + 1e-9))


def rms_db(sound: Samples) -> float:
    """Level, dB re full scale."""
    return float(10.0 * np.log10(np.mean(sound.astype(float) ** 2) + 1e-20))
