"""`hvcpd` as a process of its own, real but for the sound card: in its place a quiet room, in real time.

python -m tests.daemon.quiet_robot --config FILE --name Rob
"""

from __future__ import annotations

import sys

from hvcpd.daemon.allocator import load_libraries

load_libraries()  # as hvcpd itself does, before anything else loads them

import asyncio
import random
from collections.abc import Iterator
from itertools import cycle

import numpy as np

from hvcpd.cli import main
from hvcpd.config.settings import AudioSettings
from hvcpd.daemon.devices import Devices
from hvcpd.hardware.audio_exchange import StreamCounters
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from tests.daemon.two_cards import BLOCK, TwoCards

NOISE = 1e-4
"""Amplitude of the microphone's own noise: -80 dBFS."""
N_NOISE_BLOCKS = 100
"""Of noise, 2.5 s, after which it begins again."""


def noise_blocks() -> Iterator[Samples]:
    """Yield noise for ever. Not NumPy's, whose generators are 3 MB that the daemon has only while it renders words."""
    rng = random.Random(1)
    blocks = [np.array([rng.gauss(0.0, NOISE) for _ in range(BLOCK)], np.float32) for _ in range(N_NOISE_BLOCKS)]
    return cycle(blocks)


class QuietRoom:
    """A microphone that hears nothing but its own noise, and a loudspeaker that nobody hears."""

    latency_s = 0.0

    def __init__(self, _: AudioSettings) -> None:
        self.counters = StreamCounters()
        self._due_s = 0.0
        self._noise = noise_blocks()

    async def open(self, afresh: bool = False) -> None:
        """Nothing to open."""

    async def start(self) -> None:
        """From now on a block comes every 25 ms."""
        self._due_s = asyncio.get_running_loop().time()

    async def read(self) -> Samples:
        """The next block, when its time has come: this is a process, and programs ask it by the real clock."""
        self._due_s += BLOCK / SAMPLE_RATE_HZ
        await asyncio.sleep(max(self._due_s - asyncio.get_running_loop().time(), 0.0))
        return next(self._noise).copy()

    def write(self, samples: Samples) -> None:
        """Into the void."""

    async def close(self) -> None:
        """Nothing to close."""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], Devices(TwoCards, QuietRoom)))
