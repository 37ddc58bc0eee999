"""Hears enrolled people: the sentence that is nearest to the takes of their words, and how likely that is right.

What robots say is known to the sample; what people say is not, from one time to the next. So a whole piece of sound is
matched at once (`matching`), and how sure a sentence is follows from a curve of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.people.ears import Piece
from hvcpd.people.enrolled import Person, spoken_takes
from hvcpd.people.matching import Match, Matcher
from hvcpd.recognition.events import Recognised, WordSpan
from hvcpd.recognition.frontend import HOP_SAMPLES, Energies, energies_of
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
"""Costs of the closest other word; more or less tells no more."""
LEAST_ABOVE_NOISE = 0.1
"""Distance: words that are not heard at all have less."""


class EnrolledListener:
    """Knows the enrolled people, and their sentences."""

    def __init__(self, graph: WordGraph, people: Iterable[Person]) -> None:
        """Raises ValueError if nobody has a word of `graph`."""
        takes = {person.voice: spoken_takes(person, graph.words) for person in people}
        self._matcher = Matcher(graph, {voice: words for voice, words in takes.items() if words})

    def sentence(self, piece: Piece) -> Recognised | None:
        """The sentence that is nearest to the piece, at the samples of its own clock, and how likely it is right; None
        where nothing but noise is nearer."""
        energies = energies_of(np.asarray(piece.sound, np.float32))
        start = piece.lead // HOP_SAMPLES
        end = start + (piece.end - piece.start) // HOP_SAMPLES
        begin = max(start - AROUND_FRAMES, 0)
        if len(energies) <= begin:
            return None
        match = self._matcher.match(energies[begin : end + AROUND_FRAMES], _noise(energies, start))
        return None if match is None or not match.words else _recognised(match, piece.origin + begin * HOP_SAMPLES)


def _noise(energies: Energies, start: int) -> Noise:
    """Mean energies, shape (N_BANDS,), of the noise before the speech that begins at frame `start`; of the quietest
    frames of all where there is nothing before it."""
    before = energies[: start - BEFORE_FRAMES] if start > 2 * BEFORE_FRAMES else energies
    power = before.sum(axis=1)
    share = QUIETER if start > 2 * BEFORE_FRAMES else 1.0 - QUIETER
    return np.asarray(before[power <= np.quantile(power, share)].mean(axis=0), np.float32)


def chance(match: Match) -> float:
    """How likely a sentence is right, 0 to 1: a logistic curve.

    Fitted to 146 pieces of sound: fluent sentences and short calls of nine synthetic voices, each with its own takes or
    another's, and people's and synthetic talk that addresses nobody. Of 80 right ones 75 have 0.8 or more, of 66 wrong
    ones one.
    """
    frames = [word.end - word.start for word in match.words]
    deficit = sum(n * word.deficit for n, word in zip(frames, match.words, strict=True)) / sum(frames)
    worst = min(max(word.deficit for word in match.words), MOST_DEFICIT)
    margin = min(max(min(word.margin for word in match.words), LEAST_MARGIN), MOST_MARGIN)
    audible = math.log(max(match.above_noise, LEAST_ABOVE_NOISE))
    fits = -0.21 - 3.27 * deficit - 1.36 * worst - 6.6 * match.passed_over
    logit = fits + 2.15 * math.log(len(match.words)) + 1.15 * math.log(margin) + 1.74 * audible
    return 1.0 / (1.0 + math.exp(min(-logit, 500.0)))


def _recognised(match: Match, origin: int) -> Recognised:
    sure = chance(match)
    spans = tuple(
        WordSpan(w.word, origin + w.start * HOP_SAMPLES, origin + w.end * HOP_SAMPLES, sure, w.deficit)
        for w in match.words
    )
    words = tuple(span.word for span in spans)
    return Recognised(words, match.voice, spans[0].start_sample, spans[-1].end_sample, sure, math.inf, spans)
