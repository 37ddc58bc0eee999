"""The last seconds of the microphone signal, without the robot's own speech."""

from __future__ import annotations

from collections import deque

import numpy as np

from hvcpd.ports import Samples


class History:
    """Blocks of sound with their places, in samples since the beginning."""

    def __init__(self, n: int) -> None:
        """Keep at least the last `n` samples."""
        self._most = n
        self._blocks: deque[tuple[int, Samples]] = deque()
        self._kept = 0

    def keep(self, n: int) -> None:
        """Keep at least the last `n` samples from now on."""
        self._most = max(self._most, n)

    def push(self, at: int, block: Samples) -> None:
        """Append a block, shape (m,), that begins at sample `at`, after all others."""
        self._blocks.append((at, block))
        self._kept += len(block)
        while self._kept - len(self._blocks[0][1]) > self._most:
            self._kept -= len(self._blocks.popleft()[1])

    def around(self, begin: int, middle: int, end: int) -> tuple[Samples, int]:
        """Return the kept sound from sample `begin` up to `end`, in whole blocks; and the number of its samples before
        `middle`."""
        parts = [(at, block) for at, block in self._blocks if at + len(block) > begin and at < end]
        sound = np.concatenate([block for _, block in parts]) if parts else np.zeros(0, np.float32)
        return sound, sum(min(len(block), max(middle - at, 0)) for at, block in parts)
