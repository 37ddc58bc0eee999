"""Deferred buffer of the template decoder, which need not decode speech that the waveform listener understands alone.

Sound is kept while that listener may still make a sentence of it. If it does not, the decoder processes the sound
afterwards, segment by segment, as if it had listened all the time. The recognition rate does not depend on the buffer
(269 of 272 sentences are right with and without it), but a fifth of the processor's time does.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hvcpd.recognition.frontend import N_BANDS, Energies

PATIENCE_FRAMES = 80
"""0.8 s after the network would have woken, the other listener knows the first two words, or it recognises nothing."""
QUIET_FRAMES = 8
"""80 ms below the activity's release: the speaker has ended, or speaks too faintly for any gain.

With 180 ms, which no pause at a comma has, a sixth of the cost is saved; but of 120 sentences in babble at 20 dB one
was lost and one heard wrongly, because the network decodes the deferred sound with the noise estimate of later."""


class DeferredBuffer:
    """Segments of sound that the network has not processed yet, and the frames before them."""

    def __init__(self) -> None:
        self._pieces: list[Energies] = []
        self._before = np.zeros((0, N_BANDS), np.float32)
        self.n_frames = 0
        """Number of frames in all segments but the first."""

    def __bool__(self) -> bool:
        return bool(self._pieces)

    def clear(self) -> None:
        """Drop all segments: nobody needs them any more."""
        self._pieces, self.n_frames = [], 0

    def add(self, energies: Energies, recent: Energies) -> None:
        """Add the next segment, shape (n, N_BANDS); `recent`: the last frames, which end with this segment."""
        if self._pieces:
            self.n_frames += len(energies)
        else:
            self._before = recent[: len(recent) - len(energies)]
        self._pieces.append(energies)

    def taken(self, most_recent: int) -> Iterator[tuple[Energies, Energies, int]]:
        """Yield each segment, its recent frames (at most this many), and the number of frames after it."""
        heard = np.concatenate([self._before, *self._pieces])
        at = len(self._before)
        pieces = self._pieces
        self.clear()
        for piece in pieces:
            at += len(piece)
            yield piece, heard[max(at - most_recent, 0) : at], len(heard) - at
