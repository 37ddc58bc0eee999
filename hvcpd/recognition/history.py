"""The last seconds of what was heard, without what the robot itself said."""

from __future__ import annotations

from collections import deque

import numpy as np

from hvcpd.ports import Samples


class History:
    """Blocks of sound with their places, in samples since the beginning."""

    def __init__(self, n: int) -> None:
        """It keeps `n` samples at least."""
        self._most = n
        self._blocks: deque[tuple[int, Samples]] = deque()
        self._kept = 0

    def keep(self, n: int) -> None:
        """Keep `n` samples at least, from now on."""
        self._most = max(self._most, n)

    def push(self, at: int, block: Samples) -> None:
        """A block, shape (m,), that begins at sample `at`, after all others."""
        self._blocks.append((at, block))
        self._kept += len(block)
        while self._kept - len(self._blocks[0][1]) > self._most:
            self._kept -= len(self._blocks.popleft()[1])

    def around(self, begin: int, middle: int, end: int) -> tuple[Samples, int]:
        """The sound from sample `begin` up to `end`, as far as it is kept; and how many samples of it are before
        `middle`. Whole blocks."""
        parts = [(at, block) for at, block in self._blocks if at + len(block) > begin and at < end]
        sound = np.concatenate([block for _, block in parts]) if parts else np.zeros(0, np.float32)
        return sound, sum(min(len(block), max(middle - at, 0)) for at, block in parts)
