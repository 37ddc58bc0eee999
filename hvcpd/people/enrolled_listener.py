"""Recognises enrolled people: the sentence nearest to the takes of their words, and its confidence.

Robots' speech is known to the sample; people's speech varies from one time to the next. So a whole segment of sound is
matched at once, by cepstra in the current noise, and the confidence has a curve of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.people.bands import quiet_mean
from hvcpd.people.enrolled import Person, spoken_takes
from hvcpd.recognition.decoder import Best, Decoder, StepCosts
from hvcpd.recognition.events import Recognised, WordSpan
from hvcpd.recognition.fitted import curve, fitted
from hvcpd.recognition.frontend import CONTEXT_FRAMES, HOP_SAMPLES, Energies, energies_of, features_of
from hvcpd.recognition.lattice import Costs, Step
from hvcpd.recognition.network import REACH, Beam, Network
from hvcpd.recognition.scorer import distances, norms_of
from hvcpd.recognition.second_pass import Segment
from hvcpd.recognition.templates import Noise, TemplateBank, noise_features

AROUND_FRAMES = 30
"""0.3 s before and after what was noticed as speech, for its faint beginning and end."""
LEAST_GAIN = 1e-9
STEPS = StepCosts(skip=0.6, leap=1.2)
"""People's digits, cross-validated over takes: 237 of 240 right with this skip, 234 with 0.3; fluent sentences of nine
synthetic voices: 87 of 90, with 0.3 88, with 0.8 86. Fluent words are shorter than takes: without leaps 44 instead of
50 of 60 sentences by three such voices are right, and 221 instead of 217 of 240 digits."""
BEAM = Beam(width=120.0, above_filler=30.0, max_pairs=150)
"""A path may cost as much more than another one as half a second of wrong sounds. With 60 more than the filler, and 300
pairs, the same of 300 digits and sentences are right, in a third more time."""
BLOCK_FRAMES = REACH // 3
"""Number of frames between two prunings, in which a path advances by REACH at most."""

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
        rows = self._bank.compose(np.arange(self._bank.n_frames), noise + mask, gain)
        padded = np.pad(energies + mask, ((CONTEXT_FRAMES, CONTEXT_FRAMES), (0, 0)), mode="edge")
        heard, norms = features_of(padded), norms_of(rows)
        silence = noise_features(noise + mask)[None, :]
        to_noise = distances(heard, silence, norms_of(silence))[:, 0]
        nearest = np.empty_like(to_noise)
        decoder = Decoder(self._net, 1, BEAM, STEPS)
        for begin in range(0, len(heard), BLOCK_FRAMES):
            frames = slice(begin, begin + BLOCK_FRAMES)
            to_rows = distances(heard[frames], rows, norms)
            nearest[frames] = to_rows.min(axis=1)
            relative = to_rows[:, decoder.prepare().row] - to_noise[frames, None]
            for column in relative:
                decoder.column(column, 0.0)
        best = decoder.best(math.inf)
        if best.node < 0:
            return None
        return self._matched(best, decoder.trace(best.token), to_noise, np.minimum(nearest, to_noise))

    def _matched(self, best: Best, path: Sequence[Step], to_noise: Costs, least: Costs) -> Match:
        """`path` costs less than the noise would in its place; `least`: each frame's distance to the nearest of the
        takes' frames and the noise."""
        words, inside = [], np.zeros(len(to_noise), np.bool_)
        for step in path:
            frames = slice(step.start_frame, step.end_frame)
            cost = step.cost + float(to_noise[frames].sum())
            deficit = (cost - float(least[frames].sum())) / (step.end_frame - step.start_frame)
            word = self._net.word[step.instance]
            words.append(MatchedWord(word, step.start_frame, step.end_frame, deficit, step.margin))
            inside[frames] = True
        beyond = (to_noise - least)[~inside]
        passed_over = float(beyond.mean()) if len(beyond) else 0.0
        above_noise = -best.cost / max(int(inside.sum()), 1)
        return Match(self._net.voice_of_node(best.node), tuple(words), passed_over, above_noise)


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
