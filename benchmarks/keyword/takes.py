"""Takes to train the keyword's net with, in batches: the net's inputs, and the targets of each chunk."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, WINDOW_SAMPLES
from hvcpd.recognition.keyword.net import Levels
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
    def load(cls, paths: Sequence[Path]) -> Data:
        files = [np.load(path) for path in paths]
        logs, ends, inside = (np.concatenate([file[key] for file in files]) for key in ("logs", "ends", "inside"))
        n_chunks = logs.shape[1] // CHUNK_FRAMES
        known = (np.arange(1, n_chunks + 1) * CHUNK_FRAMES - 1) * HOP_SAMPLES + WINDOW_SAMPLES
        late_s = (known[None, None] - ends[:, :, None] * HOP_SAMPLES) / SAMPLE_RATE_HZ
        labels = np.full((len(ends), len(TOLD_S), *late_s.shape[1:]), NOTHING, np.int8)
        for curve, (told_s, spared_s) in enumerate(zip(TOLD_S, SPARED_S, strict=True)):
            labels[:, curve][(late_s >= spared_s[0]) & (late_s < spared_s[1])] = SPARED
            labels[:, curve][(late_s >= told_s[0]) & (late_s < told_s[1])] = TOLD
        labels[np.broadcast_to((ends < 0)[:, None, :, None], labels.shape)] = NOTHING
        labels[inside, 0] = SPARED
        return cls(logs, labels, inside)

    def batches(
        self, rng: np.random.Generator | None, takes: NDArray[np.int64] | None = None
    ) -> Iterator[tuple[NDArray[np.int64], Tensor, Tensor]]:
        """All takes, or those, with their numbers; with `rng`, in any order, some after something louder, and with
        parts left out."""
        order = takes if takes is not None else np.arange(len(self.logs))
        order = rng.permutation(order) if rng is not None else order
        for at in range(0, len(order), BATCH):
            some = np.sort(order[at : at + BATCH])
            energies = np.exp(self.logs[some].astype(np.float32))
            if rng is not None:
                energies = self._varied(energies, rng)
            sound = inputs(energies, rng)
            if rng is not None:
                _leave_out(sound, rng)
            yield some, torch.from_numpy(sound.transpose(0, 2, 1).copy()), torch.from_numpy(self.labels[some])

    @cached_property
    def _without(self) -> NDArray[np.int64]:
        return np.flatnonzero((self.labels == NOTHING).all(axis=(1, 2, 3)))

    def _varied(self, energies: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
        """Other heads, other microphones, and something else fainter in the background."""
        n = len(energies)
        bands = np.arange(N_BANDS) + np.clip(rng.normal(0.0, 0.7, (n, 1)), -2.0, 2.0)
        below = np.clip(np.floor(bands), 0, N_BANDS - 2).astype(int)
        share = np.clip(bands - below, 0.0, 1.0)[:, None].astype(np.float32)
        rows = np.arange(n)[:, None]
        turned = energies.transpose(0, 2, 1)
        moved = (
            turned[rows, below].transpose(0, 2, 1) * (1 - share) + turned[rows, below + 1].transpose(0, 2, 1) * share
        )
        corners = np.cumsum(rng.normal(0.0, 0.4, (n, 6)), axis=1)
        at = np.linspace(0.0, 5.0, N_BANDS)
        moved *= np.exp(np.stack([np.interp(at, np.arange(6), row) for row in corners]))[:, None].astype(np.float32)
        others = rng.choice(self._without, size=n)
        other = np.exp(self.logs[others].astype(np.float32))
        ratio = moved[: len(other)].mean(axis=(1, 2)) / other.mean(axis=(1, 2))
        gains = ratio * 10.0 ** (-rng.uniform(0.1, 2.5, len(other))) * (rng.random(len(other)) < 0.5)
        moved[: len(other)] += gains[:, None, None].astype(np.float32) * other
        return np.asarray(moved, np.float32)


def inputs(energies: NDArray[np.float32], rng: np.random.Generator | None) -> NDArray[np.float32]:
    """The net's inputs for takes, shape (takes, frames, N_INPUTS)."""
    levels, found = Levels(), []
    for at in range(0, energies.shape[1], CHUNK_FRAMES):
        found.append(levels.take(energies[:, at : at + CHUNK_FRAMES]))
        if at == 0 and rng is not None:
            some = rng.random((len(energies), 1)) < DISTURBED
            levels.scale(np.exp(some * rng.uniform(*DISTURBANCE, (len(energies), 1))).astype(np.float32))
    return np.concatenate(found, axis=1)


def _leave_out(sound: NDArray[np.float32], rng: np.random.Generator) -> None:
    for row in sound:
        if rng.random() < 0.4:
            band, n = int(rng.integers(N_BANDS)), int(rng.integers(1, 5))
            row[:, band : min(band + n, N_BANDS)] = 0.0
            row[:, N_BANDS + band : N_BANDS + min(band + n, N_BANDS)] = 0.0
