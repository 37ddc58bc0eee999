"""Hypothesis fusion: selects one of the sentences found in a segment of sound, and gives its confidence.

Two logistic curves, fitted by `python -m benchmarks.fit` to people and synthetic voices that the net was not trained
on, and to an equal amount of other speech: other words, parts of longer sentences, talk that addresses nobody.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hvcpd.people.enrolled_listener import Known
from hvcpd.people.phones import CtcSearch, CtcSentence, LogPosteriors
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.fitted import fitted, logistic, logit

Words = tuple[str, ...]

MOST_LOSS = 60.0
"""Largest extra loss of a sentence; more carries no information."""
MOST_FARTHER = 100.0
"""Largest extra distance from enrolled people's words; more carries no information."""
MOST_LOG_ODDS = 8.0
"""Largest natural logarithm of the odds of a sentence by the net; the net is not right more often than that."""
LEAST_SPEECH_S = 0.2
URGENT = "stop"
MOST_CALL_WORDS = 3
""" "Team plant stop": an addressee and the word."""


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Results of the phone net and of the enrolled people's templates for one segment of sound.

    `log_posteriors` are the net's, `by_phones` is the sentence that fits them best, and `known` are the results of the
    enrolled people's templates; None where there are none. `speech_s` is the duration of the speech. `talk` is the
    network of other talk.
    """

    log_posteriors: LogPosteriors
    search: CtcSearch
    talk: CtcSearch
    by_phones: CtcSentence | None
    known: Known | None
    speech_s: float
    fits: dict[Words, CtcSentence | None] = field(default_factory=dict)
    """The fits of sentences other than `by_phones`, where requested."""

    def through(self, log_posteriors: LogPosteriors) -> Hypotheses:
        """The same with posteriors of another output layer."""
        return replace(self, log_posteriors=log_posteriors, by_phones=self.search.best(log_posteriors), fits={})

    @property
    def sentences(self) -> list[Words]:
        """All sentences that were found, each once."""
        found = [each.words for each in (self.by_phones, self.nearest) if each is not None]
        return list(dict.fromkeys([*found, self.tandem] if self.tandem is not None else found))

    @property
    def nearest(self) -> Recognised | None:
        """The sentence that is nearest to the words of enrolled people."""
        return self.known.nearest if self.known is not None else None

    @property
    def tandem(self) -> Words | None:
        """The sentence nearest to their words by tandem features."""
        return self.known.tandem if self.known is not None else None

    def farther(self, words: Words) -> tuple[float, float]:
        """The extra distance of a sentence from the enrolled people's words, compared with the nearest of all sentences
        found, by cepstra and by tandem features, MOST_FARTHER at most; less where even the nearest is far, and 0 where
        it is unknown."""
        mine = self.known.votes(words) if self.known is not None else None
        if self.known is None or self.nearest is None or mine is None:
            return 0.0, 0.0
        votes = (self.known.votes(other) for other in self.sentences)
        least = np.min([each for each in votes if each is not None], axis=0)
        near = 1.0 / (1.0 + deficit_of(self.nearest) ** 2)
        by_cepstra, by_net = (
            near * min(far - float(best), MOST_FARTHER) for far, best in zip(mine, least, strict=True)
        )
        return by_cepstra, by_net

    def loss(self, words: Words) -> float:
        """A sentence's loss by the net, MOST_LOSS above the best at most."""
        least = self.by_phones.loss if self.by_phones is not None else 0.0
        aligned = self._aligned(words)
        return min(aligned.loss, least + MOST_LOSS) if aligned is not None else least + MOST_LOSS

    def log_odds(self, words: Words) -> float:
        """The log odds by the net that a sentence was said, not another one or other talk, MOST_LOG_ODDS at most; for
        calls for a halt, any of them."""
        whole = self.search.log_likelihood(self.log_posteriors)
        if is_call(words):
            others = self.search.log_likelihood(self.log_posteriors, without=URGENT)
            mine = _without(whole, others)
        else:
            mine = self.search.log_likelihood_of(self.log_posteriors, words)
            others = _without(whole, mine)
        against = float(np.logaddexp(others, self.talk.log_likelihood(self.log_posteriors)))
        return min(max(mine - against, -MOST_LOG_ODDS), MOST_LOG_ODDS)

    def spans(self, words: Words) -> Sequence[tuple[int, int]]:
        """The first frame of each word of a sentence that was found, and the one after its last."""
        aligned = self._aligned(words)
        return aligned.spans if aligned is not None else [(0, len(self.log_posteriors))] * len(words)

    def _aligned(self, words: Words) -> CtcSentence | None:
        if self.by_phones is not None and words == self.by_phones.words:
            return self.by_phones
        if words not in self.fits:
            self.fits[words] = self.search.fit(self.log_posteriors, words)
        return self.fits[words]


