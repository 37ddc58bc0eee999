"""Paths through the word network as robots render it, each with its own channel estimate; and their extension.

A path's score is the received energy that it explains through its best-fitting response: every path has its own
estimate ("per-survivor processing", R. Raheli, A. Polydoros, C. Tzou, IEEE Trans. Communications 43, 1995). Its normal
equations are the sums over its words, so each further word costs one correlation. The short overlap of neighbouring
words is neglected, which makes no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.graph import WordGraph
from hvcpd.ports import Samples
from hvcpd.recognition.channel.estimation import (
    FIRST_TAPS,
    MAX_SHIFT,
    PRE_TAPS,
    SIZE,
    TAPS,
    Signal,
    SignalFit,
    Taps,
    WhitenedSound,
    autocorrelations,
    channel_responses,
)
from hvcpd.recognition.channel.known import KnownResponse
from hvcpd.recognition.channel.whitening import Spectrum, transform_size
from hvcpd.recognition.frontend import TINY, rfft


class Rendering(Signal, Protocol):
    """One rendering of a word, with its place in the sentence."""

    @property
    def final(self) -> bool:
        """Whether a pause follows."""

    @property
    def lead(self) -> int:
        """Number of samples before its audible part: after a pause the rendering begins this much earlier."""

    @property
    def advance(self) -> int:
        """Distance from its first sample to the next word's place, samples."""


