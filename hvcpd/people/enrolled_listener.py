"""Recognises enrolled people: the sentence nearest to the takes of their words, and its confidence.

Robots' speech is known to the sample; people's speech varies from one time to the next. So a whole segment of sound is
matched at once (`dtw`), by cepstra in the current noise, and the confidence has a curve of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.people.bands import quiet_mean
from hvcpd.people.dtw import FAR, Costs, OnePassDtw, Word
from hvcpd.people.enrolled import Person, spoken_takes
from hvcpd.recognition.events import Recognised, WordSpan
from hvcpd.recognition.fitted import curve, fitted
from hvcpd.recognition.frontend import CONTEXT_FRAMES, HOP_SAMPLES, Energies, energies_of, features_of
from hvcpd.recognition.network import Network
from hvcpd.recognition.scorer import distances, norms_of
from hvcpd.recognition.second_pass import Segment
from hvcpd.recognition.templates import Noise, TemplateBank, noise_features

AROUND_FRAMES = 30
"""0.3 s before and after what was noticed as speech, for its faint beginning and end."""
LEAST_GAIN = 1e-9

MOST_DEFICIT = 3.0
"""Largest deficit of the worst word; words that people swallow in right sentences have more."""
LEAST_MARGIN, MOST_MARGIN = 0.3, 100.0
"""Range of the cost of the closest other word; values beyond it carry no more information."""
LEAST_ABOVE_NOISE = 0.1
"""Distance: words that are not heard at all have less."""


@dataclass(frozen=True)
class MatchedWord:
    """A word, its frames `start` up to `end` of the segment, and its fit.

    `deficit`: the mean distance per frame to the take beyond that to the nearest frame of all takes. `margin`: the
    extra cost of the cheapest other word that leads to the same place at the same time.
    """

    word: str
    start: int
    end: int
    deficit: float
    margin: float


@dataclass(frozen=True)
class Match:
    """The best-fitting sentence, and its voice.

    `passed_over`: the mean distance of a frame outside the words to the room's noise, beyond that to the nearest frame
    of all takes: high where speech is taken for noise. `above_noise`: how much farther a frame of the words is from the
    noise than from the takes, in the mean: near 0 where words are taken for what cannot be heard.
    """

    voice: str
    words: tuple[MatchedWord, ...]
    passed_over: float
    above_noise: float


class EnrolledListener:
    """Matches sound with the sentences that the enrolled people's takes of words can form."""

    def __init__(self, graph: WordGraph, people: Iterable[Person]) -> None:
        """A person need not have all words. Raises ValueError if nobody has a word of `graph`."""
        takes = {person.voice: spoken_takes(person, graph.words) for person in people}
        self._bank = TemplateBank({voice: words for voice, words in takes.items() if words})
        self._net = Network(graph, self._bank.templates, partial=True)
        self._dtw = OnePassDtw(self._net)

    def nearest(self, segment: Segment) -> Recognised | None:
        """The sentence nearest to the segment, in samples of the segment's own clock, and its confidence; None where
        only noise is nearer."""
        energies = energies_of(np.asarray(segment.sound, np.float32))
        start = segment.lead // HOP_SAMPLES
        end = start + (segment.end - segment.start) // HOP_SAMPLES
        begin = max(start - AROUND_FRAMES, 0)
        if len(energies) <= begin:
            return None
        noise = np.asarray(quiet_mean(energies, start), np.float32)
        match = self.match(energies[begin : end + AROUND_FRAMES], noise)
        return _recognised(match, segment.origin + begin * HOP_SAMPLES) if match is not None else None

    def match(self, energies: Energies, noise: Noise) -> Match | None:
        """The sentence nearest to sound, shape (n, N_BANDS), which begins and ends with a little noise, of whose mean
        energies, shape (N_BANDS,), it is told; None if the sound is too short for any."""
        gain = max(self._bank.level_of(energies, noise), LEAST_GAIN)
        mask = self._bank.mask(gain)
        rows = self._bank.compose(self._dtw.rows, noise + mask, gain)
        padded = np.pad(energies + mask, ((CONTEXT_FRAMES, CONTEXT_FRAMES), (0, 0)), mode="edge")
        heard, norms = features_of(padded), norms_of(rows)
        silence = noise_features(noise + mask)[None, :]
        to_noise = distances(heard, silence, norms_of(silence))[:, 0]
        ends = self._dtw.forward(lambda begin, end: distances(heard[begin:end], rows, norms), to_noise)
        finals = np.flatnonzero(self._net.is_final)
        node = int(finals[ends.rest[-1, finals].argmin()])
        if ends.rest[-1, node] >= FAR / 2:
            return None
        path = self._dtw.trace(ends, node)
        return self._matched(self._net.voice_of_node(node), path, to_noise, np.minimum(ends.nearest, to_noise))

    def _matched(self, voice: str, path: Iterable[Word], to_noise: Costs, least: Costs) -> Match:
        """`least`: each frame's distance to the nearest of the takes' frames and the noise."""
        words, inside, cost = [], np.zeros(len(to_noise), np.bool_), 0.0
        for word in path:
            deficit = (word.cost - float(least[word.start : word.end].sum())) / (word.end - word.start)
            words.append(MatchedWord(self._net.word[word.instance], word.start, word.end, deficit, word.margin))
            inside[word.start : word.end] = True
            cost += word.cost
        beyond = (to_noise - least)[~inside]
        passed_over = float(beyond.mean()) if len(beyond) else 0.0
        above_noise = (float(to_noise[inside].sum()) - cost) / max(int(inside.sum()), 1)
        return Match(voice, tuple(words), passed_over, above_noise)


def probability(match: Match) -> float:
    """Confidence of a sentence, 0 to 1: a logistic curve (`enrolled_confidence` of the fitted weights)."""
    frames = [word.end - word.start for word in match.words]
    deficit = sum(n * word.deficit for n, word in zip(frames, match.words, strict=True)) / sum(frames)
    worst = min(max(word.deficit for word in match.words), MOST_DEFICIT)
    margin = min(max(min(word.margin for word in match.words), LEAST_MARGIN), MOST_MARGIN)
    audible = math.log(max(match.above_noise, LEAST_ABOVE_NOISE))
    features = (deficit, worst, match.passed_over, math.log(len(match.words)), math.log(margin), audible)
    weights = fitted("enrolled_confidence")
    return curve(weights["bias"], weights["weights"].values(), features)


def _recognised(match: Match, origin: int) -> Recognised:
    sure = probability(match)
    spans = tuple(
        WordSpan(w.word, origin + w.start * HOP_SAMPLES, origin + w.end * HOP_SAMPLES, sure) for w in match.words
    )
    words = tuple(span.word for span in spans)
    return Recognised(words, match.voice, spans[0].start_sample, spans[-1].end_sample, sure, math.inf, spans)
