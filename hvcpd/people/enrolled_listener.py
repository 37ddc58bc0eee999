"""Recognises enrolled people: the sentence nearest to the takes of their words, and its confidence.

Robots' speech is known to the sample; people's speech varies from one time to the next. So a whole segment of sound is
matched at once (`template_decoder`), and the confidence has a curve of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.people.bands import Bands
from hvcpd.people.enrolled import Person, spoken_takes
from hvcpd.people.phones import NetOutput
from hvcpd.people.take_features import SHARED, ComposedTakes, FeatureCache, TandemTakes
from hvcpd.people.template_decoder import Hearing, Match, TemplateDecoder
from hvcpd.recognition.confidence import logistic
from hvcpd.recognition.events import Recognised, WordSpan
from hvcpd.recognition.fitted import fitted
from hvcpd.recognition.frontend import HOP_SAMPLES, Energies, energies_of
from hvcpd.recognition.second_look import Piece
from hvcpd.recognition.templates import Noise

AROUND_FRAMES = 30
"""0.3 s before and after what was noticed as speech, for its faint beginning and end."""
BEFORE_FRAMES = 20
"""0.2 s right before the speech may already be its faint beginning: they tell nothing of the noise."""
QUIETER = 0.7
"""The quieter part of the frames before the speech, which tells its noise: somebody may have spoken before."""

MOST_DEFICIT = 3.0
"""Of the worst word: words that people swallow in a sentence that is right have more."""
LEAST_MARGIN, MOST_MARGIN = 0.3, 100.0
"""Range of the cost of the closest other word; values beyond it carry no more information."""
LEAST_ABOVE_NOISE = 0.1
"""Distance: words that are not heard at all have less."""


@dataclass(frozen=True, eq=False)
class Known:
    """Results of the enrolled people's templates for one segment of sound.

    `nearest`: the nearest sentence by cepstra, in the current noise, and its confidence; `tandem`: the nearest one by
    tandem features; None where there is none, or none was requested. `votes`: the cost of a sentence by either feature,
    None if nobody has its words.
    """

    nearest: Recognised | None
    tandem: tuple[str, ...] | None
    votes: Callable[[tuple[str, ...]], tuple[float, float] | None]


class EnrolledListener:
    """Matches sound with the sentences of the enrolled people."""

    def __init__(self, graph: WordGraph, people: Iterable[Person], features: FeatureCache = SHARED) -> None:
        """`features`: the tandem features of takes. Raises ValueError if nobody has a word of `graph`."""
        takes = {person.voice: spoken_takes(person, graph.words) for person in people}
        self._graph = graph
        self._features = features
        self._takes = {voice: words for voice, words in takes.items() if words}
        self._composed = ComposedTakes(self._takes)
        self._matcher = TemplateDecoder(graph, self._composed.templates)

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Compute the tandem features of the takes, as long as `go_on` holds; otherwise they are computed when first
        needed."""
        for take in (take for words in self._takes.values() for of_word in words.values() for take in of_word):
            if not go_on():
                return
            self._features.of(take)
        _ = self._tandem

    @cached_property
    def _tandem(self) -> tuple[TandemTakes, TemplateDecoder]:
        tandem = TandemTakes(self._takes, self._features)
        return tandem, TemplateDecoder(self._graph, tandem.templates)

    def nearest(self, piece: Piece) -> Recognised | None:
        """The sentence nearest to the segment, in samples of the segment's own clock, and its confidence; None where
        only noise is nearer."""
        hearing, origin = self._heard(piece)
        return _recognised(hearing, origin)

    def known(self, piece: Piece, logs: Bands, output: NetOutput) -> Known:
        """Likewise, together with the tandem result for the segment's `logs`, shape (frames, N_BANDS)."""
        hearing, origin = self._heard(piece)
        tandem, matcher = self._tandem
        by_net = matcher.hear(tandem.hear(logs, output)) if len(logs) else None

        def votes(words: tuple[str, ...]) -> tuple[float, float] | None:
            if hearing is None or by_net is None:
                return None
            both = hearing.vote(words), by_net.vote(words)
            return None if both[0] is None or both[1] is None else (both[0], both[1])

        return Known(_recognised(hearing, origin), by_net.best if by_net is not None else None, votes)

    def _heard(self, piece: Piece) -> tuple[Hearing | None, int]:
        """The segment's cepstra, and the sample at which they begin; None if it is too short."""
        energies = energies_of(np.asarray(piece.sound, np.float32))
        start = piece.lead // HOP_SAMPLES
        end = start + (piece.end - piece.start) // HOP_SAMPLES
        begin = max(start - AROUND_FRAMES, 0)
        origin = piece.origin + begin * HOP_SAMPLES
        if len(energies) <= begin:
            return None, origin
        heard = self._composed.hear(energies[begin : end + AROUND_FRAMES], _noise(energies, start))
        return self._matcher.hear(heard), origin


def _noise(energies: Energies, start: int) -> Noise:
    """Mean energies, shape (N_BANDS,), of the noise before the speech that begins at frame `start`; of the quietest
    frames of all where there is nothing before it."""
    before = energies[: start - BEFORE_FRAMES] if start > 2 * BEFORE_FRAMES else energies
    power = before.sum(axis=1)
    share = QUIETER if start > 2 * BEFORE_FRAMES else 1.0 - QUIETER
    return np.asarray(before[power <= np.quantile(power, share)].mean(axis=0), np.float32)


def probability(match: Match) -> float:
    """Confidence of a sentence, 0 to 1: a logistic curve (`enrolled_confidence` of the fitted weights)."""
    frames = [word.end - word.start for word in match.words]
    deficit = sum(n * word.deficit for n, word in zip(frames, match.words, strict=True)) / sum(frames)
    worst = min(max(word.deficit for word in match.words), MOST_DEFICIT)
    margin = min(max(min(word.margin for word in match.words), LEAST_MARGIN), MOST_MARGIN)
    audible = math.log(max(match.above_noise, LEAST_ABOVE_NOISE))
    features = (deficit, worst, match.passed_over, math.log(len(match.words)), math.log(margin), audible)
    curve = fitted("enrolled_confidence")
    return logistic(curve["bias"] + sum(w * x for w, x in zip(curve["weights"].values(), features, strict=True)))


def _recognised(hearing: Hearing | None, origin: int) -> Recognised | None:
    match = hearing.match if hearing is not None else None
    if match is None or not match.words:
        return None
    sure = probability(match)
    spans = tuple(
        WordSpan(w.word, origin + w.start * HOP_SAMPLES, origin + w.end * HOP_SAMPLES, sure, w.deficit)
        for w in match.words
    )
    words = tuple(span.word for span in spans)
    return Recognised(words, match.voice, spans[0].start_sample, spans[-1].end_sample, sure, math.inf, spans)
