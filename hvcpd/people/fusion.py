"""Hypothesis fusion: the likeliest of the sentences found in a segment of sound, and its confidence.

A logistic curve, fitted by `python -m benchmarks.fit` to people and synthetic voices that the net was not trained on,
and to an equal amount of other speech: other words, parts of longer sentences, talk that addresses nobody.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from hvcpd.people.phones import CtcSearch, CtcSentence, LogPosteriors
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.fitted import fitted, logistic, logit

Words = tuple[str, ...]

MOST_LOSS = 60.0
"""Largest extra loss of a sentence; more carries no information."""
MOST_LEAD = 6.0
"""Largest extra loss of the best other sentence, natural logarithm; more carries no information."""
MOST_LOSS_A_PHONE, MOST_OF_A_WORD = 6.0, 2.0
LEAST_SPEECH_S = 0.2
URGENT = "stop"
MOST_CALL_WORDS = 3
""" "Team plant stop": an addressee and the word."""


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Results of the phone net and of the enrolled people's templates for one segment of sound.

    `log_posteriors` are the net's, `by_phones` is the sentence that fits them best, and `nearest` the one that is
    nearest to the words of enrolled people; None where there is none. `speech_s` is the duration of the speech.
    """

    log_posteriors: LogPosteriors
    search: CtcSearch
    by_phones: CtcSentence | None
    nearest: Recognised | None
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
        return list(dict.fromkeys(found))

    @property
    def tandem(self) -> Words | None:
        """None: of the fitted weights one is of tandem features, which are gone. The next fit leaves it out."""
        return None

    def loss(self, words: Words) -> float:
        """A sentence's loss by the net, MOST_LOSS above the best at most."""
        least = self.by_phones.loss if self.by_phones is not None else 0.0
        aligned = self._aligned(words)
        return min(aligned.loss, least + MOST_LOSS) if aligned is not None else least + MOST_LOSS

    def worst_word(self, words: Words) -> tuple[str, float]:
        """The word of a sentence with the largest loss per frame by the net, and that loss."""
        aligned = self._aligned(words)
        if aligned is None:
            return words[0], math.inf
        lost = self.search.word_losses(self.log_posteriors, aligned)
        return max(zip(aligned.words, lost, strict=True), key=lambda word: word[1])

    def lead(self, words: Words) -> float:
        """The extra loss by the net of the best other sentence, MOST_LEAD at most; for calls for a halt, of the best
        one without the halt."""
        loss = math.inf
        if is_call(words):
            other = self.search.best(self.log_posteriors, without=URGENT)
            loss = other.loss if other is not None else loss
        elif self.by_phones is not None:
            loss = self.search.least_other_loss(self.log_posteriors, self.by_phones, words)
        return min(loss - self.loss(words), MOST_LEAD)

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
    found = [Fused(words, probability(evidence(hypotheses, words))) for words in hypotheses.sentences]
    return max(found, key=lambda each: each.probability, default=None)


def probability(found: Sequence[float]) -> float:
    """The probability, 0 to 1, that a sentence with this `evidence` is right."""
    return logistic(sum(weight * value for weight, value in zip(PROBABILITY, found, strict=True)))


def is_call(words: Words) -> bool:
    """Whether a sentence is a call for a halt."""
    return len(words) <= MOST_CALL_WORDS and words[-1] == URGENT


def alike(one: Words, other: Words) -> bool:
    """Whether two sentences have the same meaning: calls for a halt do, whoever is to halt."""
    return one == other or (is_call(one) and is_call(other))


PROBABILITY: tuple[float, ...] = tuple(fitted("people_fusion")["weights"]["probability"].values())
"""Weights of `evidence`, in its order."""


def evidence(hypotheses: Hypotheses, words: Words) -> Sequence[float]:
    """Features of the confidence of the most likely sentence.

    Its loss against the best phone sequence, for each of its phones: a strange voice loses a little in each, a wrong
    sentence much in a few. The worst word's loss per frame; the net's certainty of any phones; the extra loss of the
    best other sentence, times the logarithm of the number of phones, since a short word that is no sentence is like
    none of the others either; whether it is nearest to enrolled people's words by cepstra, and how certainly, and by
    tandem features; the phones a second.
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
        min(hypotheses.loss(words) / n_phones, MOST_LOSS_A_PHONE),
        min(hypotheses.worst_word(words)[1], MOST_OF_A_WORD),
        float(-hypotheses.log_posteriors.max(axis=1).sum()) / n_frames,
        hypotheses.lead(words) * math.log(n_phones),
        *heard,
        n_phones / max(hypotheses.speech_s, LEAST_SPEECH_S),
    )
