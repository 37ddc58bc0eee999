"""Recognises the urgent word while the robot itself speaks: echo cancellation removes its own voice first.

The residual still has the own voice in it, about 20 dB fainter, and fainter than any person whom the robot must obey.
The net of `keyword` listens to it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.echo import EchoCanceller
from hvcpd.recognition.events import Urgent
from hvcpd.recognition.frontend import HOP_SAMPLES, Energies
from hvcpd.recognition.keyword.net import KeywordNet
from hvcpd.recognition.keyword.words import LENGTH_FRAMES, KeywordSpotter, Word
from hvcpd.recognition.stream import FrameStream

EARLIER_S = 0.02
"""Largest deviation of the own voice's delay from the expected one, either way."""
FAINTEST_DB = -15.0
"""The least level of the word relative to the own voice's; the filter leaves -16 dB of it in its first sentence."""
LEVEL_QUANTILE = 0.75
"""Quantile of the frames' powers that counts as the level: that of the vowels."""
CERTAIN = 0.4
"""Least probability that counts: no later sound could confirm it, since the robot continues to speak. 12 of 12 calls
10 dB below the own voice have it; own talk, other robots, babble and knocks did not (`benchmarks/own_voice.py`)."""
RECENT_FRAMES = 400
"""The own level is that of the last 4 s of it."""


class Overhearing:
    """Push the played and the recorded sound, block by block; it listens from `begin` until the own voice is gone."""

    def __init__(self, net: KeywordNet) -> None:
        self._net = net
        self._echo = EchoCanceller()
        self._latency_s = 0.0
        self._own_powers = np.zeros(0)
        self.begin(0, 0.0)
        self._listens = False

    def begin(self, now: int, latency_s: float) -> None:
        """The robot begins to speak at sample `now`; of the earlier state, only the echo path is kept.

        `latency_s`: the time between handing out a block and hearing it, within EARLIER_S. The filter can follow only
        small changes of it and takes any larger change for another echo path.
        """
        if abs(latency_s - self._latency_s) > EARLIER_S / 2:
            self._latency_s = latency_s
            self._echo.reset()
        self._began = now
        self._listens = True
        self._echo.pause()
        self._net.reset()
        self._spotter = KeywordSpotter(self._net)
        self._left_powers = np.zeros(0)
        self._told_until = 0
        self._playing: Samples = np.zeros(max(round((self._latency_s - EARLIER_S) * SAMPLE_RATE_HZ), 0), np.float32)
        self._heard, self._rest = FrameStream(), FrameStream()

    def lost(self) -> None:
        """Sound was lost: the played and the recorded sound are out of step, and may stay so."""
        self._echo.reset()
        self._net.reset()

    def play(self, samples: Samples) -> None:
        """Push the sound that is played during the next block."""
        if self._listens:
            self._playing = np.concatenate([self._playing, samples])

    def hear(self, samples: Samples, speaking: bool) -> list[Urgent]:
        """Push the next samples, shape (n,), float32, with or without the own voice; returns the word, if any."""
        if not self._listens:
            return []
        if not speaking:
            self._listens = False
            return []
        missing = max(len(samples) - len(self._playing), 0)
        line = np.pad(self._playing, (0, missing))
        self._playing = line[len(samples) :]
        found: list[Urgent] = []
        least = self._least_level(samples)
        for chunk in self._rest.push(self._echo.take(line[: len(samples)], samples), False):
            self._left_powers = _recent(self._left_powers, chunk.energies, LENGTH_FRAMES)
            word = self._spotter.hear(chunk)
            if word is not None and word.chance >= CERTAIN and np.quantile(self._left_powers, LEVEL_QUANTILE) >= least:
                found += self._told(word)
        return found

    def _least_level(self, samples: Samples) -> float:
        """Level of the word relative to the own voice."""
        for chunk in self._heard.push(samples, False):
            self._own_powers = _recent(self._own_powers, chunk.energies, RECENT_FRAMES)
        if not len(self._own_powers):
            return 0.0
        return float(np.quantile(self._own_powers, LEVEL_QUANTILE) * 10.0 ** (FAINTEST_DB / 10.0))

    def _told(self, word: Word) -> list[Urgent]:
        if word.end_frame < self._told_until:
            return []  # it is reported already
        self._told_until = word.end_frame + LENGTH_FRAMES
        start, end = (self._began + frame * HOP_SAMPLES for frame in (word.start_frame, word.end_frame))
        return [Urgent(start, end)]


def _recent(powers: NDArray[np.float64], energies: Energies, most: int) -> NDArray[np.float64]:
    """The powers of the last frames, including these."""
    return np.concatenate([powers, energies.sum(axis=1, dtype=np.float64)])[-most:]
