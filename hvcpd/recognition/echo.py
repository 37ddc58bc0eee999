"""Acoustic echo cancellation: subtracts the robot's own known voice from the microphone signal while it speaks.

A Kalman filter in the frequency domain estimates the echo path from the loudspeaker through the room to the microphone.
It tracks each band's uncertainty together with the path itself. So another speaker at the same time slows the
adaptation down and does not mislead it (G. Enzner & P. Vary, "Frequency-domain adaptive Kalman filter for acoustic echo
control in hands-free telephones", Signal Processing 86(6), 2006; in partitions: F. Kuech et al., "State-space
architecture of the partitioned-block-based acoustic echo controller", ICASSP 2014).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import Samples

BLOCK = 320
"""Number of samples processed at a time: 20 ms."""
PARTS = 7
"""Number of blocks over which the echo path is modelled: 140 ms, of which 40 are for a latency that is known to within
20 ms only, the rest for the room's early sound."""
_EARLY_PARTS = 3
"""Number of first blocks, one of which has the direct sound."""
_LATE_POWER = 0.03
"""Initial power of later blocks, relative to the first ones."""
_DECAY = 0.6
"""Initial power of each later block relative to the one before: 20 ms in a room of 0.55 s."""
_FORGET = 0.9998
"""Change of the echo path from block to block: by half in a minute of speech."""
_SMOOTH = 0.8
"""Weight of the last block's error in the average of the noise."""
_SILENT = 1e-5
"""A peak below this is not a voice: the filter learns nothing from it."""


class EchoCanceller:
    """Push the played and the recorded samples in step; call `reset` when they have lost step."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the echo path."""
        bands = BLOCK + 1
        late = _LATE_POWER * _DECAY ** np.arange(PARTS - _EARLY_PARTS)
        prior = np.concatenate([np.ones(_EARLY_PARTS), late])
        self._way = np.zeros((PARTS, bands), np.complex128)
        self._unsure: NDArray[np.float64] = np.repeat(prior[:, None], bands, axis=1)
        self._noise: NDArray[np.float64] | None = None
        self.pause()

    def pause(self) -> None:
        """Forget the played sound but keep the echo path: some time has passed unprocessed."""
        self._last: Samples = np.zeros(BLOCK, np.float32)
        self._own = np.zeros((PARTS, BLOCK + 1), np.complex128)
        self._waiting: tuple[Samples, Samples] = (np.zeros(0, np.float32), np.zeros(0, np.float32))

    def take(self, played: Samples, heard: Samples) -> Samples:
        """Return `heard` without the robot's own voice, in whole blocks: the rest waits for the next call.

        Both have shape (n,), float32. `played` must not arrive after its echo, and at most 40 ms before it.
        """
        played = np.concatenate([self._waiting[0], played])
        heard = np.concatenate([self._waiting[1], heard])
        whole = len(heard) // BLOCK * BLOCK
        self._waiting = played[whole:], heard[whole:]
        parts = [self._block(played[i : i + BLOCK], heard[i : i + BLOCK]) for i in range(0, whole, BLOCK)]
        return np.concatenate([np.zeros(0, np.float32), *parts], dtype=np.float32)

    def _block(self, played: Samples, heard: Samples) -> Samples:
        newest = np.fft.rfft(np.concatenate([self._last, played]))
        self._last = played
        self._own = np.concatenate([newest[None], self._own[:-1]])
        if np.abs(self._own).max() < _SILENT:
            return heard
        rest: NDArray[np.float64] = heard - np.fft.irfft((self._own * self._way).sum(axis=0))[BLOCK:]
        self._learn(rest)
        return np.asarray(rest, np.float32)

    def _learn(self, rest: NDArray[np.float64]) -> None:
        error = np.fft.rfft(np.concatenate([np.zeros(BLOCK), rest]))
        power = np.abs(error) ** 2
        self._noise = power if self._noise is None else _SMOOTH * self._noise + (1.0 - _SMOOTH) * power
        own_power = np.abs(self._own) ** 2
        doubt = 0.5 * (self._unsure * own_power).sum(axis=0)  # half of each frame is new
        weight = self._unsure / (doubt + self._noise + 1e-12)
        step = np.fft.irfft(weight * self._own.conj() * error, axis=1)
        step[:, BLOCK:] = 0.0
        self._way = _FORGET * (self._way + np.fft.rfft(step, axis=1))
        still = np.maximum(1.0 - 0.5 * weight * own_power, 0.0) * self._unsure
        self._unsure = _FORGET**2 * still + (1.0 - _FORGET**2) * np.abs(self._way) ** 2
