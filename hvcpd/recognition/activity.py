"""Voice activity detection: sound well above the tracked noise, in any part of the spectrum; and stretches of speech.

The logarithm of each band's energy over the noise is averaged over a short window and over groups of bands; the
loudest group decides. Averaging logarithms makes the same thresholds hold in any noise at any level.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.events import Garbled
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, Energies
from hvcpd.recognition.noise import STEADY_NOISE

FAST_FRAMES = 8
"""80 ms: short enough to hear an onset in time for listen-before-talk."""
SLOW_FRAMES = 16
"""160 ms, about a syllable: for speech too weak for the fast window."""
LONG_FRAMES = 48
"""480 ms, about a short word: for speech below the noise. The network is woken with what was heard since."""
RATIO_RANGE = (-1.0, 3.0)
"""Natural log of a band's energy over the noise, clipped (-4 to 13 dB): one loud band does not decide alone."""
_LEAST, _MOST = map(np.float32, RATIO_RANGE)
N_GROUPS = 3
"""Low, middle and high bands are evaluated separately, and all together."""
ONSET, RELEASE = 0.8, 0.45
"""Mean log ratio to steady noise from which somebody speaks, 5 standard deviations of the fast window there; and below
which nobody does any more, after RELEASE_FRAMES."""
RELEASE_FRAMES = 16
"""160 ms, which bridge the closures of stop consonants and the commas' pauses."""
ALERT, LONG_ALERT = 0.3, 0.18
"""Thresholds of the slow and of the long window that wake the network: the most in 5 minutes of steady noise (5
deviations)."""
MIN_FRAMES = 30
"""0.3 s: shorter sounds are knocks and clicks."""
MIN_MODULATION = 0.35
"""Standard deviation over time of the mean log energy, natural log: steady noise has 0.1, speech 0.7 and more."""
WAIT_FRAMES = 30
"""0.3 s of quiet, after RELEASE_FRAMES, before speech without a sentence is given up and searched for people's. With
0.2 s a stranger is answered 0.1 s sooner, but a robot's faint sentence 10 m away was broken off."""
LONGER_WAIT_FRAMES = 110
"""The same while a sentence seems to be under way (1.1 s): its faint end may still come (a final n in noise)."""


def _group_matrix() -> NDArray[np.float32]:
    """Weights of the bands in the means over each group, and over all bands, shape (N_BANDS, N_GROUPS + 1)."""
    groups = np.kron(np.eye(N_GROUPS), np.full((N_BANDS // N_GROUPS, 1), N_GROUPS / N_BANDS))
    return np.hstack([groups, np.full((N_BANDS, 1), 1.0 / N_BANDS)]).astype(np.float32)


def _window_matrix() -> NDArray[np.float32]:
    """Weights of the history's frames in the means over its last FAST_FRAMES, SLOW_FRAMES and LONG_FRAMES."""
    windows = np.zeros((3, LONG_FRAMES), np.float32)
    for row, length in zip(windows, (FAST_FRAMES, SLOW_FRAMES, LONG_FRAMES), strict=True):
        row[-length:] = 1.0 / length
    return windows


class ActivityDetector:
    """Tracks energies and noise, chunk by chunk; `busy` and `alert` describe the most recent frames."""

    def __init__(self) -> None:
        self._groups = _group_matrix()
        self._windows = _window_matrix()
        self._history = np.zeros((LONG_FRAMES, N_GROUPS + 1), np.float32)
        self.quiet_frames = 0
        """Number of quiet frames since speech ended."""
        self.busy = False
        """Somebody else is speaking."""
        self.alert = False
        """Something may be speech; more easily true than `busy`."""

    def push(self, energies: Energies, noise: NDArray[np.float32]) -> None:
        """Take the next frames, shape (n, N_BANDS), n at most FAST_FRAMES, and the noise estimate (N_BANDS,)."""
        n = len(energies)
        ratio = np.log(energies / noise) - STEADY_NOISE.mean_log
        np.minimum(np.maximum(ratio, _LEAST, out=ratio), _MOST, out=ratio)
        self._history[:-n] = self._history[n:].copy()
        self._history[-n:] = ratio @ self._groups
        fast, slow, long = np.maximum.reduce(self._windows @ self._history, axis=1).tolist()
        self.alert = slow > ALERT or fast > ONSET or long > LONG_ALERT
        if fast > ONSET:
            self.busy = True
        self.quiet_frames = 0 if fast > RELEASE else self.quiet_frames + n
        if self.quiet_frames >= RELEASE_FRAMES:
            self.busy = False

    def account_for(self, n_after: int) -> None:
        """Forget all but the last `n_after` frames, which a sentence explains. Ongoing speech will trigger it again."""
        self._history[: max(LONG_FRAMES - n_after, 0)] = 0.0

    def reset(self) -> None:
        """Start again in silence, for example after the robot's own words."""
        self._history.fill(0.0)
        self.busy = False
        self.alert = False


class SegmentTracker:
    """Finds stretches of speech by `busy` and loudness; they are garbled where no sentence accounts for them."""

    def __init__(self) -> None:
        self._start: int | None = None
        self._end = 0
        self._count = 0
        self._sum = 0.0
        self._squares = 0.0

    def push(self, first_frame: int, energies: Energies, busy: bool) -> None:
        """Take the next frames, shape (n, N_BANDS), and whether somebody speaks in them."""
        if not busy:
            return
        if self._start is None:
            self._start = first_frame
            self._count, self._sum, self._squares = 0, 0.0, 0.0
        self._end = first_frame + len(energies)
        loudness = np.log(energies).mean(axis=1)
        self._count += len(energies)
        self._sum += float(loudness.sum())
        self._squares += float((loudness**2).sum())

    def ended(self, frame: int, under_way: bool) -> Garbled | None:
        """The speech that ended long enough before `frame`; anything else that ended is forgotten.

        `under_way`: the recogniser may still make a sentence of it.
        """
        wait = LONGER_WAIT_FRAMES if under_way else WAIT_FRAMES
        if self._start is None or frame - self._end < wait:
            return None
        return self.close(self._end)

    def close(self, frame: int) -> Garbled | None:
        """End the current stretch at `frame` at the latest; return it if it was speech."""
        if self._start is None:
            return None
        start, end = self._start, min(self._end, frame)
        self._start = None
        variance = self._squares / self._count - (self._sum / self._count) ** 2
        speech_like = variance >= MIN_MODULATION**2
        lasted = end - start >= MIN_FRAMES
        return Garbled(start * HOP_SAMPLES, end * HOP_SAMPLES) if speech_like and lasted else None
