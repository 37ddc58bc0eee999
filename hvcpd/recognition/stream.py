"""Cuts a stream of blocks of any size into chunks of frames that always begin at the same samples; keeps the last
seconds of it."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import Samples
from hvcpd.recognition.frontend import HOP_SAMPLES, WINDOW_SAMPLES, Energies, energies_of

CHUNK_FRAMES = 4
"""40 ms: fewer and longer vector operations, at a delay that listen-before-talk can bear."""
CHUNK_SAMPLES = CHUNK_FRAMES * HOP_SAMPLES
_NEEDED_SAMPLES = CHUNK_SAMPLES - HOP_SAMPLES + WINDOW_SAMPLES
_DRAIN_CHUNKS = 2
"""Number of chunks that hold more samples than the stream ever keeps."""
_SLICE_SAMPLES = 16_000
"""A long block is processed in slices of 1 s, which bounds memory."""


@dataclass(frozen=True)
class Chunk:
    """Energies of consecutive frames, shape (n, N_BANDS), from `first_frame` on; `masked` if any sample was.

    `samples`, shape (n * HOP_SAMPLES,), are those from the beginning of the first frame to that of the next chunk's.
    """

    first_frame: int
    energies: Energies
    masked: bool
    samples: Samples


def cleaned(samples: Samples) -> Samples:
    """Convert to float32, without NaN, infinities and values beyond full scale."""
    flat = np.asarray(samples, np.float32).reshape(-1)
    if np.abs(flat).max(initial=0.0) <= 1.0:  # never so with a NaN
        return flat
    return np.clip(np.nan_to_num(flat, nan=0.0, posinf=1.0, neginf=-1.0), -1.0, 1.0)


Kept = NDArray[np.int16]
"""Sound, shape (n,), to be remembered for some seconds, in the steps of a 16-bit converter: half the memory."""
STEPS = np.float32(32_768.0)


def kept(samples: Samples) -> Kept:
    """Return `cleaned` sound in steps; nothing is lost of what such a converter gave at our rate."""
    return np.asarray(np.minimum(np.rint(samples * STEPS), STEPS - 1), np.int16)


def joined(blocks: Iterable[Kept]) -> Samples:
    """Return the sound of these blocks, one after the other, shape (n,), float32."""
    return np.concatenate([np.zeros(0, np.int16), *blocks]).astype(np.float32) / STEPS


class FrameStream:
    """Keeps the samples that no whole chunk has used yet."""

    def __init__(self) -> None:
        self._sound: Samples = np.zeros(0, np.float32)
        self._masked = np.zeros(0, np.bool_)
        """Which of these samples are."""
        self.next_frame = 0
        """The first frame of the chunk to come."""

    def push(self, samples: Samples, masked: bool) -> Iterator[Chunk]:
        """Yield the chunks that `samples` complete. Iterate to the end, or samples are lost."""
        for begin in range(0, len(samples), _SLICE_SAMPLES):
            part = cleaned(samples[begin : begin + _SLICE_SAMPLES])
            self._sound = np.concatenate([self._sound, part])
            self._masked = np.concatenate([self._masked, np.full(len(part), masked)])
            while len(self._sound) >= _NEEDED_SAMPLES:
                yield self._chunk()

    def lose(self, n_samples: int) -> Iterator[Chunk]:
        """Advance time by lost samples, as `push` of masked silence, in bounded time and memory."""
        whole = max(n_samples // CHUNK_SAMPLES - _DRAIN_CHUNKS, 0)
        yield from self.push(np.zeros(n_samples - whole * CHUNK_SAMPLES, np.float32), masked=True)
        self.next_frame += whole * CHUNK_FRAMES  # what is left in the stream is masked silence in both cases

    def _chunk(self) -> Chunk:
        first_frame, used = self.next_frame, slice(_NEEDED_SAMPLES)
        new = self._sound[:CHUNK_SAMPLES].copy()  # who keeps it does not keep the rest
        chunk = Chunk(first_frame, energies_of(self._sound[used]), bool(self._masked[used].any()), new)
        self._sound, self._masked = self._sound[CHUNK_SAMPLES:], self._masked[CHUNK_SAMPLES:]
        self.next_frame += CHUNK_FRAMES
        return chunk

    def rest(self) -> Chunk:
        """The whole frames of the incomplete chunk, fewer than CHUNK_FRAMES; they stay in the stream."""
        energies = energies_of(self._sound)
        samples = self._sound[: len(energies) * HOP_SAMPLES]
        return Chunk(self.next_frame, energies, bool(self._masked.any()), samples)


class History:
    """The last seconds of the microphone signal without the robot's own speech, in blocks; positions in samples since
    the beginning."""

    def __init__(self, n: int) -> None:
        """Keep at least the last `n` samples."""
        self._most = n
        self._blocks: deque[tuple[int, Kept]] = deque()
        self._kept = 0

    def keep(self, n: int) -> None:
        """Keep at least the last `n` samples from now on."""
        self._most = max(self._most, n)

    def push(self, at: int, block: Samples) -> None:
        """Append a `cleaned` block, shape (m,), that begins at sample `at`, after all others."""
        self._blocks.append((at, kept(block)))
        self._kept += len(block)
        while self._kept - len(self._blocks[0][1]) > self._most:
            self._kept -= len(self._blocks.popleft()[1])

    def around(self, begin: int, middle: int, end: int) -> tuple[Samples, int]:
        """Return the kept sound from sample `begin` up to `end`, in whole blocks; and the number of its samples before
        `middle`."""
        parts = [(at, block) for at, block in self._blocks if at + len(block) > begin and at < end]
        return joined(block for _, block in parts), sum(min(len(block), max(middle - at, 0)) for at, block in parts)
