"""Mel bands on which the phone net was trained, computed for sound in known noise.

The noise is estimated from the sound before the speech and subtracted. Where everything above 4 kHz was lost
(telephones, narrow microphones), it is extrapolated from the lower bands.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.arrays import quantile
from hvcpd.recognition.fitted import stored
from hvcpd.recognition.frontend import mel_edges_hz, power_ratio
from hvcpd.recognition.second_pass import Segment

Bands = NDArray[np.float64]
"""Mel filterbank energies, shape (frames, N_BANDS), of sound whose full scale is FULL_SCALE."""

N_BANDS, LOW_HZ, HIGH_HZ = 25, 130.0, 6800.0
WINDOW_SAMPLES, HOP_SAMPLES, FFT_SIZE, PRE_EMPHASIS = 410, 160, 512, 0.97
"""Parameters of the net's training, taken from PocketSphinx's model `en-us`."""
FULL_SCALE = 32768.0
LEVEL_RMS = 0.1
"""Level of the louder quarter of the speech's samples, full scale 1: that of the models' training speech."""
LEAST = 1e-4
"""Added to energies before the logarithm."""

SURELY_BEFORE_FRAMES = 20
"""Longest time (0.2 s) that speech may have begun before it was noticed."""
QUIETER = 0.5
"""Share of the frames before the speech, the quieter ones, that gives the noise: somebody may have spoken before. Of
171 sentences 0.7 s after another one 147 are understood, with a share of 0.7 140; alone 143 and 142."""
LEAST_FRAMES, QUIETEST = 10, 0.1
"""With fewer frames before it, the noise is estimated from the quietest part of the speech."""
SMOOTH = 0.5
"""Weight of the frame before in the smoothed energy to which the noise is compared."""
LEAST_GAIN = 0.05
"""Least gain of a band when its noise is removed. The models were trained on speech whose noise had been
removed in such a way, and with neighbouring bands' gains averaged (C. Kim & R. Stern, "Power-normalized cepstral
coefficients (PNCC) for robust speech recognition", ICASSP 2012). Filling up what follows a louder sound cost 11
of 198 sentences."""
GAIN_BANDS = 2
"""Neighbours to either side whose gains are averaged."""
MASK_DB = 37.0
"""Level below the loudest eighth of the frames that is masked: of 200 digits in quiet 181 were right, 165 without."""
MASK_SHARE = 8

UPPER = 20
"""The first band of those that lie above 4 kHz."""
LOST_DB = 35.0
"""Level below the loudest frame at which those bands count as lost, in all frames but one of LOST_SHARE: consonants
come to within 25 dB of it."""
LOST_SHARE = 50


@cache
def _filters() -> NDArray[np.float64]:
    """Triangles of unit area whose corners are whole lines of the spectrum, shape (FFT_SIZE // 2 + 1, N_BANDS)."""
    line_hz = SAMPLE_RATE_HZ / FFT_SIZE
    corners = np.floor(mel_edges_hz(LOW_HZ, HIGH_HZ, N_BANDS) / line_hz + 0.5) * line_hz
    left, centre, right = corners[:-2], corners[1:-1], corners[2:]
    hz = np.arange(FFT_SIZE // 2 + 1)[:, None] * line_hz
    rising, falling = (hz - left) / (centre - left), (right - hz) / (right - centre)
    return np.asarray(np.maximum(np.minimum(rising, falling), 0.0) * 2.0 / (right - left))


def bands_of(sound: Samples) -> Bands:
    """Energies of every whole frame of a sound, shape (n,), full scale 1; no row if it is too short."""
    if len(sound) < WINDOW_SAMPLES:
        return np.zeros((0, N_BANDS))
    scaled = np.asarray(sound, np.float64) * FULL_SCALE
    scaled[1:] -= PRE_EMPHASIS * scaled[:-1]
    frames = np.lib.stride_tricks.sliding_window_view(scaled, WINDOW_SAMPLES)[::HOP_SAMPLES]
    spectra = np.fft.rfft(frames * np.hamming(WINDOW_SAMPLES), FFT_SIZE)
    return np.asarray((spectra.real**2 + spectra.imag**2) @ _filters())


def levelled(sound: Samples, speech: Samples) -> tuple[Samples, Samples]:
    """A sound and its speech part, scaled to the level of the models' training."""
    if not len(speech):
        return sound, speech
    loud = np.sort(np.abs(speech))[-max(len(speech) // 4, 1) :]
    gain = np.float32(min(LEVEL_RMS / max(float(np.sqrt(np.mean(loud.astype(np.float64) ** 2))), 1e-6), 1e3))
    return gain * sound, gain * speech


def noise_of(sound: Samples, lead: int) -> NDArray[np.float64]:
    """Mean energies, shape (N_BANDS,), of the noise of a sound in which speech was noticed after `lead` samples."""
    bands = bands_of(sound)
    return quiet_mean(bands, (lead - WINDOW_SAMPLES) // HOP_SAMPLES + 1) if len(bands) else np.zeros(N_BANDS)


def quiet_mean(energies: NDArray[np.floating], lead: int) -> NDArray[np.float64]:
    """Mean energies, shape (bands,), of the noise in frames, shape (n, bands), in which speech was noticed after `lead`
    frames: of the quieter ones before it, or of the quietest of all where there are too few of those."""
    before = energies[: max(lead - SURELY_BEFORE_FRAMES, 0)]
    frames, share = (before, QUIETER) if len(before) >= LEAST_FRAMES else (energies, QUIETEST)
    power = frames.sum(axis=1)
    return np.asarray(frames[power <= quantile(power, share)].mean(axis=0))


def without_noise(bands: Bands, noise: NDArray[np.float64]) -> Bands:
    """The energies minus those of the noise, shape (N_BANDS,), within the range that the models know."""
    smooth = np.empty_like(bands)
    level = bands[0]
    for frame, energy in enumerate(bands):
        level = smooth[frame] = SMOOTH * level + (1.0 - SMOOTH) * energy
    gain = np.clip(1.0 - noise / np.maximum(smooth, LEAST), LEAST_GAIN, 1.0)
    sums = np.cumsum(np.pad(gain, ((0, 0), (1, 0))), axis=1)
    begin = np.maximum(np.arange(N_BANDS) - GAIN_BANDS, 0)
    end = np.minimum(np.arange(N_BANDS) + GAIN_BANDS + 1, N_BANDS)
    return np.asarray(bands * (sums[:, end] - sums[:, begin]) / (end - begin))


def logs_of(sound: Samples, noise: NDArray[np.float64]) -> Bands:
    """Logarithms of the energies, shape (frames, N_BANDS), of one utterance in a sound, shape (n,), with a short margin
    around it; `noise`, shape (N_BANDS,), is the mean of the noise's `bands_of`."""
    bands = bands_of(sound)
    if not len(bands):
        return bands
    logs = np.log(without_noise(bands, noise) + mask_of(bands) + LEAST)
    return completed(np.asarray(logs), bands)


def logs_of_segment(segment: Segment) -> Bands:
    """`logs_of` the speech in a segment of sound, whose noise is that before the speech."""
    sound, speech = levelled(segment.sound, segment.speech)
    return logs_of(speech, noise_of(sound, segment.lead))


def mask_of(energies: NDArray[np.floating]) -> float:
    """Energy of a band, of energies of shape (frames, bands), below which nothing counts."""
    power = np.sort(energies.sum(axis=1))
    loud = float(power[-max(len(power) // MASK_SHARE, 1) :].mean())
    return float(loud / energies.shape[1]) * power_ratio(-MASK_DB)


def completed(logs: Bands, bands: Bands) -> Bands:
    """Logarithms, shape (frames, N_BANDS), with empty upper bands of `bands` extrapolated."""
    if not upper_lost(bands):
        return logs
    lower, weights = logs[:, :UPPER], _regression()
    return np.concatenate([lower, weights[0] + lower @ weights[1:]], axis=1)


def upper_lost(bands: Bands) -> bool:
    """Whether there is nothing above 4 kHz."""
    upper = np.sort(bands[:, UPPER:].sum(axis=1))
    most = float(upper[-1 - len(upper) // LOST_SHARE])
    return most < power_ratio(-LOST_DB) * float(bands.sum(axis=1).max())


@cache
def _regression() -> NDArray[np.float64]:
    """Regression coefficients of the upper bands' logarithms on the lower ones', shape (1 + UPPER, N_BANDS - UPPER),
    the constants first; fitted by `benchmarks/upper_bands.py` to synthetic speech."""
    return np.asarray(stored(Path(__file__).with_name("upper_bands.npz"))["weights"], np.float64)
