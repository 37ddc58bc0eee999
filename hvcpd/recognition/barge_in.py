"""Barge-in: the keyword while the robot itself speaks, by echo cancellation and a keyword spotter on the residual.

A Kalman filter in the frequency domain estimates the echo path from the loudspeaker through the room to the microphone.
It tracks each band's uncertainty together with the path itself. So another speaker at the same time slows the
adaptation down and does not mislead it (G. Enzner & P. Vary, "Frequency-domain adaptive Kalman filter for acoustic echo
control in hands-free telephones", Signal Processing 86(6), 2006; in partitions: F. Kuech et al., "State-space
architecture of the partitioned-block-based acoustic echo controller", ICASSP 2014). The residual still has the own
voice in it, about 20 dB fainter, and fainter than any person whom the robot must obey.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.recognition.arrays import quantile
from hvcpd.recognition.channel.whitening import moving_average
from hvcpd.recognition.events import Held, KeywordEvent, Released, Urgent
from hvcpd.recognition.frontend import HOP_SAMPLES, SILENT_POWER, power_ratio
from hvcpd.recognition.keyword.net import DELAY_FRAMES, WORD_FRAMES, Detection, KeywordNet, KeywordSpotter
from hvcpd.recognition.keyword.verification import ACCEPT_PROBABILITY, HOLD_TIME
from hvcpd.recognition.stream import FrameStream, History, cleaned

BLOCK = 2 * HOP_SAMPLES
"""Number of samples processed at a time: 20 ms."""
PARTITIONS = 7
"""Number of blocks over which the echo path is modelled: 140 ms, of which 40 are for a latency that is known to within
20 ms only, the rest for the room's early sound."""
_EARLY_PARTITIONS = 3
"""Number of first blocks, one of which has the direct sound: that in the middle, and one for DELAY_TOLERANCE_S either
way."""
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
        late = _LATE_POWER * _DECAY ** np.arange(PARTITIONS - _EARLY_PARTITIONS)
        prior = np.concatenate([np.ones(_EARLY_PARTITIONS), late])
        self._path = np.zeros((PARTITIONS, bands), np.complex128)
        self._variance: NDArray[np.float64] = np.repeat(prior[:, None], bands, axis=1)
        self._noise: NDArray[np.float64] | None = None
        self.pause()

    def pause(self) -> None:
        """Forget the played sound but keep the echo path: some time has passed unprocessed."""
        self._last: Samples = np.zeros(BLOCK, np.float32)
        self._own = np.zeros((PARTITIONS, BLOCK + 1), np.complex128)
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
        weight = self._variance / (doubt + self._noise + SILENT_POWER)
        step = np.fft.irfft(weight * self._own.conj() * error, axis=1)
        step[:, BLOCK:] = 0.0
        self._path = _FORGET * (self._path + np.fft.rfft(step, axis=1))
        still = np.maximum(1.0 - 0.5 * weight * own_power, 0.0) * self._variance
        self._variance = _FORGET**2 * still + (1.0 - _FORGET**2) * np.abs(self._path) ** 2


