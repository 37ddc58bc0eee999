"""Partial sentences of the coherent listener: paths through the word network, each word at its sample."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Protocol

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.fitted import logistic
from hvcpd.recognition.frontend import TINY
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
"""The first words of robots' sentences: the search for them goes on even where nobody seems to speak."""
LEAST_SHARE = 0.5
"""Least ratio of a word's strength to the one expected at the sentence's loudness; the largest ratio is its inverse."""
BY_CHANCE = 4.0
"""Log likelihood ratio that a word adds by chance, at the best of its lags."""
SAME_WORD = 0.9
"""Least ratio of a word's likelihood at the pitch of its place to its likelihood at another pitch."""
BEHIND_SHARE, BEHIND = 1.5, 80.0
"""Factor and difference in score above which a path rules out another: it is the right one, or neither is."""
LEAST_MARGIN = 5.0
"""Least log likelihood ratio of a word against any other in its place."""
AMPLE_MARGIN = 20.0
"""Log likelihood ratio of a word against any other from which it is certain."""


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

    @property
    def power(self) -> Spectrum:
        """Its `power_of`."""


class Voicebook(Protocol):
    """The words of one voice, at one rate."""

    @property
    def voice(self) -> str:
        """The voice's name."""

    def said(self, word: str, third: int) -> Sequence[Said]:
        """All ways to say `word` in a third (0, 1, 2) of a sentence; none if that voice cannot say it."""

    def forget(self) -> None:
        """Free memory: nobody has spoken for a while."""

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Prepare all words that may be requested, while `go_on` holds."""


@dataclass(frozen=True)
class HeardWord:
    """A word; samples `start` up to `end`; its strength relative to the expected one; and its log likelihood ratio
    against any other word in its place."""

    word: str
    start: int
    end: int
    share: float
    margin: float
    said: Said | None = None
    """The exact rendering, if it is known."""

    @property
    def probability(self) -> float:
        """The probability that it is right, given equal prior probabilities: one half below the least margin."""
        return logistic(self.margin - LEAST_MARGIN / 2)


@dataclass(frozen=True)
class Coherent:
    """A recognised sentence, its voice, and its log likelihood ratio against noise."""

    words: tuple[HeardWord, ...]
    voice: str
    score: float
    explained: float = 1.0
    """Share of the received energy that it explains."""
    cut: bool = False
    """Somebody went on, but not with a word that was found."""
    gain: float = 0.0
    """Gain relative to its words as they are rendered."""

    @property
    def sure(self) -> bool:
        """Whether it is complete, and no word of it may be another."""
        return not self.cut and min(word.margin for word in self.words) >= LEAST_MARGIN

    def sound(self, first: int, n: int) -> Samples:
        """The sentence as received from sample `first` on by the direct path, shape (n,)."""
        out = np.zeros(n, np.float32)
        for word in self.words:
            begin, end = max(word.start, first), min(word.end, first + n)
            if word.said is not None and begin < end:
                out[begin - first : end - first] += word.said.samples[begin - word.start : end - word.start]
        return out * np.float32(self.gain)


@dataclass(frozen=True)
class Extension:
    """A possible next word, at sample `at`."""

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
    """A partial sentence. `heard` and `known`: the sums of strengths times expectations, and of squared expectations.

    With one gain for all words, they give its log likelihood ratio against noise alone, the `score`: a missing word
    adds to `known` only, and lowers it."""

    book: Voicebook
    node: int
    at: int
    """Sample at which the next word is expected; `paused`: after a pause."""
    paused: bool = False
    thirds: tuple[int, ...] = ()
    words: tuple[str, ...] = ()
    heard: float = 0.0
    known: float = 0.0
    parent: Path | None = None
    start: int = 0
    end: int = 0
    likelihood: float = 0.0
    """Increase of the log likelihood ratio by the last word at the gain of the words before it."""
    share: float = 1.0
    """Its strength relative to the expected one."""
    said: Said | None = None
    """The rendering that matched."""
    first: int = 0
    """Sample at which the first word begins."""
    energy: float = 0.0
    """Energy of its words at gain 1; `heard_energy`: energy received while they were said."""
    heard_energy: float = 0.0
    tried: dict[str, float] = field(default_factory=dict)
    """The best likelihood of each word after this path."""
    waiting: list[Extension] = field(default_factory=list)
    goes_on: bool = False
    """Whether words may come next that are not queued yet."""
    ended: bool = False
    """Whether it may be a whole sentence."""
    checks: list[bool] = field(default_factory=list)
    """Results of the checks of the sound after it: whether the sentence may go on."""
    loses: bool = False
    """Whether the last check showed that the sentence surely went on."""
    contested_until: int | None = None
    """The sample at which longer words that may replace its words have ended."""

    @property
    def gain(self) -> float:
        return self.heard / max(self.known, TINY)

    @property
    def score(self) -> float:
        return 0.5 * self.heard * self.gain

    @property
    def rank(self) -> float:
        """The score for pruning, without the words' chance level: every word fits a little by chance."""
        return self.score - BY_CHANCE * len(self.words)

    def margin(self, ends: bool, handicap: Callable[[str], float]) -> float:
        """The margin of the last word over any other word in its place, and over none.

        Unless the sentence `ends` with it, it may be a little less likely than none: the next words support it.
        `handicap`: how strongly the next words count against another word; it is evaluated only for close candidates.
        """
        tried = self.parent.tried if self.parent else {}
        near = self.likelihood - AMPLE_MARGIN
        others = [
            likelihood - handicap(word) if likelihood > near else likelihood
            for word, likelihood in tried.items()
            if word != self.words[-1]
        ]
        return self.likelihood - max([*others, 0.0 if ends else -LEAST_MARGIN])

    @property
    def is_best_of_its_words(self) -> bool:
        """Whether no word of it fits much better at another pitch, as at another place in a longer sentence."""
        return all(
            each.likelihood >= SAME_WORD * each.parent.tried[each.words[-1]] - BY_CHANCE
            for each in self.back()
            if each.parent is not None
        )

    @property
    def explained(self) -> float:
        """The share of the received energy that it explains."""
        return self.gain**2 * self.energy / max(self.heard_energy, TINY)

    def is_hopeless(self, leader: Path) -> bool:
        """Whether `leader` had a far higher score at this point."""
        begins = self.first if self.words else self.at
        if begins >= leader.end:
            return False
        passed = next((each for each in leader.back() if each.at <= self.at), None)
        return passed is not None and passed.score > BEHIND_SHARE * self.score + BEHIND

    def back(self) -> Iterator[Path]:
        """This path and its predecessors, the first word last."""
        path: Path | None = self
        while path is not None:
            yield path
            path = path.parent

    def extended(self, by: Extension, offset: int, strength: float, expected: float, heard_energy: float) -> Path:
        """This path with one more word, found `offset` samples after its place; `expected`: its strength at gain 1."""
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
            strength / max(gain * expected, TINY),
            by.said,
            self.first if self.words else start,
            self.energy + energy_of(by.said.samples),
            self.heard_energy + heard_energy,
        )

    def note(self, word: str, likelihood: float) -> None:
        """Record the likelihood of that word after this path."""
        self.tried[word] = max(self.tried.get(word, -np.inf), likelihood)


