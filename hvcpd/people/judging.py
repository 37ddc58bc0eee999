"""Which of the sentences that several listeners found in one piece of sound is right, and how likely that is.

Two logistic curves, fitted by `python -m benchmarks.opinions` to synthetic voices that the net was not trained on, to
people's digits, and to talk that addresses nobody.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from hvcpd.people.cepstra import Bands
from hvcpd.people.phones import Chances
from hvcpd.people.spelled import Spelled, Speller
from hvcpd.people.sphinx import Guess
from hvcpd.recognition.events import Recognised

Words = tuple[str, ...]

MOST_LOSS = 60.0
"""A sentence that loses so much more than another is none; how much more tells nothing."""
MOST_MISFIT, MOST_DEFICIT, MOST_LOGIT, MOST_LEAD = 8.0, 5.0, 9.2, 6.0
"""Beyond these, the listeners' own measures tell nothing either."""
LEAST_SPEECH_S = 0.2
URGENT = "stop"
MOST_CALL_WORDS = 3
""" "Team plant stop": an addressee and the word."""


@dataclass(frozen=True, eq=False)
class Views:
    """What listeners make of one piece of sound, `logs` and `chances` being what the net was given and found.

    `spelled` is the sentence that fits the phones best that a net heard, `guess` PocketSphinx's, `known` the one that
    is nearest to the words of enrolled people; None where there is none, or where nobody asked.
    """

    logs: Bands
    chances: Chances
    speller: Speller
    spelled: Spelled | None
    guess: Guess | None
    known: Recognised | None
    speech_s: float
    fits: dict[Words, Spelled | None] = field(default_factory=dict)
    """How other sentences than `spelled` fit, as far as that was asked for."""

    @property
    def sentences(self) -> list[Words]:
        """All that were found, each once."""
        found = (view.words for view in (self.spelled, self.guess, self.known) if view is not None)
        return list(dict.fromkeys(found))

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
    return Judged(words, 1.0 / (1.0 + math.exp(min(-logit, 500.0))))


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


SUPPORT = (-0.243, 3.97, -0.888, 3.11, -2.41, 0.414)
"""Weights of `supporting`."""
CHANCE = (0.687, -27, 2.36, -0.482, -0.266, -0.0968, 2.11, 0.409, 1.64, 0.168, -0.522, 0.268)
"""Weights of `evidence`."""


def support(views: Views, words: Words) -> float:
    """How much speaks for a sentence, beside others that were found; natural logarithm of odds."""
    return sum(weight * value for weight, value in zip(SUPPORT, supporting(views, words), strict=True))


def supporting(views: Views, words: Words) -> Sequence[float]:
    """What speaks for a sentence: what it loses; whether it is PocketSphinx's, and how badly it fits then; whether it
    is that of the enrolled, how far it is from their words then, and how sure."""
    out = [views.loss(words), 0.0, 0.0, 0.0, 0.0, 0.0]
    if views.guess is not None and views.guess.words == words:
        out[1:3] = 1.0, min(views.guess.misfit, MOST_MISFIT)
    if views.known is not None and views.known.words == words:
        out[3:] = 1.0, min(deficit_of(views.known), MOST_DEFICIT), _logit(views.known.confidence)
    return out


def evidence(views: Views, words: Words, lead: float) -> Sequence[float]:
    """What tells whether the likeliest sentence is right, `lead` more likely than the next: what it loses in a frame;
    whether PocketSphinx hears it or another, how badly it fits, and its pauses; whether the enrolled's listener hears
    it, and how sure it is; how many words, how fast, in how much speech."""
    n, speech_s = len(words), max(views.speech_s, LEAST_SPEECH_S)
    heard = [0.0] * 6
    if views.guess is not None:
        fit = (min(views.guess.misfit, MOST_MISFIT), views.guess.noise)
        heard[:4] = (1.0, 0.0, *fit) if alike(views.guess.words, words) else (0.0, 1.0, 0.0, 0.0)
    if views.known is not None and alike(views.known.words, words):
        heard[4:] = 1.0, _logit(views.known.confidence)
    each_frame = min(views.loss(words) / max(len(views.chances), 1), 1.0)
    return (1.0, each_frame, *heard, math.log(n), n / speech_s, math.log(speech_s), lead)


def deficit_of(known: Recognised) -> float:
    """The mean distance of a frame to the takes beyond that to the nearest frame."""
    lengths = [span.end_sample - span.start_sample for span in known.spans]
    return sum(n * span.deficit for n, span in zip(lengths, known.spans, strict=True)) / max(sum(lengths), 1)


def _logit(chance: float) -> float:
    chance = min(max(chance, 1e-9), 1.0 - 1e-9)
    return min(max(math.log(chance / (1.0 - chance)), -MOST_LOGIT), MOST_LOGIT)
