"""Hypothesis fusion: the likeliest of the sentences found in a segment of sound, and its confidence.

A logistic curve, fitted by `python -m benchmarks.fit` to people and synthetic voices that the net was not trained on,
and to an equal amount of other speech: other words, parts of longer sentences, talk that addresses nobody.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hvcpd.people.phones import CtcSearch, CtcSentence, LogPosteriors
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.fitted import fitted, logistic, logit

Words = tuple[str, ...]

MOST_LOG_ODDS = 8.0
"""Largest natural logarithm of the odds of a sentence by the net; the net is not right more often than that."""
URGENT = "stop"
GREETINGS = ("hi", "hello")
TO_ALL = "all"
MOST_CALL_WORDS = 3
""" "Team plant stop": an addressee and the word."""


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Results of the phone nets and of the enrolled people's templates for one segment of sound.

    `readings` are the nets' posteriors, one or more, in each of which a sentence has a probability of its own. The one
    with the highest product of them is likeliest (product of experts: G. Hinton, "Training products of experts by
    minimizing contrastive divergence", Neural Computation 14(8), 2002), and as sure as by the net that is surest.
    `nearest` is the sentence nearest to the words of enrolled people, or None. `talk` is the network of other talk.
    """

    readings: Sequence[LogPosteriors]
    search: CtcSearch
    talk: CtcSearch
    nearest: Recognised | None

    @cached_property
    def by_phones(self) -> CtcSentence | None:
        """The likeliest of the sentences that fit one of the readings best; None if there is none."""
        found = {each.words: each for reading in self.readings if (each := self.search.best(reading)) is not None}
        if len(found) <= 1:  # mostly the nets agree, and nothing is to be weighed
            return next(iter(found.values()), None)
        return max(found.values(), key=lambda each: self._log_product(each.words))

    def _log_product(self, words: Words) -> float:
        return sum(self.search.log_likelihood_of(reading, words) for reading in self.readings)

    @property
    def sentences(self) -> list[Words]:
        """All sentences that were found; of two that mean the same, the net's."""
        found = [each.words for each in (self.by_phones, self.nearest) if each is not None]
        return found[:1] if len(found) > 1 and alike(*found) else found

    def log_odds(self, words: Words) -> float:
        """The log odds, by the net that is surest, that a sentence was said, in any of its `wordings`, not another one,
        the beginning of one, or other talk, MOST_LOG_ODDS at most; for calls for a halt, any of them."""
        least = -MOST_LOG_ODDS
        return max(least, *(self._log_odds(number, words) for number in range(len(self.readings))))

    def _log_odds(self, number: int, words: Words) -> float:
        """By one of the nets."""
        reading, whole = self.readings[number], self._of_sentences[number]
        if is_call(words):
            others = self.search.log_likelihood(reading, URGENT, beginnings=True)
            mine = _without(whole, others)
        else:
            said = [self.search.log_likelihood_of(reading, each) for each in wordings(words)]
            mine = float(np.logaddexp.reduce(said))
            others = _without(whole, mine)
        if mine == -math.inf:
            return mine
        return min(mine - float(np.logaddexp(others, self._of_talk[number])), MOST_LOG_ODDS)

    @cached_property
    def _of_sentences(self) -> Sequence[float]:
        return [self.search.log_likelihood(each, beginnings=True) for each in self.readings]

    @cached_property
    def _of_talk(self) -> Sequence[float]:
        return [self.talk.log_likelihood(each) for each in self.readings]

    def spans(self, words: Words) -> Sequence[tuple[int, int]]:
        """The first frame of each word of a sentence that was found, and the one after its last."""
        by_phones = self.by_phones
        is_best = by_phones is not None and words == by_phones.words
        aligned = by_phones if is_best else self.search.fit(self.readings[0], words)
        return aligned.spans if aligned is not None else [(0, len(self.readings[0]))] * len(words)


@dataclass(frozen=True)
class Fused:
    """The most likely sentence, and the probability that it is right, 0 to 1."""

    words: Words
    probability: float


def fuse(hypotheses: Hypotheses) -> Fused | None:
    """The most likely of the sentences that were found; None if there is none."""
    found = [Fused(words, probability(evidence(hypotheses, words))) for words in hypotheses.sentences]
    return max(found, key=lambda each: each.probability, default=None)


def probability(found: Sequence[float]) -> float:
    """The probability, 0 to 1, that a sentence with this `evidence` is right."""
    return logistic(sum(weight * value for weight, value in zip(PROBABILITY, found, strict=True)))


def is_call(words: Words) -> bool:
    """Whether a sentence is a call for a halt."""
    return len(words) <= MOST_CALL_WORDS and words[-1] == URGENT


def wordings(words: Words) -> Sequence[Words]:
    """All ways to say the same: with either greeting, and to all or to nobody in particular, which robots do not tell
    apart ("Hi, I am Anna" and "hello all, I am Anna")."""
    if not words or words[0] not in GREETINGS:
        return (words,)
    rest = words[2:] if words[1:3] == (TO_ALL, "i") else words[1:]
    to_all = ((), (TO_ALL,)) if rest[:1] == ("i",) else ((),)
    return [(greeting, *to, *rest) for greeting in GREETINGS for to in to_all]


def alike(one: Words, other: Words) -> bool:
    """Whether two sentences have the same meaning: calls for a halt do, whoever is to halt."""
    return one in wordings(other) or (bool(one) and bool(other) and is_call(one) and is_call(other))


PROBABILITY: tuple[float, ...] = tuple(fitted("people_fusion")["weights"]["probability"].values())
"""Weights of `evidence`, in its order."""


def evidence(hypotheses: Hypotheses, words: Words) -> Sequence[float]:
    """Features of the confidence of the most likely sentence.

    The nets' certainty of any phones; the log odds of the sentence by the surer net; whether it is nearest to enrolled
    people's words, and how certainly.
    """
    heard = 0.0, 0.0
    nearest = hypotheses.nearest
    if nearest is not None and alike(nearest.words, words):
        heard = 1.0, logit(nearest.confidence)
    n_frames = max(len(hypotheses.readings[0]), 1)
    return (
        1.0,
        -certainty(hypotheses.readings) / n_frames,
        hypotheses.log_odds(words),
        *heard,
    )


def certainty(readings: Sequence[LogPosteriors]) -> float:
    """The mean log probability of the likeliest phones of each reading."""
    return float(np.mean([each.max(axis=1).sum() for each in readings]))


def _without(whole: float, part: float) -> float:
    """The logarithm of what is left of a probability without a part of it; all of them are logarithms."""
    return whole + math.log1p(-math.exp(min(part - whole, -1e-12))) if math.isfinite(part) else whole
