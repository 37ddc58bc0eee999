"""Sentences in the making of the coherent listener: paths through the word network, each word at its sample."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Protocol

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.matched_filter import (
    SLACK,
    Match,
    Spectrum,
    WhitenedSound,
    correlated,
    faded,
    power_of,
    scrutinized,
)

DRIFT = 24
"""Samples (1.5 ms) that a word may begin off its place: clocks 400 ppm apart over a pause and a long word, an echo."""
GREETING = "hi"
"""What robots begin with: it is sought even where nobody seems to speak."""
LEAST_SHARE = 0.5
"""Of the strength that a word would have at the sentence's loudness, the least; and one over it, the most."""
BY_CHANCE = 4.0
"""Log likelihood ratio that a word adds by chance, at the best of its lags."""
SAME_WORD = 0.9
"""Of the likelihood of a word at another pitch, the least of the one that its place asks for."""
BEHIND_SHARE, BEHIND = 1.5, 80.0
"""A path whose score is this many times and this much higher is the right one, or neither is."""
LEAST_MARGIN = 5.0
"""Least log likelihood ratio of a word against any other in its place."""
AMPLE_MARGIN = 20.0
"""Log likelihood ratio of a word against any other from which it is as sure as can be."""


class Signal(Hashable, Protocol):
    """A sound that is known to the sample. It may have to be read from disk, so it is asked for only to be compared."""

    @property
    def length(self) -> int:
        """Samples of it."""

    @property
    def samples(self) -> Samples:
        """It, shape (length,)."""


class Said(Signal, Protocol):
    """One way to say a word."""

    @property
    def final(self) -> bool:
        """Whether a pause follows."""

    @property
    def lead(self) -> int:
        """Samples of it that precede its audible part: after a pause it begins this much earlier."""

    @property
    def advance(self) -> int:
        """From its first sample to the next word's place."""

    @property
    def power(self) -> Spectrum:
        """Its `power_of`."""


