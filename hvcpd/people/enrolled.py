"""Enrolled people: sentences and words of theirs as mel energies, all that the recogniser needs of recordings; and the
sentence nearest to the takes of their words, with its confidence.

A person's words vary from one time to the next, so a whole segment of sound is matched at once, by cepstra in the
current noise, and the confidence has a logistic curve of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.people.bands import LogBands, mean_of_quiet_frames
from hvcpd.recognition.arrays import quantile
from hvcpd.recognition.decoder import BestPath, Decoder, StepCosts, TracedWord
from hvcpd.recognition.decoder_session import LEAST_MARGIN
from hvcpd.recognition.events import Recognised, Source
from hvcpd.recognition.fitted import fitted_probability
from hvcpd.recognition.frontend import CONTEXT_FRAMES, HOP_SAMPLES, SILENT_POWER, Energies, energies_of, features_of
from hvcpd.recognition.network import MAX_ADVANCE, PADDING, Beam, Costs, Network
from hvcpd.recognition.stages import Segment
from hvcpd.recognition.templates import Noise, TemplateBank, distances, noise_features, norms_of

MAX_TAKES = 6
"""Maximum number of takes of one word, the newest: each is one more path wherever its word may come."""
MAX_SENTENCES = 20
"""Kept, the newest: more than that improve the phone net no further, and each is to be aligned anew at a start."""

STRANGER = "stranger"
"""Voice name of a speaker who is neither a robot nor known by takes."""

Takes = Mapping[str, Sequence[Energies]]
"""For each word, in lower case, its takes: shape (frames, N_BANDS), without the silence around them."""


@dataclass(frozen=True, eq=False)
class SpokenSentence:
    """A sentence whose words are certain: `logs`, the inputs of the phone nets, shape (frames, bands)."""

    words: tuple[str, ...]
    logs: LogBands


@dataclass(frozen=True, eq=False)
class Person:
    """A person's name, as written, takes of words, and sentences."""

    name: str
    takes: Takes = field(default_factory=dict)
    sentences: tuple[SpokenSentence, ...] = ()

    @property
    def voice(self) -> str:
        """The recogniser's name for this voice: only takes tell it from others."""
        return voice_of(self.name) if self.takes else STRANGER

    def with_takes(self, more: Takes) -> Person:
        """The same with more takes, the oldest beyond MAX_TAKES of a word left out."""
        known = {word: [*self.takes.get(word, ()), *new][-MAX_TAKES:] for word, new in more.items()}
        return replace(self, takes={**self.takes, **known})

    def with_sentences(self, more: Iterable[SpokenSentence]) -> Person:
        """The same with more sentences, the oldest beyond MAX_SENTENCES left out."""
        return replace(self, sentences=(*self.sentences, *more)[-MAX_SENTENCES:])


ENROLLED = ", enrolled"
"""The end of the names of enrolled people's voices; no synthesizer's has a comma."""


def voice_of(name: str) -> str:
    """The recogniser's name for an enrolled person's voice."""
    return f"{name.lower()}{ENROLLED}"


def is_of_person(voice: str) -> bool:
    """Whether the recogniser's name for a voice is not a robot's."""
    return voice == STRANGER or voice.endswith(ENROLLED)


def spoken_takes(person: Person, words: Iterable[str]) -> dict[str, list[Energies]]:
    """The person's takes of `words`, all equally loud: people do not keep their loudness from word to word."""
    return {word: [level_normalised(take) for take in person.takes[word]] for word in words if word in person.takes}


def level_normalised(energies: Energies) -> Energies:
    """The take with a mean power of 1 in the louder half of its frames."""
    power = energies.sum(axis=1)
    out: Energies = energies / power[power >= quantile(power, 0.5)].mean()
    return out


TAKE_STEPS = StepCosts(skip=0.6, leap=1.2)
"""People's digits, cross-validated over takes: 237 of 240 right with this skip, 234 with 0.3; fluent sentences of nine
synthetic voices: 87 of 90, with 0.3 88, with 0.8 86. Fluent words are shorter than takes: without leaps 44 instead of
50 of 60 sentences by three such voices are right, and 221 instead of 217 of 240 digits."""
TAKE_BEAM = Beam(width=120.0, above_filler=30.0, max_pairs=150)
"""A path may cost as much more than another one as half a second of wrong sounds. With 60 more than the filler, and 300
pairs, the same of 300 digits and sentences are right, in a third more time."""
BLOCK_FRAMES = MAX_ADVANCE // PADDING
"""Number of frames between two prunings, in which a path advances by MAX_ADVANCE at most, PADDING a frame."""

MOST_DEFICIT = 3.0
"""Largest deficit of the worst word; words that people swallow in right sentences have more."""
MOST_TAKE_MARGIN = 100.0
"""Largest cost of the closest other word, and LEAST_MARGIN the smallest, that carry information."""
LEAST_ABOVE_NOISE = 0.1
"""Distance: words that are not heard at all have less."""


