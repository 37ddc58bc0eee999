"""The keyword net and spotter: from mel energies to the posteriors, every 40 ms, that somebody has just said the
keyword, and that it was a call; and the detections in these two curves.

Convolutions in time that look back only (A. Waibel et al., "Phoneme recognition using time-delay neural networks", IEEE
Trans. ASSP 37(3), 1989), with growing dilation and residual paths as in WaveNet (A. van den Oord et al., 2016). Its
inputs are the logarithms of the energies, relative to the level of the last second or two, of all bands together and
of each: so that neither distance nor a microphone's colour counts (as per-channel energy normalisation does: Y. Wang et
al., "Trainable frontend for robust and far-field keyword spotting", ICASSP 2017). It has learned mixtures of the word
and other talk as they are (`benchmarks/keyword`), so that nothing has to be separated.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hvcpd.errors import reading_own
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.frontend import ENERGY_FLOOR, HOP_SAMPLES, N_BANDS, Energies
from hvcpd.recognition.stream import CHUNK_FRAMES, Chunk

WEIGHTS = Path(__file__).with_name("stop.npz")
Array = NDArray[np.float32]

LEVEL_WEIGHT, COLOUR_WEIGHT = (1 - np.float32(np.exp(-CHUNK_FRAMES * HOP_SAMPLES / SAMPLE_RATE_HZ / s)) for s in (1, 2))
"""Weight of a chunk in the mean level of all bands together, with a time constant of 1 s, and in each band's own mean
level, with one of 2 s: a few syllables."""
MAX_NEPER = 6.0
"""Largest difference that carries information (52 dB)."""
INPUT_SCALE = np.float32(1.0 / 3.0)
N_INPUTS = 2 * N_BANDS
KERNEL_SIZES = (8, 4)
"""Kernel sizes of the first two layers, in frames of 10 and of 20 ms; each halves the rate."""
KERNEL_SIZE = 3
"""Kernel size of all further layers."""
DILATIONS = (1, 2, 4, 8, 4, 8)
"""Dilations of the further layers, in columns of 40 ms: 2.2 s in all."""


class Posteriors(NamedTuple):
    """The net's outputs, each 0 to 1: one for standing still at once, one for the decision after the next words."""

    word: float
    """Probability that the keyword ended within the last 0.2 s."""
    call: float
    """Probability that it ended within the last 0.75 s, and was no part of a sentence."""


class InputNormaliser:
    """Converts energies to the net's inputs, a chunk at a time, for one stream or for many at once."""

    def __init__(self) -> None:
        self.level: Array | None = None
        self.colour: Array = np.zeros(0, np.float32)

    def normalised(self, energies: Energies) -> Array:
        """Energies of CHUNK_FRAMES frames, shape (..., CHUNK_FRAMES, N_BANDS), to (..., CHUNK_FRAMES, N_INPUTS)."""
        means = energies.sum(axis=-2) / np.float32(energies.shape[-2])
        total = means.sum(axis=-1, keepdims=True) / np.float32(N_BANDS)
        if self.level is None:
            self.level, self.colour = total, means
        self.level = self.level + LEVEL_WEIGHT * (total - self.level)
        self.colour = self.colour + COLOUR_WEIGHT * (means - self.colour)
        logs = np.log(np.maximum(energies, ENERGY_FLOOR))
        level, colour = np.log(self.level)[..., None, :], np.log(self.colour)[..., None, :]
        both = np.concatenate([logs - level, logs - colour], axis=-1)
        return np.asarray(np.clip(both, -MAX_NEPER, MAX_NEPER) * INPUT_SCALE, np.float32)


@dataclass(frozen=True, eq=False)
class Weights:
    """`layers`: for each a matrix, shape (inputs, outputs), inputs from the oldest frame to the newest, and offsets;
    `out`: the last layer, likewise; `slopes` and `intercepts`, shape (2,), calibrate its outputs to log odds."""

    layers: tuple[tuple[Array, Array], ...]
    out: tuple[Array, Array]
    slopes: Array
    intercepts: Array

    @classmethod
    @lru_cache(1)
    def load(cls, path: Path = WEIGHTS) -> Weights:
        """Read the weights that `benchmarks.keyword.train` wrote: bytes, with a scale for each output. Raises
        ConfigError where they are missing or damaged."""
        with reading_own(path), np.load(path) as file:
            pairs = [_layer(file, n) for n in range(len(KERNEL_SIZES) + len(DILATIONS) + 1)]
            return cls(tuple(pairs[:-1]), pairs[-1], file["slopes"], file["intercepts"])


def _layer(file: Mapping[str, NDArray[np.generic]], number: int) -> tuple[Array, Array]:
    matrix = file[f"weights{number}"].astype(np.float32) * file[f"scale{number}"].astype(np.float32)
    return np.asarray(matrix, np.float32), np.asarray(file[f"offsets{number}"], np.float32)


