"""The microphone's side: clock error, noise suppression, gain control and codec."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, idct, next_fast_len
from scipy.ndimage import map_coordinates
from scipy.signal import istft, resample, stft

from hvcpd.ports import SAMPLE_RATE_HZ

Sound = NDArray[np.float64]
OVERSAMPLED = 4
"""Before interpolation by splines of order 5, whose error is then below -100 dB up to 7 kHz."""
GAIN_STEP_S = 0.02


@dataclass(frozen=True)
class Microphone:
    """The effects of a sound card and its driver, in this order; by default none.

    `suppression_db`: most that noise is lowered (Wiener's gain with the decision-directed estimate of Ephraim
    & Malah, IEEE TASSP 32, 1984). `gain_control`: the level is led to -23 dBFS within a second up and 50 ms down, by
    20 dB at most. `codec_bits`: of each coefficient of a transform codec, relative to the greatest in its band of
    500 Hz, up to `codec_hz`; 0 for none.
    """

    suppression_db: float = 0.0
    gain_control: bool = False
    codec_bits: int = 0
    codec_hz: float = 8000.0

    def take(self, sound: Sound) -> Sound:
        """Apply the effects to a sound, shape (n,)."""
        if self.suppression_db:
            sound = suppressed(sound, self.suppression_db)
        if self.gain_control:
            sound = controlled(sound)
        return coded(sound, self.codec_bits, self.codec_hz) if self.codec_bits else sound


def narrow(cut_hz: float) -> Microphone:
    """As of a telephone or a headset, which give nothing above a frequency."""
    return Microphone(codec_bits=12, codec_hz=cut_hz)


def moved(sound: Sound, lag_s: NDArray[np.float64]) -> Sound:
    """The resampled sound: sample k of the result is the sound at `lag_s[k]` s before sample k."""
    padded = np.pad(sound, (0, next_fast_len(len(sound) + 64) - len(sound)))
    dense = resample(padded, OVERSAMPLED * len(padded))
    at = (np.arange(len(lag_s)) - lag_s * SAMPLE_RATE_HZ) * OVERSAMPLED
    return np.asarray(map_coordinates(dense, [at], order=5, mode="constant"))


def suppressed(sound: Sound, most_db: float) -> Sound:
    """Apply a noise suppressor, which tracks the noise by its minima over 1.5 s."""
    size, hop = 512, 128
    _, _, spectrum = stft(sound, nperseg=size, noverlap=size - hop)
    power = np.abs(spectrum) ** 2
    smooth = np.empty_like(power)
    smooth[:, 0] = power[:, 0]
    for k in range(1, power.shape[1]):
        smooth[:, k] = 0.85 * smooth[:, k - 1] + 0.15 * power[:, k]
    span = round(1.5 * SAMPLE_RATE_HZ / hop)
    least = np.array([smooth[:, max(k - span, 0) : k + 1].min(axis=1) for k in range(power.shape[1])]).T
    noise = np.maximum(1.7 * least, 1e-12)  # a minimum of smoothed powers lies below their mean
    floor = 10.0 ** (-most_db / 20.0)
    clean = np.zeros(len(power))
    gains = np.empty_like(power)
    for k in range(power.shape[1]):
        prior = 0.97 * clean / noise[:, k] + 0.03 * np.maximum(power[:, k] / noise[:, k] - 1.0, 0.0)
        gains[:, k] = np.maximum(prior / (1.0 + prior), floor)
        clean = gains[:, k] ** 2 * power[:, k]
    return np.asarray(istft(spectrum * gains, nperseg=size, noverlap=size - hop)[1][: len(sound)])


def controlled(sound: Sound, target_dbfs: float = -23.0, most_db: float = 20.0) -> Sound:
    """Apply automatic gain control."""
    step = round(GAIN_STEP_S * SAMPLE_RATE_HZ)
    blocks = np.pad(sound, (0, -len(sound) % step)).reshape(-1, step)
    powers = np.mean(blocks**2, axis=1)
    gains_db = np.empty(len(powers) + 1)
    level, gain_db = float(powers[0]), 0.0
    for k, power in enumerate(powers):
        level += (power - level) * (1.0 - np.exp(-GAIN_STEP_S / (0.05 if power > level else 1.0)))
        wanted = np.clip(target_dbfs - 10.0 * np.log10(max(level, 1e-10)), -most_db, most_db)
        gain_db += (wanted - gain_db) * (1.0 - np.exp(-GAIN_STEP_S / (0.05 if wanted < gain_db else 1.0)))
        gains_db[k] = gain_db
    gains_db[-1] = gain_db
    at = np.arange(len(sound)) / step
    return sound * 10.0 ** (np.interp(at, np.arange(len(gains_db)), gains_db) / 20.0)


def coded(sound: Sound, bits: int, high_hz: float) -> Sound:
    """Through a transform codec: MDCT of 20 ms with a sine window, 500 Hz bands rounded to their greatest value."""
    half = SAMPLE_RATE_HZ // 100
    padded = np.pad(sound, (half, half + -len(sound) % half))
    window = np.sin(np.pi * (np.arange(2 * half) + 0.5) / (2 * half))
    frames = np.lib.stride_tricks.sliding_window_view(padded, 2 * half)[::half] * window
    quarter = half // 2
    a, b, c, d = (frames[:, k * quarter : (k + 1) * quarter] for k in range(4))
    lines = dct(np.concatenate([-c[:, ::-1] - d, a - b[:, ::-1]], axis=1), type=4, norm="ortho")
    lines[:, round(high_hz / SAMPLE_RATE_HZ * 2 * half) :] = 0.0
    bands = lines.reshape(len(lines), 16, -1)
    scale = np.maximum(np.max(np.abs(bands), axis=2, keepdims=True), 1e-9) / (2 ** (bits - 1) - 0.5)
    folded = idct((np.round(bands / scale) * scale).reshape(lines.shape), type=4, norm="ortho")
    one, two = folded[:, :quarter], folded[:, quarter:]
    back = np.concatenate([two, -two[:, ::-1], -one[:, ::-1], -one], axis=1) * window
    out = np.zeros(len(padded))
    for k, frame in enumerate(back):
        out[k * half : k * half + 2 * half] += frame
    return out[half : half + len(sound)]


def draw_microphone(rng: np.random.Generator) -> Microphone:
    """Half have no effect; the others any combination."""
    if rng.random() < 0.5:
        return Microphone()
    bits = int(rng.choice([0, 0, 4, 5, 6]))
    return Microphone(
        float(rng.choice([0.0, rng.uniform(6.0, 18.0)])),
        bool(rng.random() < 0.5),
        bits,
        float(rng.uniform(5500.0, 8000.0)),
    )
