"""Which of the sentences that several listeners found in one piece of sound is right, and how likely that is.

Two logistic curves, fitted by `python -m benchmarks.opinions` to synthetic voices that the net was not trained on, to
people's digits, and to talk that addresses nobody.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hvcpd.people.enrolled_listener import Known
from hvcpd.people.phones import Chances
from hvcpd.people.spelled import Spelled, Speller
from hvcpd.recognition.confidence import logistic
from hvcpd.recognition.events import Recognised

Words = tuple[str, ...]

MOST_LOSS = 60.0
"""A sentence that loses so much more than another is none; how much more tells nothing."""
MOST_FARTHER = 100.0
"""Likewise, of what enrolled people's words tell."""
MOST_LOGIT, MOST_LEAD = 9.2, 6.0
"""Beyond these, the listeners' own measures tell nothing either."""
LEAST_SPEECH_S = 0.2
URGENT = "stop"
MOST_CALL_WORDS = 3
""" "Team plant stop": an addressee and the word."""


@dataclass(frozen=True, eq=False)
class Views:
    """What listeners make of one piece of sound, `chances` being what the net found.

    `spelled` is the sentence that fits the phones best that a net heard, `known` what the words of enrolled people make
    of it; None where there is none, or where nobody asked.
    """

    chances: Chances
    speller: Speller
    spelled: Spelled | None
    known: Known | None
    speech_s: float
    fits: dict[Words, Spelled | None] = field(default_factory=dict)
    """How other sentences than `spelled` fit, as far as that was asked for."""

    @property
    def sentences(self) -> list[Words]:
        """All that were found, each once."""
        found = [view.words for view in (self.spelled, self.nearest) if view is not None]
        return list(dict.fromkeys([*found, self.echoed] if self.echoed is not None else found))

    @property
    def nearest(self) -> Recognised | None:
        """The sentence that is nearest to the words of enrolled people."""
        return self.known.nearest if self.known is not None else None

    @property
    def echoed(self) -> Words | None:
        """The one that is by what the net makes of them."""
        return self.known.echoed if self.known is not None else None

    def farther(self, words: Words) -> tuple[float, float]:
        """How much farther a sentence is from the enrolled's words than the nearest of all that were found, by cepstra
        and by what the net makes of them, MOST_FARTHER at most; less where even the nearest is far, and 0 where it
        cannot be told."""
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
        """What a sentence loses for the net, MOST_LOSS more than the best at most."""
        least = self.spelled.loss if self.spelled is not None else 0.0
        spelled = self._aligned(words)
        return min(spelled.loss, least + MOST_LOSS) if spelled is not None else least + MOST_LOSS

    def spans(self, words: Words) -> Sequence[tuple[int, int]]:
        """The first frame of each word of a sentence that was found, and the one after its last."""
        spelled = self._aligned(words)
        return spelled.spans if spelled is not None else [(0, len(self.chances))] * len(words)

    def _aligned(self, words: Words) -> Spelled | None:
        if self.spelled is not None and words == self.spelled.words:
            return self.spelled
        if words not in self.fits:
            self.fits[words] = self.speller.fit(self.chances, words)
        return self.fits[words]


@dataclass(frozen=True)
class Judged:
    """The sentence that is likeliest right, and how likely it is, 0 to 1."""

    words: Words
    chance: float


def judge(views: Views) -> Judged | None:
    """The likeliest of the sentences that were found; None if there is none."""
    scored = ranked(views)
    if not scored:
        return None
    words = scored[0][1]
    logit = sum(weight * value for weight, value in zip(CHANCE, evidence(views, words, lead_of(scored)), strict=True))
    return Judged(words, logistic(logit))


def ranked(views: Views) -> list[tuple[float, Words]]:
    """The sentences that were found, each with its support, the best first."""
    return sorted(((support(views, words), words) for words in views.sentences), reverse=True)


def lead_of(scored: Sequence[tuple[float, Words]]) -> float:
    """How much more likely the first of some sentences is than the next that says something else."""
    best, words = scored[0]
    others = [score for score, other in scored if not alike(words, other)]
    return min(best - others[0], MOST_LEAD) if others else MOST_LEAD


def is_call(words: Words) -> bool:
    """Whether a sentence is a call for a halt."""
    return len(words) <= MOST_CALL_WORDS and words[-1] == URGENT


def alike(one: Words, other: Words) -> bool:
    """Whether two sentences say the same: calls do, whoever is to halt."""
    return one == other or (is_call(one) and is_call(other))


SUPPORT = (-0.185, -0.225, -0.0604)
"""Weights of `supporting`."""
CHANCE = (0.954, -25.7, 2.39, 0.365, 0.495, 2.78, -0.371, -1.61, 0.272)
"""Weights of `evidence`."""


def support(views: Views, words: Words) -> float:
    """How much speaks for a sentence, beside others that were found; natural logarithm of odds."""
    return sum(weight * value for weight, value in zip(SUPPORT, supporting(views, words), strict=True))


def supporting(views: Views, words: Words) -> Sequence[float]:
    """What speaks for a sentence: what it loses, and how much farther it is from enrolled people's words than others
    are."""
    return (views.loss(words), *views.farther(words))


def evidence(views: Views, words: Words, lead: float) -> Sequence[float]:
    """What tells whether the likeliest sentence is right, `lead` more likely than the next: what it loses in a frame;
    whether it is nearest to enrolled people's words by cepstra, and how sure that is, and by what the net makes of
    them; how many words, how fast, in how much speech."""
    n, speech_s = len(words), max(views.speech_s, LEAST_SPEECH_S)
    heard = [0.0, 0.0, 0.0]
    nearest = views.nearest
    if nearest is not None and alike(nearest.words, words):
        heard[:2] = 1.0, _logit(nearest.confidence)
    if views.echoed is not None and alike(views.echoed, words):
        heard[2] = 1.0
    each_frame = min(views.loss(words) / max(len(views.chances), 1), 1.0)
    return (1.0, each_frame, *heard, math.log(n), n / speech_s, math.log(speech_s), lead)


def deficit_of(known: Recognised) -> float:
    """The mean distance of a frame to the takes beyond that to the nearest frame."""
    lengths = [span.end_sample - span.start_sample for span in known.spans]
    return sum(n * span.deficit for n, span in zip(lengths, known.spans, strict=True)) / max(sum(lengths), 1)


def _logit(chance: float) -> float:
    chance = min(max(chance, 1e-9), 1.0 - 1e-9)
    return min(max(math.log(chance / (1.0 - chance)), -MOST_LOGIT), MOST_LOGIT)
