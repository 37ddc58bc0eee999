"""Voice activity detection: sound well above the tracked noise, in any part of the spectrum; and stretches of speech.

The logarithm of each band's energy over the noise is averaged over a short window and over groups of bands; the
loudest group decides. Averaging logarithms makes the same thresholds hold in any noise at any level.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.frontend import N_BANDS, Energies
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


@dataclass(frozen=True)
class ActivitySettings:
    """Thresholds in natural-log units of power (1 = 4.3 dB) above what steady noise gives."""

    onset: float = 0.8
    """Busy from here: 5 standard deviations of the fast window in steady noise."""
    release: float = 0.45
    """Threshold below which it is no longer busy, after `release_frames`."""
    release_frames: int = 16
    """160 ms below `release`, which bridge the closures of stop consonants and the commas' pauses."""
    alert: float = 0.3
    """The slow window's threshold that wakes the network: the most in 5 minutes of steady noise (5 deviations)."""
    long_alert: float = 0.18
    """The long window's, likewise."""


def _group_matrix() -> NDArray[np.float32]:
    groups = np.zeros((N_BANDS, N_GROUPS + 1), np.float32)
    width = N_BANDS // N_GROUPS
    for g in range(N_GROUPS):
        groups[g * width : (g + 1) * width, g] = 1.0 / width
    groups[:, N_GROUPS] = 1.0 / N_BANDS
    return groups


def _window_matrix() -> NDArray[np.float32]:
    """Weights of the history's frames in the means over its last FAST_FRAMES, SLOW_FRAMES and LONG_FRAMES."""
    windows = np.zeros((3, LONG_FRAMES), np.float32)
    for row, length in zip(windows, (FAST_FRAMES, SLOW_FRAMES, LONG_FRAMES), strict=True):
        row[-length:] = 1.0 / length
    return windows


class ActivityDetector:
    """Tracks energies and noise, chunk by chunk; `busy` and `alert` describe the most recent frames."""

    def __init__(self, settings: ActivitySettings) -> None:
        self._settings = settings
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
        s = self._settings
        self.alert = slow > s.alert or fast > s.onset or long > s.long_alert
        if fast > self._settings.onset:
            self.busy = True
        self.quiet_frames = 0 if fast > self._settings.release else self.quiet_frames + n
        if self.quiet_frames >= self._settings.release_frames:
            self.busy = False

    def account_for(self, n_after: int) -> None:
        """Forget all but the last `n_after` frames, which a sentence explains. Ongoing speech will trigger it again."""
        self._history[: max(LONG_FRAMES - n_after, 0)] = 0.0

    def reset(self) -> None:
        """Start again in silence, for example after the robot's own words."""
        self._history.fill(0.0)
        self.busy = False
        self.alert = False


@dataclass(frozen=True)
class SegmentSettings:
    """Criteria for a stretch of sound to count as speech."""

    min_frames: int = 30
    """0.3 s: shorter sounds are knocks and clicks."""
    min_modulation: float = 0.35
    """Standard deviation over time of the mean log energy, natural log: steady noise has 0.1, speech 0.7 and more."""
    wait_frames: int = 50
    """0.5 s of quiet before speech without a sentence is given up: twice the sentence's own end rule."""
    longer_wait_frames: int = 110
    """The same while a sentence seems to be under way (1.1 s): its faint end may still come (a final n in noise)."""


@dataclass(frozen=True)
class Segment:
    """Frames `start_frame` up to `end_frame`."""

    start_frame: int
    end_frame: int


class SegmentTracker:
    """Tracks `busy` and the loudness of the current stretch."""

    def __init__(self, settings: SegmentSettings) -> None:
        self._settings = settings
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

    def ended(self, frame: int, under_way: bool) -> Segment | None:
        """The speech that ended long enough before `frame`; anything else that ended is forgotten.

        `under_way`: the recogniser may still make a sentence of it.
        """
        wait = self._settings.longer_wait_frames if under_way else self._settings.wait_frames
        if self._start is None or frame - self._end < wait:
            return None
        return self.close(self._end)

    def close(self, frame: int) -> Segment | None:
        """End the current stretch at `frame` at the latest; return it if it was speech."""
        if self._start is None:
            return None
        segment = Segment(self._start, min(self._end, frame))
        self._start = None
        variance = self._squares / self._count - (self._sum / self._count) ** 2
        speech_like = variance >= self._settings.min_modulation**2
        lasted = segment.end_frame - segment.start_frame >= self._settings.min_frames
        return segment if speech_like and lasted else None
