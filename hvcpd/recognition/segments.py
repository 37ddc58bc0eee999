"""Finds speech-like stretches of activity: they are reported as garbled when no sentence accounts for them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvcpd.recognition.frontend import Energies


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
