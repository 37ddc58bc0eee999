"""Second-pass recognition of people, where no robot's voice explains speech, by two phone nets and enrolled takes.

Their hypotheses are fused: a logistic curve gives the confidence of the likeliest. `python -m benchmarks.fit` fits it
to people and synthetic voices that the nets were not trained on, and to an equal amount of other speech: other words,
parts of longer sentences, talk that addresses nobody.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import numpy as np

from hvcpd.language.graph import WordGraph, ends_of
from hvcpd.people.bands import log_bands_of_segment
from hvcpd.people.enrolled import STRANGER, EnrolledRecogniser, Person
from hvcpd.people.phones import (
    FRAME_SAMPLES,
    CtcSearch,
    CtcSentence,
    LogPosteriors,
    NetOutput,
    mean_normalised,
    nets,
    word_loop,
)
from hvcpd.people.speaker_adaptation import adapted_layers
from hvcpd.recognition.events import Recognised, Source, WordSpan
from hvcpd.recognition.fitted import fitted, logistic, logit
from hvcpd.recognition.keyword.stage import KEYWORD
from hvcpd.recognition.stages import Segment
from hvcpd.synthesis.lexicon import Lexicon, common_words

Words = tuple[str, ...]

MOST_LOG_ODDS = 8.0
"""Largest log odds of a sentence by a net, natural logarithm; no net is right more often than that."""
GREETINGS = ("hi", "hello")
TO_ALL = "all"
MOST_CALL_WORDS = 3
"""Words of a call for a halt at most: an addressee and the keyword, as in "team plant stop"."""


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Results of the phone nets and of enrolled people's takes for one segment of sound.

    `posteriors` are those of the nets, one or more. The likeliest sentence is that with the highest product of its
    probabilities by each (product of experts: G. Hinton, "Training products of experts by minimizing contrastive
    divergence", Neural Computation 14(8), 2002); its log odds are those by the net that is surest. `search` has all
    sentences and `talk` all other talk. `by_takes` is the sentence nearest to enrolled people's takes, or None.
    """

    posteriors: Sequence[LogPosteriors]
    search: CtcSearch
    talk: CtcSearch
    by_takes: Recognised | None

    @cached_property
    def by_phones(self) -> CtcSentence | None:
        """The likeliest of the sentences that are best by one of the nets; None if there is none."""
        found = {each.words: each for posterior in self.posteriors if (each := self.search.best(posterior)) is not None}
        if len(found) <= 1:  # mostly the nets agree, and nothing is to be weighed
            return next(iter(found.values()), None)
        return max(found.values(), key=lambda each: self._log_product(each.words))

    def _log_product(self, words: Words) -> float:
        return sum(self.search.log_likelihood_of(posterior, words) for posterior in self.posteriors)

    @property
    def sentences(self) -> list[Words]:
        """The candidates, by phones and by takes; of two with the same meaning, that by phones."""
        found = [each.words for each in (self.by_phones, self.by_takes) if each is not None]
        return found[:1] if len(found) > 1 and same_meaning(*found) else found

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
            mine = self.search.log_likelihood_of(posterior, *wordings(words))
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


def is_call(words: Words) -> bool:
    """Whether a sentence is a call for a halt."""
    return len(words) <= MOST_CALL_WORDS and words[-1] == KEYWORD


def wordings(words: Words) -> Sequence[Words]:
    """All sentences with the same meaning: with either greeting, and to all or to nobody in particular, which are the
    same to robots ("Hi, I am Anna" and "hello all, I am Anna")."""
    if not words or words[0] not in GREETINGS:
        return (words,)
    rest = words[2:] if words[1:3] == (TO_ALL, "i") else words[1:]
    to_all = ((), (TO_ALL,)) if rest[:1] == ("i",) else ((),)
    return [(greeting, *to, *rest) for greeting in GREETINGS for to in to_all]


def same_meaning(one: Words, other: Words) -> bool:
    """Whether two sentences have the same meaning; calls for a halt have, whomever they address."""
    return one in wordings(other) or (bool(one) and bool(other) and is_call(one) and is_call(other))


WEIGHTS: tuple[float, ...] = tuple(fitted("people_fusion")["weights"]["probability"].values())
"""Weights of `confidence_features`, in its order."""