DELAY_TOLERANCE_S = BLOCK / SAMPLE_RATE_HZ
"""Largest deviation of the own voice's delay from the expected one, either way."""
LEAST_LEVEL_DB = -15.0
"""The least level of the word relative to the own voice's; the filter leaves -16 dB of it in its first sentence."""
LEVEL_QUANTILE = 0.75
"""Quantile of the frames' powers that counts as the level: that of the vowels."""
LEAST_CALL_PROBABILITY = 0.4
"""Least probability that counts: no later sound could confirm it, since the robot continues to speak. 12 of 12 calls
10 dB below the own voice have it; own talk, other robots, babble and knocks did not (`benchmarks/own_voice.py`)."""
WORD_MARGIN = samples_in(0.05)
"""Time before the word, and twice that after it, in which the own voice is looked for."""
MOST_LAG = samples_in(0.6)
"""Largest lag, either way, at which it is looked for: as late as a computer with six times its load was."""
OWN_CORRELATION = 0.15
"""Least correlation with what was played by which a word is the robot's own, or mixed with it: calls 10 and 14 dB below
the own voice have 0.13 at most (47), nine of ten own words that passed for the call after faults of the loudspeaker
0.18 to 0.89 (`benchmarks/own_voice.py`)."""
FAINT_SHARE = 1e-3
"""Least energy that counts, relative to the largest at any lag: next to nothing correlates with anything."""
SMOOTHED_REACH = 16
"""Neighbouring bins, either way, over which a sound's colour is averaged before half of it is taken out."""
MEMORY = samples_in(4.0)
"""Time for which the own voice counts: its level is that of so long, and for so long after a gap in what was
played the residual may have its words in it, or be judged by them: the net looks back 2.2 s, and relative to levels
that follow with 1 to 2 s."""
LINGER = (WORD_FRAMES + DELAY_FRAMES + 20) * HOP_SAMPLES
"""Time (0.77 s) after the own voice in which a word that began over it is detected: its length, the net's delay, and a
margin of 0.2 s. Then later sound can make it sure: 22 of 24 calls reach ACCEPT_PROBABILITY, knocks had 0.62 at most."""


