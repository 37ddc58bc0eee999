"""Conversion of the sample rate by a windowed-sinc polyphase filter, in numpy alone.

Method: J. O. Smith, "Digital Audio Resampling" (CCRMA, Stanford University, 2002), with a Kaiser window (Oppenheim &
Schafer, "Discrete-Time Signal Processing", 3rd ed., section 7.6.3) and one filter for each phase of the ratio.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from hvcpd.ports import Samples

ZERO_CROSSINGS = 32
"""Zero crossings of the sinc to each side, counted at the lower of the two rates."""

KAISER_BETA = 7.857
"""80 dB of stop-band attenuation by Kaiser's formula 0.1102 (A - 8.7): below the noise of any microphone of ours."""

CUTOFF = 0.92
"""Middle of the transition band, as a share of the lower Nyquist frequency: with 64 zero crossings Kaiser's formula
gives a transition 0.156 wide, so that the stop band begins at that Nyquist frequency (7.4 kHz at -6 dB for 16 kHz)."""

PART = 4096
"""Inputs of a recording that are converted at once: the window of each output is copied, 3 MB at most."""


def resample(samples: Samples, from_hz: int, to_hz: int) -> Samples:
    """Sound of the rate `from_hz` at the rate `to_hz`; without delay, silence is assumed before and after.

    `samples` has the shape (n,), float32; the result (ceil(n * to_hz / from_hz),), float32. Raises ValueError for a
    rate that is not positive.
    """
    stream = StreamResampler(from_hz, to_hz)
    padded = np.concatenate([samples.astype(np.float32), np.zeros(math.ceil(stream.delay_s * from_hz), np.float32)])
    parts = [stream.push(padded[begin : begin + PART]) for begin in range(0, padded.size, PART)]
    return np.concatenate([np.zeros(0, np.float32), *parts])[: -(-samples.size * to_hz // from_hz)]


def _ratio(from_hz: int, to_hz: int) -> tuple[int, int]:
    """The numbers of outputs and of inputs after which the phases repeat."""
    if from_hz <= 0 or to_hz <= 0:
        raise ValueError(f"rates must be positive, not {from_hz} and {to_hz} Hz")
    divisor = math.gcd(from_hz, to_hz)
    return to_hz // divisor, from_hz // divisor


@lru_cache(maxsize=4)
def _filters(up: int, down: int) -> NDArray[np.float32]:
    """The interpolation filter of each phase, shape (up, 2 * reach): tap k weighs input floor(t) - reach + 1 + k."""
    scale = CUTOFF * min(1.0, up / down)
    reach = math.ceil(ZERO_CROSSINGS * max(1.0, down / up))
    offsets = np.arange(1 - reach, reach + 1)[None, :] - np.arange(up)[:, None] / up
    inside = np.maximum(0.0, 1.0 - (offsets / reach) ** 2)
    window = np.i0(KAISER_BETA * np.sqrt(inside)) / np.i0(KAISER_BETA)
    taps = scale * np.sinc(scale * offsets) * window
    # Each phase passes a constant unchanged.
    normalized: NDArray[np.float32] = (taps / taps.sum(axis=1, keepdims=True)).astype(np.float32)
    return normalized


class StreamResampler:
    """`resample` for a stream of blocks: the same samples whatever the block size, for hours.

    Every output is given as soon as its window is in, so that what comes out lies `delay_s` behind what goes in, and
    after n inputs there have been ceil((n - delay) * to_hz / from_hz) outputs, exactly. Raises ValueError for a rate
    that is not positive.
    """

    def __init__(self, from_hz: int, to_hz: int) -> None:
        self._up, self._down = _ratio(from_hz, to_hz)
        self._same = self._up == self._down
        self._bank = np.zeros((1, 0), np.float32) if self._same else _filters(self._up, self._down)
        self._reach = self._bank.shape[1] // 2
        self._kept = np.zeros(max(self._reach - 1, 0), np.float32)
        self._phase = 0
        self.delay_s: float = self._reach / from_hz

    def push(self, samples: Samples) -> Samples:
        """The outputs that `samples`, shape (n,), float32, complete; shape (m,), float32."""
        if self._same:
            return samples
        inputs = np.concatenate([self._kept, samples])
        # The window of output m begins (phase + m * down) // up inputs after the first that is kept.
        room = inputs.size - 2 * self._reach + 1
        count = max(0, -(-(room * self._up - self._phase) // self._down))
        if count == 0:
            self._kept = inputs
            return np.zeros(0, np.float32)
        steps = self._phase + np.arange(count) * self._down
        windows = sliding_window_view(inputs, 2 * self._reach)[steps // self._up]
        result: Samples = np.einsum("ij,ij->i", windows, self._bank[steps % self._up])
        begin, self._phase = divmod(self._phase + count * self._down, self._up)
        self._kept = inputs[begin:]
        return result
