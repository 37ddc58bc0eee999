"""What the channel search needs to know of robots' words: each as their synthesizers render it, sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import lru_cache
from typing import Protocol

from hvcpd.ports import Samples

GREETING = "hi"
"""The first word of most of robots' sentences."""

I_AM = ("i", "am")
"""The words before a robot's own name."""


class Signal(Hashable, Protocol):
    """A sound that is known to the sample. It may be on disk, so request it only to compare it."""

    @property
    def length(self) -> int:
        """Its length, samples."""

    @property
    def samples(self) -> Samples:
        """The sound, shape (length,)."""


class Said(Signal, Protocol):
    """One way to say a word."""

    @property
    def final(self) -> bool:
        """Whether a pause follows."""

    @property
    def lead(self) -> int:
        """Number of samples before its audible part: after a pause it begins this much earlier."""

    @property
    def advance(self) -> int:
        """Distance from its first sample to the next word's place, samples."""


class Voicebook(Protocol):
    """The words of one voice, at one rate."""

    @property
    def voice(self) -> str:
        """The voice's name."""

    @property
    def others(self) -> frozenset[str]:
        """The names of robots that have other voices, as words."""

    def said(self, word: str, third: int) -> Sequence[Said]:
        """All ways to say `word` in a third (0, 1, 2) of a sentence; none if that voice cannot say it."""

    def forget(self) -> None:
        """Free memory: nobody has spoken for a while."""

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Prepare all words that may be requested, while `go_on` holds."""


def thirds_of(n_words: int) -> tuple[int, ...]:
    """The third of a sentence in which each of its words is."""
    return tuple(3 * k // n_words for k in range(n_words))


@lru_cache(4096)
def may_have(thirds: tuple[int, ...], lengths: int) -> bool:
    """Whether the words of a sentence may begin in these `thirds` if it has one of these numbers of further words, bits
    of `lengths` (see `graph.lengths_of`)."""
    n = len(thirds)
    return any(lengths >> more & 1 and thirds_of(n + more)[:n] == thirds for more in range(lengths.bit_length()))