class BargeInDetector:
    """Spots the keyword while the robot speaks, from `begin` until its own voice and a word over its end are gone.

    Push the played and the recorded sound, block by block. Where the loudspeaker left something out or was late, the
    residual has the robot's own words in it. So after `disturb` the word is believed only when it is said twice, and
    one that is correlated with what was played is never believed; both only hold the robot for a moment (`Held`).
    """

    def __init__(self, net: KeywordNet) -> None:
        self._net = net
        self._echo = EchoCanceller()
        self._latency_s = 0.0
        self._own_powers: deque[float] = deque(maxlen=MEMORY // HOP_SAMPLES)
        self._doubt_left = self._hold_left = 0
        self.begin(0, 0.0)
        self._listens = False

    def begin(self, now: int, latency_s: float) -> None:
        """The robot begins to speak at sample `now`; of the earlier state, only the echo path is kept.

        `latency_s`: the time between handing out a block and hearing it, within DELAY_TOLERANCE_S. The filter can
        follow only small changes of it and takes any larger change for another echo path.
        """
        if abs(latency_s - self._latency_s) > DELAY_TOLERANCE_S / 2:
            self._latency_s = latency_s
            self._echo.reset()
        self._began = now
        self._n_heard, self._own_until = 0, math.inf
        self._listens = True
        self._echo.pause()
        self._net.reset()
        self._spotter = KeywordSpotter(self._net)
        self._played, self._rest = History(MEMORY), History(MEMORY)
        self._residual_powers: deque[float] = deque(maxlen=WORD_FRAMES)
        self._reported_until, self._may_rise = 0, False
        delay = max(samples_in(self._latency_s - DELAY_TOLERANCE_S), 0)
        self._playing: Samples = np.zeros(delay, np.float32)
        self._heard, self._residual = FrameStream(), FrameStream()

    def lost(self) -> None:
        """Sound was lost: the played and the recorded sound are out of step, and may stay so."""
        self._echo.reset()
        self._net.reset()

    def disturb(self) -> None:
        """Some of what was pushed to `play` was not played, or not in time."""
        self._doubt_left = MEMORY

    def play(self, samples: Samples) -> None:
        """Push the sound that is played during the next block."""
        if self._listens:
            self._playing = np.concatenate([self._playing, samples])

    def hear(self, samples: Samples, speaking: bool) -> list[KeywordEvent]:
        """Push the next samples, shape (n,), float32, with or without the own voice; returns the word, if any."""
        self._follow(len(samples), speaking)
        released = self._released(len(samples))
        self._doubt_left = max(self._doubt_left - len(samples), 0)
        return released + self._found(cleaned(samples)) if self._listens else released

    def _follow(self, n: int, speaking: bool) -> None:
        """Listen on for a moment after the own voice, but not to a next sentence that it was not told to listen to."""
        if not speaking:
            self._own_until = min(self._own_until, self._n_heard)
        lingers = not speaking and self._n_heard < self._own_until + LINGER
        self._listens = self._listens and (self._own_until == math.inf or lingers)
        self._n_heard += n

    def _released(self, n: int) -> list[KeywordEvent]:
        if self._hold_left == 0:
            return []
        self._hold_left = max(self._hold_left - n, 0)
        return [Released(self._held.start_sample, self._held.end_sample)] if self._hold_left == 0 else []

    def _found(self, samples: Samples) -> list[KeywordEvent]:
        line = np.pad(self._playing, (0, max(len(samples) - len(self._playing), 0)))
        played, self._playing = line[: len(samples)], line[len(samples) :]
        found: list[KeywordEvent] = []
        for chunk in self._heard.push(samples, False):
            self._own_powers += chunk.energies.sum(axis=1, dtype=np.float64).tolist()
        residual = self._echo.take(played, samples)
        self._played.push(played, False)
        self._rest.push(residual, False)
        for chunk in self._residual.push(residual, False):
            self._residual_powers += chunk.energies.sum(axis=1, dtype=np.float64).tolist()
            word = self._spotter.push(chunk)
            if (
                word is not None
                and word.start < self._own_until
                and word.probability >= LEAST_CALL_PROBABILITY
                and _level(self._residual_powers) >= _level(self._own_powers) * power_ratio(LEAST_LEVEL_DB)
            ):
                found += self._reported(word)
        return found

    def _reported(self, word: Detection) -> list[KeywordEvent]:
        is_new = word.end >= self._reported_until
        is_unsure = self._own_until < math.inf and word.probability < ACCEPT_PROBABILITY
        if not is_new and (is_unsure or not self._may_rise):
            return []  # it is reported already
        self._reported_until, self._may_rise = word.end + WORD_FRAMES * HOP_SAMPLES, is_unsure
        is_second = is_new and self._hold_left > 0
        is_doubtful = is_unsure or (self._doubt_left > 0 and not is_second)
        start, end = self._began + word.start, self._began + word.end
        if is_doubtful or own_correlation(self._played, self._rest, word.start, word.end) >= OWN_CORRELATION:
            self._hold_left, self._held = HOLD_TIME, Held(start, end)
            return [self._held]
        self._hold_left = 0
        return [Urgent(start, end)]


def _level(powers: deque[float]) -> float:
    return quantile(np.array(powers), LEVEL_QUANTILE)


def own_correlation(played: History, residual: History, start: int, end: int) -> float:
    """The largest correlation, 0 to 1, of the residual from sample `start` to `end` with what was played, over all
    lags; both are whitened by half. Either may be late by some samples.

    At a gap the residual has what the filter took out too much, so that the correlation is negative.
    """
    begin = max(start - WORD_MARGIN, residual.begin)
    word, _ = residual.unmasked(begin, begin, end + 2 * WORD_MARGIN)
    around, before = played.unmasked(begin - MOST_LAG, begin, begin + len(word) + MOST_LAG)
    around = np.pad(around, (MOST_LAG - before, len(word) + MOST_LAG + before - len(around)))
    size = 1 << (len(around) + len(word)).bit_length()
    one, other = _whitened(word, size)[: len(word)], _whitened(around, size)
    products = np.fft.irfft(np.fft.rfft(other) * np.fft.rfft(one, size).conj())[: 2 * MOST_LAG + 1]
    powers = np.concatenate([np.zeros(1), np.cumsum(np.square(other[: len(around)]))])
    energies = powers[len(word) :] - powers[: -len(word)]
    scale = np.sqrt(np.maximum(energies, energies.max() * FAINT_SHARE) * np.square(one).sum())
    return float((np.abs(products) / np.maximum(scale, SILENT_POWER)).max())


def _whitened(sound: Samples, size: int) -> NDArray[np.float64]:
    """The sound with half of its colour (in dB) taken out, of `size` samples."""
    spectrum = np.fft.rfft(np.diff(sound, prepend=0.0), size)
    power = moving_average(np.square(np.abs(spectrum)), SMOOTHED_REACH)
    return np.fft.irfft(spectrum / np.maximum(power, SILENT_POWER) ** 0.25)