class KeywordNet:
    """The net over one stream; several may share `Weights`."""

    def __init__(self, weights: Weights) -> None:
        self._weights = weights
        self.reset()

    def reset(self) -> None:
        """Forget the earlier sound."""
        self._inputs = InputNormaliser()
        widths = [matrix.shape[1] for matrix, _ in self._weights.layers]
        self._frames = np.zeros((KERNEL_SIZES[0] - 2, N_INPUTS), np.float32)
        self._halves = np.zeros((KERNEL_SIZES[1] - 2, widths[0]), np.float32)
        rows = [(KERNEL_SIZE - 1) * gap for gap in DILATIONS]
        self._pasts = [np.zeros((n, w), np.float32) for n, w in zip(rows, widths[1:], strict=False)]
        self._turn = 0

    def posteriors(self, energies: Energies) -> Posteriors:
        """The posteriors after the next CHUNK_FRAMES frames, shape (CHUNK_FRAMES, N_BANDS)."""
        (first, first_off), (second, second_off), *others = self._weights.layers
        self._frames = np.concatenate([self._frames[-(KERNEL_SIZES[0] - 2) :], self._inputs.normalised(energies)])
        pieces = np.stack([self._frames[k : k + KERNEL_SIZES[0]].ravel() for k in (0, 2)])
        halves = np.maximum(pieces @ first + first_off, 0)
        self._halves = np.concatenate([self._halves[-(KERNEL_SIZES[1] - 2) :], halves])
        found = np.maximum(self._halves.ravel() @ second + second_off, 0)
        for (matrix, offsets), past, gap in zip(others, self._pasts, DILATIONS, strict=True):
            # A ring: the row about to be overwritten is the oldest, the row `gap` further on is the next input.
            at = self._turn % len(past)
            seen = np.concatenate([past[at], past[(at + gap) % len(past)], found])
            past[at] = found
            found = found + np.maximum(seen @ matrix + offsets, 0)
        self._turn += 1
        matrix, offsets = self._weights.out
        logits = self._weights.slopes * (found @ matrix + offsets) + self._weights.intercepts
        word, call = 0.5 + 0.5 * np.tanh(0.5 * logits)  # the logistic function
        return Posteriors(float(word), float(call))


HOLD_PROBABILITY = 0.3
"""Probability of the keyword from which on the robot stands still. Of calls as loud as other talk, synthesizers' and
robots' have it in 93 to 97 %, people's in 73 %; of people's other words, 4 % (`benchmarks.keyword.curve --part
validate`)."""
SMOOTHING_COLUMNS = 4
"""The second highest of so many posteriors (160 ms) counts: the keyword shows for longer than a false alarm. With the
highest, and a threshold that as many of people's calls reach, there are half as many false alarms again in their talk,
and twice as many certain ones."""
WORD_FRAMES = 45
"""Usual length of the keyword (0.45 s)."""
DELAY_FRAMES = 12
"""Usual delay of a detection after the keyword's end (120 ms)."""
REFRACTORY_FRAMES = 60
"""Outputs within 0.6 s belong to one detection: nobody repeats the keyword faster."""
DECISION_FRAMES = 80
"""Longest time (0.8 s) from a detection until the net has decided whether it was a call."""


class Detection(NamedTuple):
    """Approximate position of the keyword, samples, and its highest posteriors so far."""

    start: int
    end: int
    probability: float
    call: float


def second_highest(probabilities: Iterable[float]) -> float:
    """The posterior that counts, of the last SMOOTHING_COLUMNS ones."""
    return sorted(probabilities)[-2]


def peak_of(probabilities: Sequence[float]) -> float | None:
    """The highest posterior that counts, of any number; None if there are too few."""
    windows = (probabilities[k : k + SMOOTHING_COLUMNS] for k in range(len(probabilities) - SMOOTHING_COLUMNS + 1))
    return max(map(second_highest, windows), default=None)


class KeywordSpotter:
    """Keyword spotter: derives detections from the net's posteriors over one stream. Each is reported as soon as it is
    possible, and again while its probability rises."""

    def __init__(self, net: KeywordNet) -> None:
        self._net = net
        self._probabilities = deque([Posteriors(0.0, 0.0)] * SMOOTHING_COLUMNS, SMOOTHING_COLUMNS)
        self._detection: Detection | None = None
        self._since = 0

    def push(self, chunk: Chunk) -> Detection | None:
        """The detection, if the next chunk makes it possible or more likely than before."""
        if len(chunk.energies) != CHUNK_FRAMES:
            return None
        self._probabilities.append(self._net.posteriors(chunk.energies))
        probability, call = map(second_highest, zip(*self._probabilities, strict=True))
        now = chunk.first_frame + CHUNK_FRAMES
        since = now - self._since
        if probability >= HOLD_PROBABILITY and (self._detection is None or since >= REFRACTORY_FRAMES):
            self._since, end = now, now - DELAY_FRAMES
            start = max(end - WORD_FRAMES, 0)
            self._detection = Detection(start * HOP_SAMPLES, end * HOP_SAMPLES, probability, call)
            return self._detection
        if self._detection is None or since >= DECISION_FRAMES:
            return None
        before = self._detection
        self._detection = before._replace(probability=max(before.probability, probability), call=max(before.call, call))
        return self._detection if self._detection != before else None
