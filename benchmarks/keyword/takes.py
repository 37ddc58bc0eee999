"""The keyword's net's inputs and targets, of takes to train and to score with, in batches."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from benchmarks.keyword.clips import Clip
from benchmarks.keyword.mixing import EnergyMixer
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, WINDOW_SAMPLES
from hvcpd.recognition.keyword.net import InputNormaliser
from hvcpd.recognition.stream import CHUNK_FRAMES

TOLD_S = ((0.02, 0.22), (0.1, 0.75))
"""Time after the word's end in which each curve should detect it."""
SPARED_S = ((-0.16, 0.6), (-0.16, 1.1))
"""Time in which it may or may not detect it."""
BATCH = 64
DISTURBED = 0.3
"""Share of takes before which it was louder or quieter."""
DISTURBANCE = (-1.0, 4.0)
"""Range of that change, neper of power."""
TOLD, NOTHING, SPARED = 1, 0, 2


@dataclass(frozen=True, eq=False)
class Data:
    """`logs`: shape (takes, frames, N_BANDS); `labels`: shape (takes, curves, words, chunks), how each chunk stands to
    each word."""

    logs: NDArray[np.float16]
    labels: NDArray[np.int8]
    inside: NDArray[np.bool_]

    @classmethod
    def drawn(cls, clips: Sequence[Clip], data: Path | None, part: str, batches: int, seed: int) -> Data:
        """Takes of that part to score with, BATCH in each batch."""
        mixer = EnergyMixer(clips, data, part, seed)
        takes = [mixer.draw(BATCH) for _ in range(batches)]
        logs = np.log(np.concatenate([each.energies for each in takes])).astype(np.float16)
        ends, inside = (np.concatenate([getattr(each, key) for each in takes]) for key in ("ends", "inside"))
        return cls(logs, labels_of(ends, inside, logs.shape[1] // CHUNK_FRAMES), inside)

    def batches(self, takes: NDArray[np.int64]) -> Iterator[tuple[Tensor, Tensor]]:
        """Inputs and labels of those takes, in this order."""
        for at in range(0, len(takes), BATCH):
            some = takes[at : at + BATCH]
            sound = inputs(np.exp(self.logs[some].astype(np.float32)), None)
            yield torch.from_numpy(sound.transpose(0, 2, 1).copy()), torch.from_numpy(self.labels[some])


def labels_of(ends: NDArray[np.int64], inside: NDArray[np.bool_], n_chunks: int) -> NDArray[np.int8]:
    """How each chunk stands to each word that ends at these frames, shape (takes, words), or nowhere (NONE); shape
    (takes, curves, words, chunks)."""
    known = (np.arange(1, n_chunks + 1) * CHUNK_FRAMES - 1) * HOP_SAMPLES + WINDOW_SAMPLES
    late_s = (known[None, None] - ends[:, :, None] * HOP_SAMPLES) / SAMPLE_RATE_HZ
    labels = np.full((len(ends), len(TOLD_S), *late_s.shape[1:]), NOTHING, np.int8)
    for curve, (told_s, spared_s) in enumerate(zip(TOLD_S, SPARED_S, strict=True)):
        labels[:, curve][(late_s >= spared_s[0]) & (late_s < spared_s[1])] = SPARED
        labels[:, curve][(late_s >= told_s[0]) & (late_s < told_s[1])] = TOLD
    labels[np.broadcast_to((ends < 0)[:, None, :, None], labels.shape)] = NOTHING
    labels[inside, 0] = SPARED
    return labels


def inputs(energies: NDArray[np.float32], rng: np.random.Generator | None) -> NDArray[np.float32]:
    """The net's inputs for takes, shape (takes, frames, N_INPUTS)."""
    levels, found = InputNormaliser(), []
    for at in range(0, energies.shape[1], CHUNK_FRAMES):
        found.append(levels.normalised(energies[:, at : at + CHUNK_FRAMES]))
        if at == 0 and rng is not None:
            some = rng.random((len(energies), 1)) < DISTURBED
            louder = np.exp(some * rng.uniform(*DISTURBANCE, (len(energies), 1))).astype(np.float32)
            assert levels.level is not None
            levels.level, levels.colour = levels.level * louder, levels.colour * louder
    return np.concatenate(found, axis=1)


def leave_out(sound: NDArray[np.float32], rng: np.random.Generator) -> None:
    """Mask a few neighbouring bands of some takes (D. Park et al., "SpecAugment", Interspeech 2019)."""
    for row in sound:
        if rng.random() < 0.4:
            band, n = int(rng.integers(N_BANDS)), int(rng.integers(1, 5))
            row[:, band : min(band + n, N_BANDS)] = 0.0
            row[:, N_BANDS + band : N_BANDS + min(band + n, N_BANDS)] = 0.0
