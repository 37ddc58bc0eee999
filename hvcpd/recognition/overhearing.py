"""Listening while the robot itself speaks: echo cancellation, the keyword in what is left, and the own voice's delay.

A Kalman filter in the frequency domain estimates the echo path from the loudspeaker through the room to the microphone.
It tracks each band's uncertainty together with the path itself. So another speaker at the same time slows the
adaptation down and does not mislead it (G. Enzner & P. Vary, "Frequency-domain adaptive Kalman filter for acoustic echo
control in hands-free telephones", Signal Processing 86(6), 2006; in partitions: F. Kuech et al., "State-space
architecture of the partitioned-block-based acoustic echo controller", ICASSP 2014). The residual still has the own
voice in it, about 20 dB fainter, and fainter than any person whom the robot must obey.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Urgent
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, Energies, power_ratio
from hvcpd.recognition.keyword.net import LENGTH_FRAMES, KeywordNet, KeywordSpotter, Word
from hvcpd.recognition.stream import FrameStream

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
        self._path = np.zeros((PARTS, bands), np.complex128)
        self._variance: NDArray[np.float64] = np.repeat(prior[:, None], bands, axis=1)
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
        rest: NDArray[np.float64] = heard - np.fft.irfft((self._own * self._path).sum(axis=0))[BLOCK:]
        self._learn(rest)
        return np.asarray(rest, np.float32)

    def _learn(self, rest: NDArray[np.float64]) -> None:
        error = np.fft.rfft(np.concatenate([np.zeros(BLOCK), rest]))
        power = np.abs(error) ** 2
        self._noise = power if self._noise is None else _SMOOTH * self._noise + (1.0 - _SMOOTH) * power
        own_power = np.abs(self._own) ** 2
        doubt = 0.5 * (self._variance * own_power).sum(axis=0)  # half of each frame is new
        weight = self._variance / (doubt + self._noise + 1e-12)
        step = np.fft.irfft(weight * self._own.conj() * error, axis=1)
        step[:, BLOCK:] = 0.0
        self._path = _FORGET * (self._path + np.fft.rfft(step, axis=1))
        still = np.maximum(1.0 - 0.5 * weight * own_power, 0.0) * self._variance
        self._variance = _FORGET**2 * still + (1.0 - _FORGET**2) * np.abs(self._path) ** 2


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
    """Spots the keyword while the robot speaks, from `begin` until its own voice is gone.

    Push the played and the recorded sound, block by block.
    """

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
        self._reported_until = 0
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
            if (
                word is not None
                and word.probability >= CERTAIN
                and np.quantile(self._left_powers, LEVEL_QUANTILE) >= least
            ):
                found += self._reported(word)
        return found

    def _least_level(self, samples: Samples) -> float:
        """Level of the word relative to the own voice."""
        for chunk in self._heard.push(samples, False):
            self._own_powers = _recent(self._own_powers, chunk.energies, RECENT_FRAMES)
        if not len(self._own_powers):
            return 0.0
        return float(np.quantile(self._own_powers, LEVEL_QUANTILE) * power_ratio(FAINTEST_DB))

    def _reported(self, word: Word) -> list[Urgent]:
        if word.end_frame < self._reported_until:
            return []  # it is reported already
        self._reported_until = word.end_frame + LENGTH_FRAMES
        start, end = (self._began + frame * HOP_SAMPLES for frame in (word.start_frame, word.end_frame))
        return [Urgent(start, end)]


def _recent(powers: NDArray[np.float64], energies: Energies, most: int) -> NDArray[np.float64]:
    """The powers of the last frames, including these."""
    return np.concatenate([powers, energies.sum(axis=1, dtype=np.float64)])[-most:]


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
    """Measures the delay after which the robot's own sentence returns to its microphone: the nominal one is not enough.

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


def peak_offset(values: NDArray[np.float64], peak: int) -> float:
    """Offset of the vertex of the parabola through a peak and its neighbours; 0 at the ends."""
    if not 0 < peak < len(values) - 1:
        return 0.0
    before, at, after = values[peak - 1 : peak + 2]
    bend = before - 2.0 * at + after
    return float(0.5 * (before - after) / bend) if bend < 0.0 else 0.0
