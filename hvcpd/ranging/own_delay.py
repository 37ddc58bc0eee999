"""The delay after which the robot's own sentence returns to its microphone: the nominal one is not enough."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.ranging.arrival import peak_offset
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, Energies
from hvcpd.recognition.stream import FrameStream

HOP_S = HOP_SAMPLES / SAMPLE_RATE_HZ
MOST_DELAY_S = 1.0
"""Longer delays are not searched; the longest seen, on a computer with six times its capacity of work, is 0.7 s."""
LEAST_FRAMES = 60
"""0.6 s of the sentence must have come back, or else one vowel looks like another."""
COMPARED_FRAMES = 300
"""The last 3 s of a sentence are compared, which bounds memory and time."""
RANGE_DB = 40.0
"""Range of levels below each band's loudest; fainter parts of a sentence are lost in a room's noise."""
LEAST_CORRELATION = 0.45
CORRELATION_ROOT_FRAMES = 5.2
"""Least correlation: the first, and the second over the root of the number of frames (0.67 of 0.6 s).
Measured on sentences of 1.5 to 5 s in a room of 0.45 s: 0.9 with little noise, 0.55 to 0.7 at 0 dB, 0.46 to 0.55 at
-5 dB; on somebody else's different sentences 0.38 at most, on noise 0.08."""


class OwnDelay:
    """Measures that delay.

    Mel energies of the played and the recorded sound, in dB above a common floor and with each band's mean removed, are
    correlated over all possible delays. The peak is the delay if the correlation there is high enough. Levels, the
    frequency response of loudspeaker and room, and steady noise do not matter; with headphones on, there is no peak.
    Call `begin` with each own sentence, `play` and `hear` for every block in turn, and `measure` at its end.
    """

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """The robot begins to speak: the next block that is played has the sentence's first sample."""
        self._said, self._heard = _Track(), _Track()

    def play(self, samples: Samples) -> None:
        """Push the sound, shape (n,), that is played during the next recorded block."""
        self._said.push(samples)

    def hear(self, samples: Samples) -> None:
        """Push the recorded sound, shape (n,), float32."""
        self._heard.push(samples)

    def measure(self) -> float | None:
        """Return the delay of the own sentence in the sound recorded since `begin`, s; None if the sentence is not in
        it."""
        first = self._said.first
        said, heard = self._said.levels(first), self._heard.levels(first)
        spoken = np.flatnonzero(said.any(axis=1))
        said = said[: spoken[-1] + 1] if len(spoken) else said[:0]
        lags = min(round(MOST_DELAY_S / HOP_S) + 1, len(heard) - LEAST_FRAMES + 1)
        found = np.array([_likeness(said, heard[lag:]) for lag in range(lags)])
        if not len(found) or found.max() < 1.0:
            return None
        peak = int(found.argmax())
        return max(peak + peak_offset(found, peak), 0.0) * HOP_S


class _Track:
    """Mel energies of the last part of a sound."""

    def __init__(self) -> None:
        self._stream = FrameStream()
        self._kept: Energies = np.zeros((0, N_BANDS), np.float32)
        self._frames = 0

    def push(self, samples: Samples) -> None:
        new = [chunk.energies for chunk in self._stream.push(samples, False)]
        self._kept = np.concatenate([self._kept, *new])[-COMPARED_FRAMES:]
        self._frames = self._stream.next_frame

    @property
    def first(self) -> int:
        """The first frame that is kept."""
        return self._frames - len(self._kept)

    def levels(self, first: int) -> NDArray[np.float64]:
        """Levels from frame `first` on, dB above the silence threshold of each band, shape (n, N_BANDS)."""
        kept = self._kept[max(first - self.first, 0) :]
        if not len(kept):
            return np.zeros((0, N_BANDS))
        level = 10.0 * np.log10(kept.astype(np.float64))
        return np.asarray(np.maximum(level - (level.max(axis=0) - RANGE_DB), 0.0), np.float64)


def _likeness(said: NDArray[np.float64], heard: NDArray[np.float64]) -> float:
    """Pearson's correlation, over all bands together, of the common frames, divided by the least correlation
    required."""
    n = min(len(said), len(heard))
    if n < LEAST_FRAMES:
        return 0.0
    one, other = said[:n] - said[:n].mean(axis=0), heard[:n] - heard[:n].mean(axis=0)
    size = np.sqrt(np.vdot(one, one) * np.vdot(other, other)) + 1e-9
    return float(np.vdot(one, other) / size / max(LEAST_CORRELATION, CORRELATION_ROOT_FRAMES / np.sqrt(n)))
