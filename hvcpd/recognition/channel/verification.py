"""How likely a sentence of the channel search is right: whether all of it was heard, how far it is ahead, and whether
it is the end of a longer one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.channel.search import Path, span_of
from hvcpd.recognition.channel.weighting import SHIFT, WeightedSound
from hvcpd.recognition.confidence import logistic
from hvcpd.recognition.fitted import fitted
from hvcpd.recognition.paths import Said, Signal

EXPECTED = 60.0
"""Energy of a word, in variances of the noise, from which on its absence shows: by 8 standard deviations."""
BEFORE, BEFORE_SHARE = 100.0, 0.05
"""Explained energy, and its share of what a sentence explains, from which on a word in the same voice was said right
before it. Chance reaches 20."""
HEARD_BEFORE = 0.5
"""Of that energy, what must have been heard before the sentence: no word explains more than there is, and most of one
that was said before it lies there."""

MISSING = 0.2
"""A word of whose energy less was heard was not said: its absence shows by 6 standard deviations where it counts."""
MOST_LEAD_SHARE = 0.15
"""Share of a sentence's score up to which its lead carries information."""


@dataclass(frozen=True)
class Evidence:
    """What speaks for a sentence: the `share` that it explains of what was heard while it was said, its `lead` over any
    other path no word of which is missing (MOST_LEAD_SHARE of its score at most), and the `fit` of its worst word."""

    path: Path
    share: float
    lead: float
    fit: float

    @property
    def features(self) -> tuple[float, ...]:
        """Of `confidence`: log score; log share; lead over score, MOST_LEAD_SHARE behind at most; fit, at most 1."""
        score = max(self.path.score, 1.0)
        lead = max(self.lead / score, -MOST_LEAD_SHARE)
        return (math.log(score), math.log(max(self.share, 1e-3)), lead, min(self.fit, 1.0))

    @property
    def confidence(self) -> float:
        """The probability, 0 to 1, that the sentence is right: logistic regression, fitted by `python -m
        benchmarks.fit --only channel_confidence`."""
        weights = fitted("channel_confidence")["weights"]
        return logistic(weights["bias"] + sum(w * x for w, x in zip(weights["features"], self.features, strict=True)))


def evidence_of(sound: WeightedSound, path: Path, fit: float, paths: Sequence[Path]) -> Evidence:
    """For one of `paths`, which are sorted by score, the best first; `fit`: its `least_fit`."""
    least = (1.0 - MOST_LEAD_SHARE) * path.score
    rivals = (each for each in paths if each.score > least and each.words != path.words[: len(each.words)])
    rival = next((each.score for each in rivals if least_fit(sound, each) >= MISSING), least)
    share = path.score / max(path.energy(sound, path.end), 1e-9)
    return Evidence(path, share, path.score - rival, fit)


@dataclass(frozen=True, eq=False)
class _End:
    """The second half of a known signal."""

    whole: Said

    @property
    def begin(self) -> int:
        """Its first sample."""
        return self.whole.length // 2

    @property
    def length(self) -> int:
        """Samples of it."""
        return self.whole.length - self.begin

    @property
    def samples(self) -> Samples:
        """Its sound, shape (length,)."""
        return self.whole.samples[self.begin :]


def least_fit(sound: WeightedSound, path: Path) -> float:
    """Of the word that fits worst, what was heard of it through the path's response over what was expected: about 1 if
    it was said, 0 or less if not. The last word's end counts by itself: a sentence may have been cut off in it. What
    little was to be expected of does not count."""
    end = _End(path.said[-1])
    words = zip(path.said, path.starts, strict=True)
    there: Iterable[tuple[Signal, int]] = chain(words, [(end, path.starts[-1] + end.begin)])
    fits = [1.0]
    first, n = span_of(len(path.taps))
    for fit in sound.fits(there):
        expected = float(path.spread @ fit.density)
        if expected >= EXPECTED:
            fits.append(float(path.taps @ fit.correlation[SHIFT + first : SHIFT + first + n]) / expected)
    return min(fits)


def is_preceded(sound: WeightedSound, path: Path, words: Iterable[str]) -> bool:
    """Whether one of these words was said by the same voice, through the same response, right before a path: then it is
    the end of a longer sentence."""
    ways = (said for word in words for third in range(3) for said in path.book.said(word, third))
    place = path.starts[0]
    least = max(BEFORE, BEFORE_SHARE * path.score)
    places = [(said, place - said.advance + path.said[0].lead * said.final) for said in ways]
    there = [(said, at) for said, at in places if sound.energy(at, place) >= HEARD_BEFORE * least]
    first, n = span_of(len(path.taps))
    for fit in sound.fits(there):
        heard = float(np.correlate(fit.correlation[first : first + n + 2 * SHIFT], path.taps, "valid").max())
        own = max(float(path.spread @ fit.density), 1e-9)
        if heard > 0.0 and min(heard**2 / own, 2.0 * own) > least:
            return True
    return False