class Voicebook(Protocol):
    """What one voice says, at one rate."""

    @property
    def voice(self) -> str:
        """What the voice is called."""

    def said(self, word: str, third: int) -> Sequence[Said]:
        """All ways to say `word` in a third (0, 1, 2) of a sentence; none if that voice cannot say it."""

    def forget(self) -> None:
        """Give back memory: nobody has spoken for a while."""

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make all that may be asked for ready, while `go_on`."""


@dataclass(frozen=True)
class HeardWord:
    """A word; samples `start` up to `end`; its strength over what was to be expected; and its log likelihood ratio
    against any other in its place."""

    word: str
    start: int
    end: int
    share: float
    margin: float
    said: Said | None = None
    """The very rendering, if it is known."""

    @property
    def chance(self) -> float:
        """The probability that it is right: of two words as likely beforehand, one half below the least margin."""
        return 1.0 / (1.0 + float(np.exp(min(LEAST_MARGIN / 2 - self.margin, 50.0))))


@dataclass(frozen=True)
class Coherent:
    """A sentence that was heard, its voice, and its log likelihood ratio against noise."""

    words: tuple[HeardWord, ...]
    voice: str
    score: float
    explained: float = 1.0
    """Share of the energy that was heard."""
    cut: bool = False
    """Somebody went on, but not with a word that was found."""
    gain: float = 0.0
    """How loud it was, over what its words are as they are rendered."""

    @property
    def sure(self) -> bool:
        """Whether it is whole, and no word of it may be another."""
        return not self.cut and min(word.margin for word in self.words) >= LEAST_MARGIN

    def sound(self, first: int, n: int) -> Samples:
        """What was heard of it from sample `first` on, shape (n,), by the direct way."""
        out = np.zeros(n, np.float32)
        for word in self.words:
            begin, end = max(word.start, first), min(word.end, first + n)
            if word.said is not None and begin < end:
                out[begin - first : end - first] += word.said.samples[begin - word.start : end - word.start]
        return out * np.float32(self.gain)


@dataclass(frozen=True)
class Extension:
    """A word that may come next, at sample `at`."""

    word: str
    node: int
    third: int
    said: Said
    at: int

    @property
    def end(self) -> int:
        return self.at + self.said.length


@dataclass(eq=False)
class Path:
    """A sentence up to a word. `heard` and `known`: strengths times expectations, and expectations squared, summed.

    With one gain for all of it, that makes its log likelihood ratio against noise alone, the `score`: a word that is
    not there adds to `known` only, and lowers it."""

    book: Voicebook
    node: int
    at: int
    """Where the next word has its place; `paused`: after a pause."""
    paused: bool = False
    thirds: tuple[int, ...] = ()
    words: tuple[str, ...] = ()
    heard: float = 0.0
    known: float = 0.0
    parent: Path | None = None
    start: int = 0
    end: int = 0
    likelihood: float = 0.0
    """What the last word added to the log likelihood ratio at the gain of those before it."""
    share: float = 1.0
    """Its strength over what was to be expected."""
    said: Said | None = None
    """How it was said."""
    first: int = 0
    """Where the first word begins."""
    energy: float = 0.0
    """Of its words at gain 1; `heard_energy`: of what was heard while they were said."""
    heard_energy: float = 0.0
    tried: dict[str, float] = field(default_factory=dict)
    """The best likelihood of each word after this path."""
    waiting: list[Extension] = field(default_factory=list)
    goes_on: bool = False
    """Words may come next, and do not wait yet."""
    ended: bool = False
    """It may be a whole sentence."""
    looks: list[bool] = field(default_factory=list)
    """At each look at what comes after it, whether it perhaps goes on."""
    loses: bool = False
    """At the last look it surely did."""
    contested_until: int | None = None
    """At this sample, longer words that may be said instead of its words have ended."""

    @property
    def gain(self) -> float:
        return self.heard / max(self.known, 1e-20)

    @property
    def score(self) -> float:
        return 0.5 * self.heard * self.gain

    @property
    def rank(self) -> float:
        """What paths are dropped by: every word fits a little by chance."""
        return self.score - BY_CHANCE * len(self.words)

    def margin(self, ends: bool, handicap: Callable[[str], float] = lambda _word: 0.0) -> float:
        """By how much the last word is likelier than any other in its place, and than none.

        Unless the sentence `ends` with it, it may be a little less likely than none: what follows speaks for it.
        `handicap`: how strongly what follows speaks against another word; it is asked for those only that come near.
        """
        tried = self.parent.tried if self.parent else {}
        near = self.likelihood - AMPLE_MARGIN
        others = [
            likelihood - handicap(word) if likelihood > near else likelihood
            for word, likelihood in tried.items()
            if word != self.words[-1]
        ]
        return self.likelihood - max([*others, 0.0 if ends else -LEAST_MARGIN])

    def is_sure_after(self, n_words: int) -> bool:
        """Whether it has words after the first `n_words`, and they are surely there."""
        later = [each for each in self.back() if len(each.words) > n_words]
        return bool(later) and all(each.margin(ends=True) >= LEAST_MARGIN for each in later)

    @property
    def is_best_of_its_words(self) -> bool:
        """Whether no word of it fits much better at another pitch, as it has elsewhere in a longer sentence."""
        return all(
            each.likelihood >= SAME_WORD * each.parent.tried[each.words[-1]] - BY_CHANCE
            for each in self.back()
            if each.parent is not None
        )

    @property
    def explained(self) -> float:
        """Its share of the energy that was heard."""
        return self.gain**2 * self.energy / max(self.heard_energy, 1e-20)

    def is_hopeless(self, leader: Path) -> bool:
        """Whether `leader` had far more where this one stands."""
        begins = self.first if self.words else self.at
        if begins >= leader.end:
            return False
        passed = next((each for each in leader.back() if each.at <= self.at), None)
        return passed is not None and passed.score > BEHIND_SHARE * self.score + BEHIND

    def back(self) -> Iterator[Path]:
        """This path and those that it goes on from, the first word last."""
        path: Path | None = self
        while path is not None:
            yield path
            path = path.parent

    def extended(self, by: Extension, offset: int, strength: float, expected: float, heard_energy: float) -> Path:
        """This path with one word more, found `offset` samples after its place; `expected`: at gain 1."""
        start = by.at + offset
        gain = self.gain if self.words else strength / expected
        return Path(
            self.book,
            by.node,
            start + by.said.advance,
            by.said.final,
            (*self.thirds, by.third),
            (*self.words, by.word),
            self.heard + strength * expected,
            self.known + expected**2,
            self if self.words else None,
            start,
            start + by.said.length,
            likelihood_of(strength, gain * expected),
            strength / max(gain * expected, 1e-20),
            by.said,
            self.first if self.words else start,
            self.energy + energy_of(by.said.samples),
            self.heard_energy + heard_energy,
        )

    def note(self, word: str, likelihood: float) -> None:
        """So likely is that word after this path."""
        self.tried[word] = max(self.tried.get(word, -np.inf), likelihood)


def energy_of(sound: Samples) -> float:
    """Sum of squares of a sound, shape (n,)."""
    return float(np.dot(sound, sound))


def likelihood_of(strength: float, expected: float) -> float:
    """Log likelihood ratio, against noise, of a sound that has `strength` where `expected` was to be found."""
    return expected * (strength - 0.5 * expected)


def passes(strength: float, expected: float) -> bool:
    """Whether a sound may be what was expected with that strength: a word far louder than those before it is none of
    the same sentence."""
    least, most = LEAST_SHARE * expected, expected / LEAST_SHARE
    return min(least, expected - SLACK) <= strength <= max(most, expected + SLACK)


def thirds_of(n_words: int) -> tuple[int, ...]:
    """In which third of a sentence each of its words is."""
    return tuple(3 * k // n_words for k in range(n_words))


@lru_cache(4096)
def may_have(thirds: tuple[int, ...], lengths: int) -> bool:
    """Whether the words of a sentence may begin in these `thirds` if it ends after so many more, bits of `lengths` (see
    `graph.lengths_of`)."""
    n = len(thirds)
    return any(lengths >> more & 1 and thirds_of(n + more)[:n] == thirds for more in range(lengths.bit_length()))


def compared(
    sound: WhitenedSound, words: Sequence[Extension], gain: float | None, until: int | None = None
) -> Iterator[tuple[Extension, Match, int]]:
    """How each word fits what was heard `until` a sample, at that gain of the sentence, if it is known; and how many
    samples from its place."""
    first = min(each.at for each in words) - DRIFT
    last = max(each.end for each in words) + DRIFT
    whitened = sound.between(first, last if until is None else min(last, until))
    for each in words:
        near = whitened[each.at - DRIFT - first : each.end + DRIFT - first]
        known = each.said.samples
        if len(near) - 2 * DRIFT < each.said.length:
            known = faded(known[: max(len(near) - 2 * DRIFT, 1)])
        power = each.said.power if len(known) == each.said.length else power_of(known)
        expected = max(float(np.dot(power, sound.whitening.weights)), 1e-20) ** 0.5
        strength, offset = correlated(near, known, expected)
        fit = Match(strength, expected, True)
        if gain is None or strength >= 0.5 * min(LEAST_SHARE * gain * expected, gain * expected - SLACK):
            there = near[offset : offset + len(known)]
            fit = scrutinized(there, known, power, sound.whitening, strength, expected)
        yield each, fit, offset - DRIFT


def fitting(
    sound: WhitenedSound, words: Sequence[Extension], gain: float, until: int | None = None
) -> Iterator[tuple[Extension, Match, int]]:
    """Those words that may be what was heard, with what was to be expected at that gain."""
    for each, fit, offset in compared(sound, words, gain, until) if words else ():
        at_gain = replace(fit, expected=gain * fit.expected)
        if passes(at_gain.strength, at_gain.expected):
            yield each, at_gain, offset