def confidence_features(hypotheses: Hypotheses, words: Words) -> Sequence[float]:
    """Features of the confidence of a candidate, shape (5,): 1; the nets' mean loss against certain phones, per frame;
    the log odds of the sentence; whether it is also the candidate by takes, and the log odds of its confidence
    there."""
    by_takes = hypotheses.by_takes
    agrees = by_takes is not None and same_meaning(by_takes.words, words)
    agreement = (1.0, logit(by_takes.confidence)) if by_takes is not None and agrees else (0.0, 0.0)
    loss = -certainty(hypotheses.posteriors) / max(len(hypotheses.posteriors[0]), 1)
    return 1.0, loss, hypotheses.log_odds(words), *agreement


def certainty(posteriors: Sequence[LogPosteriors]) -> float:
    """The mean log probability of the likeliest phones by each net."""
    return float(np.mean([each.max(axis=1).sum() for each in posteriors]))


def _log_difference(whole: float, part: float) -> float:
    """The logarithm of the difference of two probabilities, `part` not above `whole`, given as logarithms."""
    return whole + math.log1p(-math.exp(min(part - whole, -1e-12))) if math.isfinite(part) else whole


MIN_PROBABILITY = 0.8
"""Least confidence, as in the robots' own recogniser."""
MIN_STRANGERS_PROBABILITY = 0.75
"""Least confidence of a stranger's sentence. Of 486 sentences by three of Kokoro's voices, flite's and festival's slt,
to which nothing was fitted, in white noise at 20 dB or pink noise at 8 dB, 266 are so sure and right and 5 so sure and
wrong; with 0.7 it is 283 and 9, with 0.8 247 and 5."""
MIN_WITHIN_TALK = 0.9
"""Least confidence where others speak before and after it: there is much more of such speech, and hardly any of it is
for a robot."""
MOST_LAYERS = 2
"""People's adapted layers that are tried: each costs as much as the one for anybody."""
LAYERS_KEPT = 64
"""Layers in memory, 30 kB each: more than the people of a class."""
MOST_SURE = 0.94
"""Highest confidence of a stranger's sentence, below what coordination needs to move wheels without a confirmed
read-back: clearly spoken words that form no sentence have fitted as well as some right sentences."""

TALK_WORD_COST = 4.0
"""Of each word of other talk, natural logarithm. Of 2, 4 and 6, 4 tells sentences from all else best
(docs/decisions/phones.md)."""

COURTESY = "please"
"""Said after an order, it changes nothing."""