class EnrolledRecogniser:
    """Matches sound with the sentences that the enrolled people's takes of words can form."""

    def __init__(self, graph: WordGraph, people: Iterable[Person]) -> None:
        """A person need not have all words. Raises ValueError if nobody has a word of `graph`."""
        takes = {person.voice: spoken_takes(person, graph.words) for person in people}
        self._bank = TemplateBank({voice: words for voice, words in takes.items() if words})
        self._net = Network(graph, self._bank.templates, partial=True)

    def recognise(self, segment: Segment) -> Recognised | None:
        """The sentence nearest to the segment, in samples of the segment's own clock, and its confidence; None where
        only noise is nearer."""
        energies = energies_of(segment.speech)
        if not len(energies):
            return None
        noise = mean_of_quiet_frames(energies_of(segment.sound), segment.lead // HOP_SAMPLES)
        return self.match(energies, np.asarray(noise, np.float32), segment.speech_start)

    def match(self, energies: Energies, noise: Noise, origin: int = 0) -> Recognised | None:
        """The sentence nearest to sound, shape (n, N_BANDS), from sample `origin` on, which begins and ends with a
        little noise of mean energies `noise`, shape (N_BANDS,); None if the sound is too short for any."""
        gain = max(self._bank.level_of(energies, noise), SILENT_POWER)
        mask = self._bank.mask(gain)
        rows = self._bank.compose(np.arange(self._bank.n_frames), noise + mask, gain)
        padded = np.pad(energies + mask, ((CONTEXT_FRAMES, CONTEXT_FRAMES), (0, 0)), mode="edge")
        heard, norms = features_of(padded), norms_of(rows)
        silence = noise_features(noise + mask)[None, :]
        to_noise = distances(heard, silence, norms_of(silence))[:, 0]
        nearest = np.empty_like(to_noise)
        decoder = Decoder(self._net, 1, TAKE_BEAM, TAKE_STEPS)
        for begin in range(0, len(heard), BLOCK_FRAMES):
            frames = slice(begin, begin + BLOCK_FRAMES)
            to_rows = distances(heard[frames], rows, norms)
            nearest[frames] = to_rows.min(axis=1)
            relative = to_rows[:, decoder.prune().row] - to_noise[frames, None]
            for column in relative:
                decoder.advance(column, 0.0)
        best = decoder.best(math.inf)
        if best.node < 0:
            return None
        return self._recognised(best, decoder.trace(best.token), to_noise, np.minimum(nearest, to_noise), origin)

    def _recognised(
        self, best: BestPath, path: Sequence[TracedWord], to_noise: Costs, least: Costs, origin: int
    ) -> Recognised:
        """`path` costs less than the noise would in its place; `least`: each frame's distance to the nearest of the
        takes' frames and the noise."""
        deficits, inside = [], np.zeros(len(to_noise), np.bool_)
        for step in path:
            frames = slice(step.start_frame, step.end_frame)
            cost = step.cost + float(to_noise[frames].sum())
            deficits.append((cost - float(least[frames].sum())) / (step.end_frame - step.start_frame))
            inside[frames] = True
        beyond = (to_noise - least)[~inside]
        passed_over = float(beyond.mean()) if len(beyond) else 0.0
        sure = probability(path, deficits, passed_over, -best.cost / int(inside.sum()))
        spans = [step.span(self._net.word[step.instance], sure, origin) for step in path]
        return Recognised.of(spans, self._net.voice_of_node(best.node), sure, Source.PEOPLE)


def probability(path: Sequence[TracedWord], deficits: Sequence[float], passed_over: float, above_noise: float) -> float:
    """Confidence of a sentence, 0 to 1: a logistic curve (`enrolled_confidence` of the fitted weights).

    `deficits`: each word's mean distance per frame to the take beyond that to the nearest frame of all takes.
    `passed_over`: the mean distance of a frame outside the words to the room's noise, beyond that to the nearest frame
    of all takes: high where speech is taken for noise. `above_noise`: how much farther a frame of the words is from the
    noise than from the takes, in the mean: near 0 where words are taken for what cannot be heard.
    """
    frames = [step.end_frame - step.start_frame for step in path]
    deficit = sum(n * each for n, each in zip(frames, deficits, strict=True)) / sum(frames)
    worst = min(max(deficits), MOST_DEFICIT)
    margin = min(max(min(step.margin for step in path), LEAST_MARGIN), MOST_TAKE_MARGIN)
    audible = math.log(max(above_noise, LEAST_ABOVE_NOISE))
    features = (deficit, worst, passed_over, math.log(len(path)), math.log(margin), audible)
    return fitted_probability("enrolled_confidence", features)