@dataclass(frozen=True)
class Fused:
    """The most likely sentence, and the probability that it is right, 0 to 1."""

    words: Words
    probability: float


def fuse(hypotheses: Hypotheses) -> Fused | None:
    """The most likely of the sentences that were found; None if there is none."""
    scored = ranked(hypotheses)
    if not scored:
        return None
    words = scored[0][1]
    found = evidence(hypotheses, words)
    return Fused(words, logistic(sum(weight * value for weight, value in zip(PROBABILITY, found, strict=True))))


def ranked(hypotheses: Hypotheses) -> list[tuple[float, Words]]:
    """The sentences that were found, each with its support, the best first."""
    return sorted(((support(hypotheses, words), words) for words in hypotheses.sentences), reverse=True)


def is_call(words: Words) -> bool:
    """Whether a sentence is a call for a halt."""
    return len(words) <= MOST_CALL_WORDS and words[-1] == URGENT


def alike(one: Words, other: Words) -> bool:
    """Whether two sentences have the same meaning: calls for a halt do, whoever is to halt."""
    return one == other or (is_call(one) and is_call(other))


_WEIGHTS = fitted("people_fusion")["weights"]
SUPPORT: tuple[float, ...] = tuple(_WEIGHTS["support"].values())
"""Weights of `supporting`, in its order."""
PROBABILITY: tuple[float, ...] = tuple(_WEIGHTS["probability"].values())
"""Weights of `evidence`, in its order."""


def support(hypotheses: Hypotheses, words: Words) -> float:
    """Support of a sentence compared with the others that were found; natural logarithm of odds."""
    return sum(weight * value for weight, value in zip(SUPPORT, supporting(hypotheses, words), strict=True))


def supporting(hypotheses: Hypotheses, words: Words) -> Sequence[float]:
    """Features that support a sentence: its loss, and its distance from enrolled people's words compared with
    others."""
    return (hypotheses.loss(words), *hypotheses.farther(words))


def evidence(hypotheses: Hypotheses, words: Words) -> Sequence[float]:
    """Features of the confidence of the most likely sentence.

    The net's certainty of any phones; the log odds of the sentence by the net; whether it is nearest to enrolled
    people's words by cepstra, and how certainly, and by tandem features; the phones a second.
    """
    n_phones = sum(hypotheses.search.n_phones(word) for word in words)
    heard = [0.0, 0.0, 0.0]
    nearest = hypotheses.nearest
    if nearest is not None and alike(nearest.words, words):
        heard[:2] = 1.0, logit(nearest.confidence)
    if hypotheses.tandem is not None and alike(hypotheses.tandem, words):
        heard[2] = 1.0
    n_frames = max(len(hypotheses.log_posteriors), 1)
    return (
        1.0,
        float(-hypotheses.log_posteriors.max(axis=1).sum()) / n_frames,
        hypotheses.log_odds(words),
        *heard,
        n_phones / max(hypotheses.speech_s, LEAST_SPEECH_S),
    )


def _without(whole: float, part: float) -> float:
    """The logarithm of what is left of a probability without a part of it; all of them are logarithms."""
    return whole + math.log1p(-math.exp(min(part - whole, -1e-12))) if math.isfinite(part) else whole


def deficit_of(known: Recognised) -> float:
    """The mean distance of a frame to the takes beyond that to the nearest frame."""
    lengths = [span.end_sample - span.start_sample for span in known.spans]
    return sum(n * span.deficit for n, span in zip(lengths, known.spans, strict=True)) / max(sum(lengths), 1)