class SecondPassRecogniser:
    """Searches segments of sound; its listeners are made when first needed, in the thread that searches."""

    def __init__(self, graph: WordGraph, lexicon: Lexicon, people: Mapping[str, Person], strangers: bool) -> None:
        """`people`: the enrolled people, read again for each segment, so that newly learned words count; with
        `strangers`, sentences of all other people count too."""
        self._graph = graph
        self._lexicon = lexicon
        self._people = people
        self._strangers = strangers
        self._enrolled: tuple[tuple[Person, ...], EnrolledRecogniser] | None = None
        """The listener and its people: set in one step, since one thread may `prepare` while another searches."""
        self._layers = lru_cache(LAYERS_KEPT)(partial(adapted_layers, pronounce=lexicon.sounds))

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make the slow first-time preparations, as long as `go_on` holds."""
        self._listener()
        if self._strangers and go_on():
            _ = self._searches
        for person in self._people.values() if self._strangers else ():
            if not go_on():
                return
            self._layers(person.sentences)

    def search(self, segment: Segment) -> Recognised | None:
        """The sentence in a segment, with its confidence; None if none is sure enough."""
        return next((found for each in segment.beginnings if (found := self._sentence(each)) is not None), None)

    def may_go_on(self, words: Sequence[str]) -> bool:
        """Whether more words than COURTESY would make another sentence of these."""
        ends = ends_of(self._graph, self._graph.start, words)
        return any(word != COURTESY for end in ends for word, _ in self._graph.following[end])

    def _sentence(self, segment: Segment) -> Recognised | None:
        if not self._strangers:
            listener = self._listener()
            return _surely(listener.recognise(segment) if listener is not None else None)
        hypotheses, fused = self._fused(*self._heard(segment))
        least = MIN_WITHIN_TALK if segment.within_talk else MIN_STRANGERS_PROBABILITY
        if fused is not None and fused.probability >= least:
            return _recognised(fused, hypotheses, segment)
        agreed = fused is not None and hypotheses.by_takes is not None and fused.words == hypotheses.by_takes.words
        return _surely(hypotheses.by_takes) if agreed else None

    def likeliest(self, segment: Segment) -> Recognised | None:
        """The most likely sentence in a segment, however unlikely."""
        return self.compared(segment, None)[0]

    def compared(self, segment: Segment, words: Words | None) -> tuple[Recognised | None, float | None]:
        """The most likely sentence in a segment, however unlikely, and the probability of these `words`, if any are
        given, by the net for anybody."""
        by_anybody, outputs = self._heard(segment)
        own = probability(confidence_features(by_anybody, words)) if words is not None else None
        hypotheses, fused = self._fused(by_anybody, outputs)
        return (_recognised(fused, hypotheses, segment) if fused is not None else None), own

    def _fused(self, hypotheses: Hypotheses, outputs: Sequence[NetOutput]) -> tuple[Hypotheses, FusedHypothesis | None]:
        """By the net for anybody, and as sure as the likeliest of the layers adapted to people, if that finds
        the same sentence; else not sure at all. Of 150 sentences by Kokoro's voices, from which no net learned, 85 are
        then right and 4 wrong with five sentences of the speaker enrolled (69 and 4 with nobody's, 78 and 3 with
        another one's)."""
        fused = fuse(hypotheses)
        if fused is None:
            return hypotheses, None
        through = [replace(hypotheses, posteriors=each) for each in self._through_layers(outputs)]
        found = [(other, each) for other in through if (each := fuse(other)) is not None]
        if not found:
            return hypotheses, fused
        other, by_person = max(found, key=lambda each: each[1].probability)
        if not same_meaning(by_person.words, fused.words):
            return hypotheses, replace(fused, probability=0.0)
        return (other, by_person) if by_person.probability > fused.probability else (hypotheses, fused)

    def _through_layers(self, outputs: Sequence[NetOutput]) -> list[list[LogPosteriors]]:
        """The posteriors by people's own layers, MOST_LAYERS of those that are surest of their phones."""
        people = (self._layers(person.sentences) for person in self._people.values())
        found = [
            [layer.log_posteriors(each.activations) for layer, each in zip(layers, outputs, strict=True)]
            for layers in people
            if layers
        ]
        return sorted(found, key=certainty, reverse=True)[:MOST_LAYERS]

    def hypotheses(self, segment: Segment) -> Hypotheses:
        """The results of the net for anybody and of the enrolled people's templates for a segment."""
        return self._heard(segment)[0]

    def _heard(self, segment: Segment) -> tuple[Hypotheses, Sequence[NetOutput]]:
        search, talk = self._searches
        logs = mean_normalised(log_bands_of_segment(segment))
        outputs = [net.output(logs) for net in nets()]
        listener = self._listener()
        nearest = listener.recognise(segment) if listener is not None else None
        return Hypotheses([each.log_posteriors for each in outputs], search, talk, nearest), outputs

    @cached_property
    def _searches(self) -> tuple[CtcSearch, CtcSearch]:
        """Of sentences, and of other talk."""
        talk = word_loop([*common_words(), *self._graph.words], self._lexicon.sounds, TALK_WORD_COST)
        return CtcSearch(self._graph, self._lexicon.sounds), talk

    def _listener(self) -> EnrolledRecogniser | None:
        """The listener for enrolled people; None if nobody has a word of the phrasebook's."""
        words = set(self._graph.words)
        people = tuple(person for person in tuple(self._people.values()) if person.takes.keys() & words)
        if not people:
            return None
        known = self._enrolled
        if known is None or [*map(id, people)] != [*map(id, known[0])]:
            known = self._enrolled = people, EnrolledRecogniser(self._graph, people)
        return known[1]


def _surely(nearest: Recognised | None) -> Recognised | None:
    return nearest if nearest is not None and nearest.confidence >= MIN_PROBABILITY else None


def _recognised(fused: FusedHypothesis, hypotheses: Hypotheses, segment: Segment) -> Recognised:
    """The sentence, in the voice of an enrolled person if that fits by itself."""
    words, sure, known = fused.words, min(fused.probability, MOST_SURE), hypotheses.by_takes
    if known is not None and known.words == words and known.confidence >= MIN_PROBABILITY:
        return replace(known, confidence=max(fused.probability, known.confidence))
    first = max(segment.lead - segment.before, 0) + segment.origin
    spans = [
        WordSpan(word, first + start * FRAME_SAMPLES, first + end * FRAME_SAMPLES, fused.probability)
        for word, (start, end) in zip(words, hypotheses.spans(words), strict=True)
    ]
    return Recognised.of(spans, STRANGER, sure, Source.PEOPLE)
