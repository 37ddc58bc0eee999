"""Framing: cuts a stream of blocks of any size into chunks of frames that always begin at the same samples; and the
ring buffers of the last seconds: of the sound, which all stages share, and of a number for each frame."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import Samples, samples_in
from hvcpd.recognition.frontend import HOP_SAMPLES, WINDOW_SAMPLES, Energies, energies_of
from hvcpd.recognition.noise import MEMORY_FRAMES

CHUNK_FRAMES = 4
"""Number of frames (40 ms) that are processed at once: fewer and longer vector operations, at a delay that
listen-before-talk can bear."""
CHUNK_SAMPLES = CHUNK_FRAMES * HOP_SAMPLES
_NEEDED_SAMPLES = CHUNK_SAMPLES - HOP_SAMPLES + WINDOW_SAMPLES


@dataclass(frozen=True)
class Chunk:
    """Energies of consecutive frames, shape (n, N_BANDS), from `first_frame` on; `masked` if any sample was."""

    first_frame: int
    energies: Energies
    masked: bool


def cleaned(samples: Samples) -> Samples:
    """Convert to float32, without NaN, infinities and values beyond full scale."""
    flat = np.asarray(samples, np.float32).reshape(-1)
    if np.abs(flat).max(initial=0.0) <= 1.0:  # never so with a NaN
        return flat
    return np.clip(np.nan_to_num(flat, nan=0.0, posinf=1.0, neginf=-1.0), -1.0, 1.0)


Int16Samples = NDArray[np.int16]
"""Sound as 16-bit integers, shape (n,): half the memory of float32."""
INT16_SCALE = np.float32(32_768.0)
LONGEST_SENTENCE = samples_in(10.0)
"""No sentence of the phrasebook takes longer. Other talk does, and is searched piece by piece."""
MAX_WAIT = samples_in(3.0)
"""Longest time from the end of speech to the result of its search. After that it counts as if nothing had
been found: a robot that has not answered by then is asked again anyway."""
NOISE_LEAD = MEMORY_FRAMES * HOP_SAMPLES
"""Samples before speech, for its noise: the noise tracker's memory."""
HISTORY_SAMPLES = NOISE_LEAD + 2 * (LONGEST_SENTENCE + MAX_WAIT)
"""Length of the history (0.9 MB). `ChannelStage` looks back farthest: to two of the longest sentences, after their
searches."""


def to_int16(samples: Samples) -> Int16Samples:
    """Quantise `cleaned` sound to 16 bits, which is lossless for the sound of a 16-bit converter."""
    return np.asarray(np.minimum(np.rint(samples * INT16_SCALE), INT16_SCALE - 1), np.int16)


class FrameStream:
    """Cuts pushed samples into chunks; keeps those of the incomplete chunk."""

    def __init__(self) -> None:
        self._sound: Samples = np.zeros(0, np.float32)
        self._masked = np.zeros(0, np.bool_)
        """Which of these samples are masked."""
        self.next_frame = 0
        """The first frame of the chunk to come."""

    def push(self, samples: Samples, masked: bool) -> Iterator[Chunk]:
        """Yield the chunks that `samples` complete. Iterate to the end, or samples are lost."""
        self._sound = np.concatenate([self._sound, cleaned(samples)])
        self._masked = np.concatenate([self._masked, np.full(len(samples), masked)])
        while len(self._sound) >= _NEEDED_SAMPLES:
            used = slice(_NEEDED_SAMPLES)
            chunk = Chunk(self.next_frame, energies_of(self._sound[used]), bool(self._masked[used].any()))
            self._sound, self._masked = self._sound[CHUNK_SAMPLES:], self._masked[CHUNK_SAMPLES:]
            self.next_frame += CHUNK_FRAMES
            yield chunk

    def lose(self, n_samples: int) -> Iterator[Chunk]:
        """Advance time by lost samples, as `push` of masked silence, in bounded time and memory."""
        whole = max(n_samples - _NEEDED_SAMPLES, 0) // CHUNK_SAMPLES  # the stream keeps fewer than are needed
        yield from self.push(np.zeros(n_samples - whole * CHUNK_SAMPLES, np.float32), masked=True)
        self.next_frame += whole * CHUNK_FRAMES  # what is left in the stream is masked silence in both cases

    def rest(self) -> Chunk:
        """The whole frames of the incomplete chunk, fewer than CHUNK_FRAMES; they stay in the stream."""
        return Chunk(self.next_frame, energies_of(self._sound), bool(self._masked.any()))


