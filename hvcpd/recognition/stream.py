"""Cuts a stream of blocks of any size into chunks of frames that always begin at the same samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.frontend import HOP_SAMPLES, WINDOW_SAMPLES, Energies, energies_of

CHUNK_FRAMES = 4
"""40 ms: fewer and longer vector operations, at a delay that listen-before-talk can bear."""
CHUNK_SAMPLES = CHUNK_FRAMES * HOP_SAMPLES
_NEEDED_SAMPLES = CHUNK_SAMPLES - HOP_SAMPLES + WINDOW_SAMPLES
_DRAIN_CHUNKS = 2
"""So many chunks hold more samples than the stream ever keeps."""
_SLICE_SAMPLES = 16_000
"""A long block is worked through in slices of 1 s, which bounds memory."""


@dataclass(frozen=True)
class Chunk:
    """Energies of consecutive frames, shape (n, N_BANDS), from `first_frame` on; `masked` if any sample was."""

    first_frame: int
    energies: Energies
    masked: bool


def cleaned(samples: Samples) -> Samples:
    """As float32, without NaN, infinities and values beyond full scale."""
    flat = np.asarray(samples, np.float32).reshape(-1)
    if np.abs(flat).max(initial=0.0) <= 1.0:  # never so with a NaN
        return flat
    return np.clip(np.nan_to_num(flat, nan=0.0, posinf=1.0, neginf=-1.0), -1.0, 1.0)


class FrameStream:
    """Keeps the samples that no whole chunk has used yet."""

    def __init__(self) -> None:
        self._samples = np.zeros(0, np.float32)
        self._masked = np.zeros(0, np.bool_)
        self.next_frame = 0
        """The first frame of the chunk to come."""

    def push(self, samples: Samples, masked: bool) -> Iterator[Chunk]:
        """Yield the chunks that `samples` complete. Iterate to the end, or samples are lost."""
        for begin in range(0, len(samples), _SLICE_SAMPLES):
            part = cleaned(samples[begin : begin + _SLICE_SAMPLES])
            self._samples = np.concatenate([self._samples, part])
            self._masked = np.concatenate([self._masked, np.full(len(part), masked)])
            yield from self._chunks()

    def lose(self, n_samples: int) -> Iterator[Chunk]:
        """Let time go on by samples that nobody heard, as `push` of masked silence, in bounded time and memory."""
        whole = max(n_samples // CHUNK_SAMPLES - _DRAIN_CHUNKS, 0)
        yield from self.push(np.zeros(min(n_samples, _DRAIN_CHUNKS * CHUNK_SAMPLES), np.float32), masked=True)
        self.next_frame += whole * CHUNK_FRAMES  # what the stream still keeps is masked silence, here as there
        remaining = n_samples - (whole + _DRAIN_CHUNKS) * CHUNK_SAMPLES
        yield from self.push(np.zeros(max(remaining, 0), np.float32), masked=True)

    def _chunks(self) -> Iterator[Chunk]:
        used = 0
        while len(self._samples) - used >= _NEEDED_SAMPLES:
            window = slice(used, used + _NEEDED_SAMPLES)
            hidden = bool(self._masked[window].any())
            energies = energies_of(self._samples[window])
            first = self.next_frame
            self.next_frame += CHUNK_FRAMES
            used += CHUNK_SAMPLES
            yield Chunk(first, energies, hidden)
        self._samples = self._samples[used:]
        self._masked = self._masked[used:]

    def rest(self) -> Chunk:
        """The whole frames of the incomplete chunk, fewer than CHUNK_FRAMES; they stay in the stream."""
        return Chunk(self.next_frame, energies_of(self._samples), bool(self._masked.any()))
