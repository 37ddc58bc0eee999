"""The shared front stage of all recognisers on one microphone: frames and noise tracking, computed once.

While only noise is heard this is all that runs; the networks sleep.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.activity import ActivityDetector
from hvcpd.recognition.events import Event
from hvcpd.recognition.frontend import N_BANDS, Energies, power_weights
from hvcpd.recognition.noise import STEADY_NOISE, STEP_FRAMES, NoiseTracker
from hvcpd.recognition.stream import CHUNK_FRAMES, CHUNK_SAMPLES, Chunk, FrameStream

RECENT_FRAMES = 160
"""1.6 s of frames are kept to be replayed into a network when it wakes."""
POWER_FRAMES = 2048
"""20 s of frame powers are kept for the signal-to-noise ratio of a sentence."""

Found = tuple[list[Event], ...]
"""The results of each watcher."""


class Watcher(Protocol):
    """Receives the frames of the watch. All watchers receive the same chunks."""

    @property
    def under_way(self) -> bool:
        """Whether a sentence may be in progress, so that the sound is not noise."""

    @property
    def follows(self) -> bool:
        """Whether a sentence surely is in progress, so that a rise in level is not noise."""

    def hear(self, chunk: Chunk) -> list[Event]:
        """The next frames, once the noise is known."""

    def break_off(self, frame: int) -> list[Event]:
        """Note that speech before `frame` will not be understood."""


class Watch:
    """Monitors one microphone for its watchers."""

    def __init__(self) -> None:
        self.stream = FrameStream()
        self.noise = NoiseTracker()
        self.activity = ActivityDetector()
        self.recent: Energies = np.zeros((0, N_BANDS), np.float32)
        """The last frames, shape (n, N_BANDS), n at most RECENT_FRAMES; none from before a break."""
        self.chunks: list[Chunk] = []
        """What was passed on in the last push."""
        self._early: list[Chunk] = []
        """The sound from before the noise was known."""
        self._power_weights = power_weights()
        self._speech_power = np.zeros(POWER_FRAMES)
        self._noise_power = np.zeros(POWER_FRAMES)

    def push(self, samples: Samples, masked: bool, watchers: Sequence[Watcher]) -> Iterator[Found]:
        """Pass the next samples, shape (n,), to the watchers. Iterate to the end, or samples are lost."""
        self.chunks = []
        for chunk in self.stream.push(np.asarray(samples).reshape(-1), masked):
            yield from self._take(chunk, watchers)

    def lose(self, n_samples: int, watchers: Sequence[Watcher]) -> Iterator[Found]:
        """Advance time by lost samples; iterate likewise. Raises ValueError for a negative number."""
        if n_samples < 0:
            raise ValueError(f"{n_samples} samples cannot be lost")
        self.chunks = []
        yield self._break_off(self.stream.next_frame, watchers)
        for chunk in self.stream.lose(n_samples):
            yield from self._take(chunk, watchers)

    def flush(self, watchers: Sequence[Watcher], silent_chunks: int) -> Iterator[Found]:
        """Pass on the frames that fill no chunk yet, and this number of chunks of the room's noise after them."""
        self.chunks = []
        rest = self.stream.rest()
        if len(rest.energies):
            yield from self._take(rest, watchers)
        frame = rest.first_frame + len(rest.energies)
        silence = np.tile(self.noise.estimate * np.exp(STEADY_NOISE.mean_log), (CHUNK_FRAMES, 1))
        for at in range(frame, frame + silent_chunks * CHUNK_FRAMES, CHUNK_FRAMES):
            yield from self._hear(Chunk(at, silence, False, np.zeros(CHUNK_SAMPLES, np.float32)), watchers)

    def powers(self, start_frame: int, end_frame: int) -> tuple[float, float]:
        """Mean power above the noise, 0 or more, and of the noise, linear; both 0 where there are no frames."""
        slots = np.arange(start_frame, end_frame) % POWER_FRAMES
        if not len(slots):
            return 0.0, 0.0
        noise = float(self._noise_power[slots].mean())
        return max(float(self._speech_power[slots].mean()) - noise, 0.0), noise

    def _take(self, chunk: Chunk, watchers: Sequence[Watcher]) -> Iterator[Found]:
        if chunk.masked:  # the robot's own voice covers everything
            yield self._break_off(chunk.first_frame, watchers)
            return
        self.noise.push(chunk.energies, speech=self.activity.busy or any(w.under_way for w in watchers))
        if not any(w.follows for w in watchers) and self.noise.follow_step():
            # The noise stepped up: activity since then was noise, and speech before it is lost.
            yield self._break_off(chunk.first_frame - STEP_FRAMES, watchers)
        yield from self._hear(chunk, watchers)

    def _break_off(self, frame: int, watchers: Sequence[Watcher]) -> Found:
        found = tuple(w.break_off(frame) for w in watchers)
        self.activity.reset()
        self.recent = self.recent[:0]
        return found

    def _hear(self, chunk: Chunk, watchers: Sequence[Watcher]) -> Iterator[Found]:
        self.recent = np.concatenate([self.recent, chunk.energies])[-RECENT_FRAMES:]
        self._early.append(chunk)
        if not self.noise.ready:
            return
        for each in self._early:
            self.activity.push(each.energies, self.noise.estimate)
            slots = np.arange(each.first_frame, each.first_frame + len(each.energies)) % POWER_FRAMES
            self._speech_power[slots] = each.energies @ self._power_weights
            self._noise_power[slots] = self.noise.estimate @ self._power_weights
            self.chunks.append(each)
            yield tuple(w.hear(each) for w in watchers)
        self._early = []
