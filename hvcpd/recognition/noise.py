"""Noise estimation while listening.

The noise in each band is a low percentile of the recent past, as in minimum statistics (R. Martin, "Noise power
spectral density estimation based on optimal smoothing and minimum statistics", IEEE Trans. SAP 9(5), 2001):
speech leaves gaps in every band, so its presence hardly moves that percentile.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.fitted import fitted
from hvcpd.recognition.frontend import ENERGY_FLOOR, N_BANDS, Energies

MEMORY_FRAMES = 300
"""Length of the window (3 s) of which the percentile is taken: longer than any word."""
WARM_UP_FRAMES = 12
"""Number of frames (0.12 s) from which on there is an estimate."""
STEP_FRAMES = 48
"""Frames (0.48 s) of steady sound after a step in level that are new noise: no speech sound stays even as long."""
STEP_NEPER = 0.7
"""Log energy ratio (3 dB) to the estimate from which a rise, mean over the bands, may be a step; and a fall in one
band, over TONE_FRAMES, is one: in steady noise that mean has a standard deviation of 1 dB."""
STEADY_DRIFT_NEPER = 0.22
"""Largest difference between the halves of the window, mean over the bands; steady noise: 0.11, hardly above 0.18."""
STEADY_SPREAD = 1.15
"""Largest spread in time, relative to steady noise's, mean over the bands; hardly ever above 1.06 there.
Speech 3 dB above a noise has 1.3 and more, in quiet 3 and more (both measured on our own voices)."""
TONE_FRAMES = 24
"""Frames (0.24 s) of a steady tone, or of lower energy, that count as a band's new noise: a motor changes its speed
faster than the memory forgets, and hardly any vowel stays that long unchanged."""
TONE_EVERY_FRAMES = 8
"""Interval at which tones are searched for: 80 ms."""
TONE_SPREAD = 0.6
"""Largest spread in time of a tone, as a share of steady noise's; speech has more than the noise."""
TONE_DRIFT_NEPER = 0.35
"""Largest difference between the halves of a tone (1.5 dB)."""
TONE_RISE_NEPER = 0.4
"""Least rise of a tone above the estimate (1.7 dB)."""
TONE_SHARE = 0.3
"""A rise is a tone whose pitch has moved if its power is at most this share of the whole noise's. A vowel that is
louder than the noise is none."""
NOISE_QUANTILE = 0.2
"""Of a band's energies: low enough that speech four fifths of the time leaves the estimate of the noise alone."""


_WEIGHTS = fitted("steady_noise")["weights"]
STEADY_RATIO = np.array(_WEIGHTS["percentile_ratio"], np.float32)
"""NOISE_QUANTILE of a band's energies in steady noise over their mean, shape (N_BANDS,). `python -m benchmarks.fit
--only steady_noise` measures it on 40 s of white noise, like the next two (estimates good to about 1 %)."""
STEADY_MEAN_LOG, STEADY_STD_LOG = (np.array(_WEIGHTS[name], np.float32) for name in ("mean_log", "std_log"))
"""Mean and standard deviation of the natural logarithm of energy over mean energy there, shape (N_BANDS,)."""


class NoiseTracker:
    """Estimates the mean noise energy of each band from the last seconds of sound."""

    def __init__(self) -> None:
        self._past: Energies = np.zeros((0, N_BANDS), np.float32)
        """The last frames, MEMORY_FRAMES at most."""
        self._unseen = 0
        self.estimate: NDArray[np.float32] = np.full(N_BANDS, ENERGY_FLOOR, np.float32)
        """Mean noise energy a band, shape (N_BANDS,), linear power."""

    @property
    def ready(self) -> bool:
        """Whether enough has been heard for an estimate."""
        return len(self._past) >= WARM_UP_FRAMES

    def push(self, energies: Energies) -> None:
        """Remember frames of shape (n, N_BANDS), and update the estimate."""
        self._past = np.concatenate([self._past, energies])[-MEMORY_FRAMES:]
        if self.ready:
            rank = int(NOISE_QUANTILE * (len(self._past) - 1))
            ranked = np.partition(self._past, rank, axis=0)
            np.maximum(ranked[rank] / STEADY_RATIO, ENERGY_FLOOR, out=self.estimate)
        self._unseen += len(energies)
        if self._unseen >= TONE_EVERY_FRAMES and len(self._past) >= TONE_FRAMES:
            self._unseen = 0
            self._follow_bands()

    def _follow_bands(self) -> None:
        """Forget the past of the bands in which a tone has come or gone."""
        window = self._past[-TONE_FRAMES:]
        level, estimate = window.mean(axis=0), self.estimate
        rise = np.log(level / estimate)
        moved = rise < -STEP_NEPER
        risen = (rise > TONE_RISE_NEPER) & (level < TONE_SHARE * estimate.sum())
        if risen.any():
            drift, spread = _drift_and_spread(window)
            moved |= risen & (spread < TONE_SPREAD) & (drift < TONE_DRIFT_NEPER)
        if moved.any():
            self._past[:-TONE_FRAMES, moved] = (level * STEADY_RATIO)[moved]
            estimate[moved] = np.maximum(level, ENERGY_FLOOR)[moved]

    def follow_step(self) -> bool:
        """Whether the last STEP_FRAMES are steady and well above the estimate; if so, they replace the history."""
        if len(self._past) < STEP_FRAMES:
            return False
        window = self._past[-STEP_FRAMES:]
        rise = np.log(np.add.reduce(window, axis=0) / (STEP_FRAMES * self.estimate))
        if float(np.add.reduce(rise)) < N_BANDS * STEP_NEPER:
            return False
        drift, spread = _drift_and_spread(window)
        if float(drift.mean()) >= STEADY_DRIFT_NEPER or float(spread.mean()) >= STEADY_SPREAD:
            return False
        self._past = self._past[:0]
        self.push(window)
        return True


def _drift_and_spread(window: Energies) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Each band's difference between the halves of a window, neper; its spread in time, relative to steady noise's."""
    logs = np.log(window)
    half = len(window) // 2
    drift = np.abs(logs[:half].mean(axis=0) - logs[half:].mean(axis=0))
    return drift, logs.std(axis=0) / STEADY_STD_LOG
