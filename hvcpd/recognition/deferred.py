"""Deferred buffer of the template decoder: it need not decode what the waveform listener understands without it.

Sound is kept while that listener may still make a sentence of it. If nothing comes of that, the decoder hears it
afterwards, piece by piece as if it had listened all the time. No sentence depends on it (269 of 272 right with it and
without), but a fifth of the processor's time.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hvcpd.recognition.frontend import N_BANDS, Energies

PATIENCE_FRAMES = 80
"""0.8 s after the network would have woken, the first two words are known to the other listener, or it hears none."""
QUIET_FRAMES = 8
"""80 ms below the activity's release: whoever spoke has ended, or speaks so faintly that nothing is gained.

With 180 ms, which no pause at a comma has, a sixth of the cost is saved; but of 120 sentences in babble at 20 dB one
was lost and one heard wrongly, for the network hears what it catches up with in the noise of later."""


class DeferredBuffer:
    """Pieces of sound that the network has not heard yet, and what came before them."""

    def __init__(self) -> None:
        self._pieces: list[Energies] = []
        self._before = np.zeros((0, N_BANDS), np.float32)
        self.n_frames = 0
        """In all pieces but the first."""

    def __bool__(self) -> bool:
        return bool(self._pieces)

    def clear(self) -> None:
        """Nobody needs to hear them any more."""
        self._pieces, self.n_frames = [], 0

    def add(self, energies: Energies, recent: Energies) -> None:
        """The next piece, shape (n, N_BANDS); `recent`: the last frames, itself at their end."""
        if self._pieces:
            self.n_frames += len(energies)
        else:
            self._before = recent[: len(recent) - len(energies)]
        self._pieces.append(energies)

    def taken(self, most_recent: int) -> Iterator[tuple[Energies, Energies, int]]:
        """Each piece, what was recent with it (at most so many frames), and how many frames came after it."""
        heard = np.concatenate([self._before, *self._pieces])
        at = len(self._before)
        pieces = self._pieces
        self.clear()
        for piece in pieces:
            at += len(piece)
            yield piece, heard[max(at - most_recent, 0) : at], len(heard) - at
