"""Fusion of what the phone nets and enrolled people's takes make of a segment: a logistic curve gives the confidence of
the likeliest sentence.

`python -m benchmarks.fit` fits it to people and synthetic voices that the nets were not trained on, and to an equal
amount of other speech: other words, parts of longer sentences, talk that addresses nobody.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

import numpy as np

from hvcpd.language.addressees import FRIEND
from hvcpd.language.pattern import Words
from hvcpd.language.wordings import by_name, is_call, same_meaning, wordings
from hvcpd.language.words import KEYWORD
from hvcpd.people.bands import LogBands
from hvcpd.people.phones import CtcSearch, CtcSentence, LogPosteriors
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.fitted import fitted, logistic, logit

MOST_LOG_ODDS = 8.0
"""Largest log odds of a sentence by a net, natural logarithm; no net is right more often than that."""
DENIAL = "DENIAL"
"""In a network, beside FRIEND: words that are no name, and after which "complete task two" is no order, as in "I am not
going to". No word is in capitals."""
REFUSAL = "REFUSAL"
"""The same words after a name, as in "I am Anna, not confirmed"."""


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Results of the phone nets and of enrolled people's takes for one segment of sound.

    `posteriors` are those of the nets, one or more. The likeliest sentence is that with the highest product of its
    probabilities by each (product of experts: G. Hinton, "Training products of experts by minimizing contrastive
    divergence", Neural Computation 14(8), 2002); its log odds are those by the net that is surest. `search` has all
    sentences and `talk` all other talk. `by_takes` is the sentence nearest to enrolled people's takes, or None.
    `activations` are those of each net, from which layers adapted to a person make other posteriors.
    """

    posteriors: Sequence[LogPosteriors]
    search: CtcSearch
    talk: CtcSearch
    by_takes: Recognised | None
    activations: Sequence[LogBands] = ()

    @cached_property
    def by_phones(self) -> CtcSentence | None:
        """The likeliest of the sentences that are best by one of the nets; None if there is none, or if it has a
        DENIAL or a REFUSAL."""
        found = {each.words: each for posterior in self.posteriors if (each := self.search.best(posterior)) is not None}
        best = next(iter(found.values()), None)
        if len(found) > 1:  # mostly the nets agree, and nothing is to be weighed
            likelihood = self.search.log_likelihood_of
            best = max(found.values(), key=lambda each: sum(likelihood(one, each.words) for one in self.posteriors))
        return best if best is not None and not {DENIAL, REFUSAL}.intersection(best.words) else None

    @property
    def sentences(self) -> list[Words]:
        """The candidates, by phones and by takes; of two with the same meaning, that by phones."""
        found = [each.words for each in (self.by_phones, self.by_takes) if each is not None]
        return found[:1] if len(found) > 1 and same_meaning(*found) else found

    def _said_by(self, words: Words) -> Sequence[Words]:
        """A sentence, and the same by FRIEND; or, if it is FRIEND's, by whomever: an unclear name makes the rest no
        less sure."""
        name = words[words.index("am") + 1] if "am" in words[:-1] else ""
        if name not in self.names:
            return [words]
        return [by_name(words, each) for each in (self.names if name == FRIEND else (name, FRIEND))]

    @cached_property
    def names(self) -> frozenset[str]:
        """What speakers may call themselves, with FRIEND; empty if names that are not known count for nothing."""
        return self.search.instead_of(FRIEND) - {DENIAL}

    def log_odds(self, words: Words) -> float:
        """Log odds, by the net that is surest, of a sentence in any of its `wordings`, or of any call for a halt if it
        is one, against all other sentences, their beginnings and other talk; within MOST_LOG_ODDS of 0."""
        least = -MOST_LOG_ODDS
        return max(least, *(self._log_odds(number, words) for number in range(len(self.posteriors))))

    def _log_odds(self, number: int, words: Words) -> float:
        """The log odds by one net."""
        posterior, whole = self.posteriors[number], self._sentence_log_likelihoods[number]
        if is_call(words):
            others = self.search.log_likelihood(posterior, KEYWORD, beginnings=True)
            mine = _log_difference(whole, others)
        else:
            mine = self.search.log_likelihood_of(posterior, *chain.from_iterable(map(wordings, self._said_by(words))))
            others = _log_difference(whole, mine)
        if mine == -math.inf:
            return mine
        return min(mine - float(np.logaddexp(others, self._talk_log_likelihoods[number])), MOST_LOG_ODDS)

    @cached_property
    def _sentence_log_likelihoods(self) -> Sequence[float]:
        return [self.search.log_likelihood(each, beginnings=True) for each in self.posteriors]

    @cached_property
    def _talk_log_likelihoods(self) -> Sequence[float]:
        return [self.talk.log_likelihood(each) for each in self.posteriors]

    def probability_of(self, sentences: CtcSearch) -> float:
        """The probability, by the net that is surest, that one of these sentences was said, whichever it was."""
        every = zip(self._sentence_log_likelihoods, self._talk_log_likelihoods, strict=True)
        whole = [float(np.logaddexp(*each)) for each in every]
        mine = map(sentences.log_likelihood, self.posteriors)
        found = (math.exp(one - other) for one, other in zip(mine, whole, strict=True) if math.isfinite(other))
        return max(found, default=0.0)

    def spans(self, words: Words) -> Sequence[tuple[int, int]]:
        """The first frame of each word of a candidate, and the frame after its last."""
        by_phones = self.by_phones
        is_best = by_phones is not None and words == by_phones.words
        aligned = by_phones if is_best else self.search.fit(self.posteriors[0], words)
        return aligned.spans if aligned is not None else [(0, len(self.posteriors[0]))] * len(words)


@dataclass(frozen=True)
class FusedHypothesis:
    """A sentence, and the probability that it is right, 0 to 1."""

    words: Words
    probability: float


def fuse(hypotheses: Hypotheses) -> FusedHypothesis | None:
    """The likeliest candidate; None if there is none."""
    found = [
        FusedHypothesis(words, probability(confidence_features(hypotheses, words))) for words in hypotheses.sentences
    ]
    return max(found, key=lambda each: each.probability, default=None)


def probability(found: Sequence[float]) -> float:
    """The probability, 0 to 1, that a sentence with these `confidence_features` is right."""
    return logistic(sum(weight * value for weight, value in zip(WEIGHTS, found, strict=True)))


WEIGHTS: tuple[float, ...] = tuple(fitted("people_fusion")["weights"]["probability"].values())
"""Weights of `confidence_features`, in its order."""


def confidence_features(hypotheses: Hypotheses, words: Words) -> Sequence[float]:
    """Features of a candidate's confidence, shape (4,): 1; the sentence's log odds; whether it is also the candidate by
    takes, and the log odds of its confidence there."""
    by_takes = hypotheses.by_takes
    agrees = by_takes is not None and same_meaning(by_takes.words, words)
    agreement = (1.0, logit(by_takes.confidence)) if by_takes is not None and agrees else (0.0, 0.0)
    return 1.0, hypotheses.log_odds(words), *agreement


def certainty(posteriors: Sequence[LogPosteriors]) -> float:
    """The mean log probability of the likeliest phones by each net."""
    return float(np.mean([each.max(axis=1).sum() for each in posteriors]))


def _log_difference(whole: float, part: float) -> float:
    """The logarithm of the difference of two probabilities, `part` not above `whole`, given as logarithms."""
    return whole + math.log1p(-math.exp(min(part - whole, -1e-12))) if math.isfinite(part) else whole
