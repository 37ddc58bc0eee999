"""What a voice says as it comes through a channel that is known by now: its words, filtered by the response."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.channel.response import Taps, transform_size
from hvcpd.recognition.matched_filter import Spectrum, power_of
from hvcpd.recognition.paths import Said, Voicebook

KEPT = 80
"""Words of which the filtered sounds are kept, 3 MB."""
REACH = 64
"""Taps on either side of the strongest one (4 ms): the loudspeaker and the first echoes. Later ones change as soon as a
robot moves."""


def around_peak(taps: Taps) -> Taps:
    """The part of a response around its strongest tap, shape (2 REACH,), faded at both ends, of energy 1."""
    peak = int(np.abs(taps).argmax())
    padded = np.pad(taps, REACH)
    part = padded[peak : peak + 2 * REACH] * np.hanning(2 * REACH + 1)[:-1]
    return np.asarray(part / max(float(np.linalg.norm(part)), 1e-20), np.float32)


@dataclass(frozen=True, eq=False)
class Filtered:
    """A way to say a word, see `paths.Said`, as it comes through a channel."""

    plain: Said
    taps: Taps

    @property
    def length(self) -> int:
        """Samples of its sound."""
        return self.plain.length + len(self.taps)

    @property
    def final(self) -> bool:
        """Whether a pause follows."""
        return self.plain.final

    @property
    def lead(self) -> int:
        """Samples of it that precede its audible part."""
        return self.plain.lead

    @property
    def advance(self) -> int:
        """From its first sample to the next word's place."""
        return self.plain.advance

    @cached_property
    def samples(self) -> Samples:
        """Its sound, shape (length,)."""
        size = transform_size(self.length)
        sound = np.fft.irfft(np.fft.rfft(self.plain.samples, size) * np.fft.rfft(self.taps, size), size)
        return np.asarray(sound[: self.length], np.float32)

    @cached_property
    def power(self) -> Spectrum:
        """Its `power_of`."""
        return power_of(self.samples)


class ThroughChannel:
    """A `Voicebook` through a response."""

    def __init__(self, book: Voicebook, taps: Taps) -> None:
        """`taps`: the response, shape (n,), as `around_peak` makes it."""
        self.plain = book
        self.voice = book.voice
        self._taps = taps
        self._ways = lru_cache(KEPT)(self._filtered)

    def said(self, word: str, third: int) -> Sequence[Said]:
        """As `Voicebook.said`."""
        return self._ways(word, third)

    def _filtered(self, word: str, third: int) -> Sequence[Said]:
        return tuple(Filtered(said, self._taps) for said in self.plain.said(word, third))

    def forget(self) -> None:
        """As `Voicebook.forget`."""
        self._ways.cache_clear()
        self.plain.forget()

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """As `Voicebook.prepare`."""
        self.plain.prepare(go_on)
