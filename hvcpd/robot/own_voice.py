"""The robot's own voice: the sound still to be played, when the last of it is heard, and its delay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.ranging.own_delay import OwnDelay

NEAR_S = 0.012
"""Delays that differ by less count as the same: half a block, and twice the error of a measurement."""
CUT_S = 0.4
"""Speech that begins this soon after the robot no longer hears itself may have begun before: of sentences whose
beginning it covered, at 320 positions in four voices, "resume" and "come back" were heard alone up to 0.37 s later."""
ECHO_S = 1.0
"""A sentence that ends no later than this after the robot's own, in the same words, is its echo."""
LATE_S = 2.0
"""Longest delay of the robot's own words after a fault of the sound system, as much as it keeps (`audio.queue_s`)."""
BREAK_S = 0.2
"""Silence between a sentence that is broken off and the next: a "stop" said twice halted 24 of 24 other robots at once
with it, and 21 without (`python -m benchmarks.stop_broken_off`)."""
NOTHING: Samples = np.zeros(0, np.float32)


@dataclass(frozen=True)
class Acoustics:
    """Delays of the robot's own sound, s."""

    latency_s: float = 0.0
    """From handing a block out until the robot's microphone hears it, as reported by the sound system; the bench has
    none beyond the block."""
    tail_s: float = 0.12
    """Time for which the robot's voice rings on in the room."""
    collision_s: float = 0.4
    """Garbled speech that began no later than this after the robot's own speech ended overlapped it."""


class OwnVoice:
    """`begin` a sentence, `hear` and `take` each block, and ask at each whether it is `finished`. Times are seconds."""

    def __init__(self, acoustics: Acoustics, delay: OwnDelay) -> None:
        """`delay` measures how late the voice is heard."""
        self._acoustics = acoustics
        self._delay = delay
        self._reported_s = acoustics.latency_s
        self._measured = False
        self.is_latency_known = False
        """Whether the last sentence came back when it should have. False before the first sentence, after sound was
        lost, and when the card has reported a new latency."""
        self._shorter_s: float | None = None
        self._speech = NOTHING
        self._words: tuple[str, ...] = ()
        self._position = 0
        self._silent_until_s = -np.inf
        self._masked_until_s = -np.inf
        self.latency_s = acoustics.latency_s
        """From handing a block out until it is heard: the reported and the measured latency together."""
        self.until_s = -np.inf
        """When the last of the sentence is, or was, heard."""
        self.speaking = False

    def report_latency(self, reported_s: float) -> None:
        """Set the latency that the sound system reports, which may change at any time; the measured excess stays."""
        if reported_s != self._reported_s:
            by_s, self._reported_s = reported_s - self._reported_s, reported_s
            self.is_latency_known = False
            self._set_latency(max(self.latency_s + by_s, 0.0))

    def begin(self, speech: Samples, words: Sequence[str], now: float) -> None:
        """Say `speech`, shape (n,), from the next block on, or a little later if a sentence has just been broken off;
        `words` are the last thing said in it."""
        if now < self._silent_until_s:
            pause = np.zeros(samples_in(self._silent_until_s - now), np.float32)
            speech = np.concatenate((pause, speech))
        self._speech, self._words = speech, tuple(words)
        self._position = 0
        self._measured = False
        self.speaking = True
        self.until_s = now + len(speech) / SAMPLE_RATE_HZ + self.latency_s
        self._delay.begin()

    def take(self, n: int) -> Samples:
        """Return the next samples to be played, shape (n,), float32."""
        out = np.zeros(n, np.float32)
        if self.speaking:
            piece = self._speech[self._position : self._position + n]
            out[: len(piece)] = piece
            self._position += len(piece)
            self._delay.play(out)
        return out

    def hear(self, heard: Samples) -> None:
        """Take sound from the microphone, shape (n,), float32, heard while n samples were played."""
        if self.speaking:
            self._delay.hear(heard)

    def finished(self, now: float) -> bool:
        """Whether the last of the sentence has just been heard; the first time it seems so, its delay is measured."""
        if not self.speaking or self._position < len(self._speech) or now < self.until_s:
            return False
        if not self._measured:
            self._measured = True
            self._believe(self._delay.measure())
            if now < self.until_s:
                return False
        self._speech, self.speaking = NOTHING, False
        self._masked_until_s = now + self._acoustics.tail_s
        return True

    def break_off(self, now: float) -> bool:
        """Nothing else of the sentence is heard. Returns whether there was one."""
        self.is_latency_known = False
        was_speaking = self.speaking
        if was_speaking:
            self._speech, self.speaking, self.until_s = NOTHING, False, now
            self._silent_until_s = now + BREAK_S
        return was_speaking

    def lose(self, lost_s: float) -> None:
        """Note sound that was not heard, and in whose place nothing was played: the words wait, and cannot be
        compared."""
        self.is_latency_known = False
        if self.speaking:
            self.until_s += lost_s
            self._measured = True

    def masks(self, now: float) -> bool:
        """Whether the robot may be hearing its own voice."""
        return self.speaking or now < self._masked_until_s

    def overlapped(self, start_s: float, end_s: float) -> bool:
        """Whether the robot's own voice may have garbled this speech."""
        return start_s <= self.until_s + self._acoustics.collision_s <= end_s

    def may_have_cut(self, start_s: float) -> bool:
        """Whether speech that was heard to begin then may be the end of something longer."""
        return abs(start_s - self._masked_until_s) < CUT_S

    def may_be_late(self, start_s: float) -> bool:
        """Whether speech that was heard to begin then may be the robot's own, where sound was lost or late."""
        return start_s < self.until_s + LATE_S

    def returns(self, words: Sequence[str], end_s: float) -> bool:
        """Whether the words are the end of this robot's last sentence, heard later than its known delay.

        Another robot's same words are not: it would have begun to say them while this one still spoke.
        """
        is_end = len(words) > 0 and self._words[-len(words) :] == tuple(words)
        return is_end and self.until_s < end_s <= self.until_s + ECHO_S

    def _believe(self, measured_s: float | None) -> None:
        """Take a longer delay at once, because then the robot still hears itself; a shorter one when it is seen twice
        in a row."""
        sooner, self._shorter_s = self._shorter_s, None
        if measured_s is None:
            return
        is_near = abs(measured_s - self.latency_s) < NEAR_S
        if not is_near and (measured_s > self.latency_s or (sooner is not None and abs(measured_s - sooner) < NEAR_S)):
            self._set_latency(measured_s)
            is_near = True
        self.is_latency_known = is_near
        self._shorter_s = None if is_near else measured_s

    def _set_latency(self, latency_s: float) -> None:
        if self.speaking:
            self.until_s += latency_s - self.latency_s
        self.latency_s = latency_s