KEPT_FRAMES = HISTORY_SAMPLES // HOP_SAMPLES


class FrameHistory:
    """Ring buffer of a number for each of the last KEPT_FRAMES frames, 0 at first."""

    def __init__(self) -> None:
        self._ring = np.zeros(KEPT_FRAMES)

    def put(self, first_frame: int, values: NDArray[np.floating]) -> None:
        """Keep the numbers, shape (n,), of the frames from `first_frame` on."""
        self._ring[np.arange(first_frame, first_frame + len(values)) % KEPT_FRAMES] = values

    def between(self, start_frame: int, end_frame: int) -> NDArray[np.float64]:
        """The numbers of the frames from one up to another, shape (n,)."""
        return self._ring[np.arange(start_frame, end_frame) % KEPT_FRAMES]


class History:
    """Ring buffer of the last seconds of the microphone's signal. Positions are samples since the beginning."""

    def __init__(self, n: int = HISTORY_SAMPLES) -> None:
        """Keep the last `n` samples."""
        self._ring: Int16Samples = np.zeros(n, np.int16)
        self.end = 0
        """The sample after the newest."""
        self._lost = 0
        """Samples lost after it."""
        self._masked: deque[tuple[int, int]] = deque()
        """Where the robot itself spoke or sound was lost, the earliest first: from a sample up to another one."""

    @property
    def begin(self) -> int:
        """The oldest sample that is kept."""
        return max(self.end - len(self._ring), 0)

    def push(self, samples: Samples, masked: bool) -> None:
        """Append samples, shape (m,); `masked` while the robot itself speaks."""
        silent, self._lost = self._lost, 0
        if silent:
            self.end += max(silent - len(self._ring), 0)
            self.push(np.zeros(min(silent, len(self._ring)), np.float32), masked=True)
        begin, self.end = self.end, self.end + len(samples)
        new = to_int16(cleaned(samples[-len(self._ring) :]))
        self._ring[np.arange(self.end - len(new), self.end) % len(self._ring)] = new
        if masked:
            if self._masked and self._masked[-1][1] == begin:
                begin, _ = self._masked.pop()
            self._masked.append((begin, self.end))
        while self._masked and self._masked[0][1] <= self.begin:
            self._masked.popleft()

    def lose(self, n_samples: int) -> None:
        """Advance time by lost samples, as `push` of masked silence; but until the next push all is kept that was
        heard before them."""
        self._lost += n_samples

    def between(self, begin: int, end: int) -> Samples | None:
        """Return the sound from sample `begin` up to `end`, shape (end - begin,), float32, silent where nothing was
        heard yet; None if its beginning is no longer kept."""
        if begin < self.begin:
            return None
        sound = self._read(begin, min(end, self.end))
        return np.pad(sound, (0, end - begin - len(sound)))

    def unmasked(self, begin: int, middle: int, end: int) -> tuple[Samples, int]:
        """The sound that is kept from sample `begin` up to `end`, without the robot's own speech; and the number of its
        samples before `middle`."""
        begin, end = max(begin, self.begin), min(end, self.end)
        heard = np.ones(max(end - begin, 0), np.bool_)
        for first, last in self._masked:
            heard[max(first - begin, 0) : max(last - begin, 0)] = False
        return self._read(begin, end)[heard], int(np.count_nonzero(heard[: max(middle - begin, 0)]))

    def _read(self, begin: int, end: int) -> Samples:
        """The samples from one that is kept up to another one; none if it comes before."""
        first, n = begin % len(self._ring), max(end - begin, 0)
        parts = self._ring[first : first + n], self._ring[: max(first + n - len(self._ring), 0)]
        return np.concatenate(parts).astype(np.float32) / INT16_SCALE