def energy_of(sound: Samples) -> float:
    """Sum of squares of a sound, shape (n,)."""
    return float(np.dot(sound, sound))


def likelihood_of(strength: float, expected: float) -> float:
    """Log likelihood ratio, against noise, of a sound found with `strength` where `expected` was predicted."""
    return expected * (strength - 0.5 * expected)


def passes(strength: float, expected: float) -> bool:
    """Whether a sound's strength is consistent with the expected one: a word far louder than those before it belongs to
    another sentence."""
    least, most = LEAST_SHARE * expected, expected / LEAST_SHARE
    return min(least, expected - SLACK) <= strength <= max(most, expected + SLACK)


def thirds_of(n_words: int) -> tuple[int, ...]:
    """The third of a sentence in which each of its words is."""
    return tuple(3 * k // n_words for k in range(n_words))


@lru_cache(4096)
def may_have(thirds: tuple[int, ...], lengths: int) -> bool:
    """Whether the words of a sentence may begin in these `thirds` if it has one of these numbers of further words, bits
    of `lengths` (see `graph.lengths_of`)."""
    n = len(thirds)
    return any(lengths >> more & 1 and thirds_of(n + more)[:n] == thirds for more in range(lengths.bit_length()))


def compared(
    sound: WhitenedSound, words: Sequence[Extension], gain: float | None, until: int | None = None
) -> Iterator[tuple[Extension, Match, int]]:
    """The fit of each word to the sound `until` a sample, at that gain of the sentence, if it is known; and its offset
    in samples from its place."""
    first = min(each.at for each in words) - DRIFT
    last = max(each.end for each in words) + DRIFT
    whitened = sound.between(first, last if until is None else min(last, until))
    for each in words:
        near = whitened[each.at - DRIFT - first : each.end + DRIFT - first]
        known = each.said.samples
        if len(near) - 2 * DRIFT < each.said.length:
            known = faded(known[: max(len(near) - 2 * DRIFT, 1)])
        power = each.said.power if len(known) == each.said.length else power_of(known)
        expected = max(float(np.dot(power, sound.whitening.weights)), TINY) ** 0.5
        strength, offset = correlated(near, known, expected)
        fit = Match(strength, expected, True)
        if gain is None or strength >= 0.5 * min(LEAST_SHARE * gain * expected, gain * expected - SLACK):
            there = near[offset : offset + len(known)]
            fit = scrutinized(there, known, power, sound.whitening, strength, expected)
        yield each, fit, offset - DRIFT


def fitting(
    sound: WhitenedSound, words: Sequence[Extension], gain: float, until: int | None = None
) -> Iterator[tuple[Extension, Match, int]]:
    """The words that may match the sound, with their expected strengths at that gain."""
    for each, fit, offset in compared(sound, words, gain, until) if words else ():
        at_gain = replace(fit, expected=gain * fit.expected)
        if passes(at_gain.strength, at_gain.expected):
            yield each, at_gain, offset
