"""Whether all of a sentence was heard, and whether it is the end of a longer one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.channel.search import Path, span_of
from hvcpd.recognition.channel.weighting import SHIFT, WeightedSound
from hvcpd.recognition.paths import Said, Signal

EXPECTED = 60.0
"""Energy of a word, in variances of the noise, from which on its absence shows: by 8 standard deviations."""
BEFORE, BEFORE_SHARE = 100.0, 0.05
"""Explained energy, and its share of what a sentence explains, from which on a word in the same voice was said right
before it. Chance reaches 20."""


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
        expected = float(path.spread @ fit.autocorrelation[:n])
        if expected >= EXPECTED:
            fits.append(float(path.taps @ fit.correlation[SHIFT + first : SHIFT + first + n]) / expected)
    return min(fits)


def is_preceded(sound: WeightedSound, path: Path, words: Iterable[str]) -> bool:
    """Whether one of these words was said by the same voice, through the same response, right before a path: then it is
    the end of a longer sentence."""
    ways = [said for word in words for third in range(3) for said in path.book.said(word, third)]
    place = path.starts[0]
    there = [(said, place - said.advance + path.said[0].lead * said.final) for said in ways]
    first, n = span_of(len(path.taps))
    least = max(BEFORE, BEFORE_SHARE * path.score)
    for fit in sound.fits(there):
        heard = float(np.correlate(fit.correlation[first : first + n + 2 * SHIFT], path.taps, "valid").max())
        own = max(float(path.spread @ fit.autocorrelation[:n]), 1e-9)
        if heard > 0.0 and min(heard**2 / own, 2.0 * own) > least:
            return True
    return False