class RenderedVoice(Protocol):
    """The words of one voice, at one rate."""

    voice: str
    """The voice's name."""
    others: frozenset[str]
    """The names of robots that have other voices, as words."""

    def renderings(self, word: str, third: int) -> Sequence[Rendering]:
        """All renderings of `word` in a third (0, 1, 2) of a sentence; none if the voice cannot say it."""

    def free_memory(self) -> None:
        """Free memory: nobody has spoken for a while."""

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Prepare all words that may be requested, while `go_on` holds; no sound of theirs is kept in memory."""


def sayable(graph: WordGraph, book: RenderedVoice, word: str, third: int, node: int) -> Iterator[Rendering]:
    """The renderings of a word that leads to a node: with a pause after it only where a pause or the end may follow."""
    return (said for said in book.renderings(word, third) if not said.final or node in graph.rests)


def thirds_of(n_words: int) -> tuple[int, ...]:
    """The third of a sentence in which each of its words is."""
    return tuple(3 * k // n_words for k in range(n_words))


@lru_cache(4096)
def may_have(thirds: tuple[int, ...], lengths: int) -> bool:
    """Whether the words of a sentence may begin in these `thirds` if it has one of these numbers of further words, bits
    of `lengths` (see `graph.lengths_of`)."""
    n = len(thirds)
    return any(lengths >> more & 1 and thirds_of(n + more)[:n] == thirds for more in range(lengths.bit_length()))


@dataclass(frozen=True, eq=False)
class Path:
    """A sentence up to a word, with its normal equations over noise of variance 1."""

    book: RenderedVoice
    node: int
    words: tuple[str, ...]
    renderings: tuple[Rendering, ...]
    starts: tuple[int, ...]
    thirds: tuple[int, ...]
    autocorrelation: Taps
    correlation: Taps
    """Correlation of the sound with the signal, at lags from -PRE_TAPS on."""
    taps: Taps
    explained: tuple[float, ...]
    """The score before its first word and after each one."""
    known: KnownResponse | None
    """The response through which it was sought; None if it has an estimate of its own."""

    @staticmethod
    def empty(book: RenderedVoice, node: int, known: KnownResponse | None = None) -> Path:
        """A path without words."""
        nothing = np.zeros(TAPS, np.float32)
        return Path(book, node, (), (), (), (), nothing, nothing, nothing[:0], (0.0,), known)

    @property
    def score(self) -> float:
        """Energy that it explains beyond what its taps explain by chance."""
        return self.explained[-1]

    @property
    def end(self) -> int:
        """The sample after its last word's signal."""
        return self.starts[-1] + self.renderings[-1].length

    @property
    def ends(self) -> bool:
        """Whether it may be complete: a pause follows, and its words are in the thirds of a sentence of this length."""
        return self.renderings[-1].final and self.thirds == thirds_of(len(self.words))

    def energy(self, sound: WhitenedSound) -> float:
        """The energy received from its first word to its last."""
        return sound.energy(self.starts[0], self.end)

    def explained_until(self, sample: int) -> float:
        """The energy explained by its words that end before that sample."""
        ends = (start + said.length for start, said in zip(self.starts, self.renderings, strict=True))
        return max((e for end, e in zip(ends, self.explained[1:], strict=True) if end <= sample), default=0.0)

    def received(self, n: int) -> Samples:
        """The sentence as received, shape (n,)."""
        said = np.zeros(n + TAPS, np.float32)
        for start, each in zip(self.starts, self.renderings, strict=True):
            first, last = max(start, 0), min(start + each.length, n + TAPS)
            said[first:last] += each.samples[first - start : last - start]
        size = transform_size(n + TAPS)
        heard = np.fft.irfft(rfft(said, size) * rfft(self.shown.response, size), size)
        return np.asarray(heard[PRE_TAPS : PRE_TAPS + n], np.float32)

    @cached_property
    def shown(self) -> KnownResponse:
        """What it shows of the channel: its best-fitting response of TAPS taps."""
        return KnownResponse(self.autocorrelation, self.correlation)

    @cached_property
    def tap_weights(self) -> Spectrum:
        """The weights that turn a signal's `density`, multiplied and summed, into the signal's energy after its taps,
        shape (SIZE / 2 + 1,)."""
        response = rfft(self.taps, SIZE)
        weights = (response.real**2 + response.imag**2) * (2.0 / SIZE)
        weights[[0, -1]] *= 0.5
        return np.asarray(weights, np.float32)

    def around(self, fit: SignalFit) -> Taps:
        """The correlation with a signal at the lags of this path's response, and MAX_SHIFT more on either side."""
        begin = first_lag(len(self.taps))
        return fit.correlation[begin : begin + len(self.taps) + 2 * MAX_SHIFT]

    def expected_gains(self, fits: Sequence[SignalFit]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """For each of one or more signals the lag, from MAX_SHIFT before its place on, at which most of it was heard
        through this path's response; and the energy that it is expected to explain there, at most twice its own."""
        across = np.stack([self.around(fit) for fit in fits])
        heard = np.lib.stride_tricks.sliding_window_view(across, len(self.taps), axis=1) @ self.taps
        most = np.maximum(heard.max(axis=1), 0.0).astype(np.float64)
        own = np.maximum((np.stack([fit.density for fit in fits]) @ self.tap_weights).astype(np.float64), TINY)
        return heard.argmax(axis=1), np.minimum(most**2 / own, 2.0 * own)

    def shifted(self, samples: int) -> Path:
        """The same path in a sound that begins this many samples earlier."""
        return replace(self, starts=tuple(start + samples for start in self.starts))

    @property
    def delay(self) -> int:
        """Delay in samples from the place of its signal to the strongest part of what was received."""
        return int(np.abs(self.shown.response).argmax()) - PRE_TAPS


@dataclass(frozen=True, eq=False)
class Extension:
    """A possible next word of a path, `MAX_SHIFT` around its place, and the expected `score` of the path with it."""

    path: Path
    word: str
    node: int
    third: int
    said: Rendering
    at: int
    shift: int
    score: float

    def energy(self, sound: WhitenedSound) -> float:
        """The energy received from the path's first word to this one."""
        return sound.energy(self.path.starts[0], self.at + self.said.length)


def first_lag(n: int) -> int:
    """Where a response of `n` taps begins within a correlation at lags from -PRE_TAPS on: a long one reaches back."""
    return PRE_TAPS * (TAPS - n) // (TAPS - FIRST_TAPS)


def extended(sound: WhitenedSound, words: Sequence[Extension], n_taps: int) -> list[Path]:
    """Paths extended by one word each, with channel estimates of `n_taps` taps, unless they have a known response."""
    if not words:
        return []
    fits = sound.fits((word.said, word.at) for word in words)
    autocorrelation = np.stack([word.path.autocorrelation for word in words]) + autocorrelations(fits)
    pairs = zip(words, fits, strict=True)
    correlation = np.stack([word.path.correlation + fit.correlation[word.shift :][:TAPS] for word, fit in pairs])
    at_taps = correlation[:, first_lag(n_taps) : first_lag(n_taps) + n_taps]
    if (known := words[0].path.known) is None:
        taps = channel_responses(autocorrelation, at_taps, n_taps)
        explained = np.einsum("ij,ij->i", taps, at_taps) - n_taps
    else:
        gains, explained = known.gains(autocorrelation, correlation)
        taps = np.outer(gains, known.taps).astype(np.float32)
    return [
        Path(
            word.path.book,
            word.node,
            (*word.path.words, word.word),
            (*word.path.renderings, word.said),
            (*word.path.starts, word.at + word.shift - MAX_SHIFT),
            (*word.path.thirds, word.third),
            autocorrelation[k],
            correlation[k],
            taps[k],
            (*word.path.explained, float(explained[k])),
            word.path.known,
        )
        for k, word in enumerate(words)
    ]
