"""Recognises enrolled people: the sentence nearest to the takes of their words, and its confidence.

Robots' speech is known to the sample; people's speech varies from one time to the next. So a whole segment of sound is
matched at once (`template_decoder`), and the confidence has a curve of its own.

A segment is compared with takes by cepstra in the current noise, and by tandem features: a net that was trained to tell
the sounds of a language apart gives better features than cepstra even where it names the sounds wrongly (H. Hermansky,
D. Ellis & S. Sharma, "Tandem connectionist feature extraction for conventional HMM systems", ICASSP 2000; T. Hazen, W.
Shen & C. White, "Query-by-example spoken term detection using phonetic posteriorgram templates", ASRU 2009). The noise
of the moment is not in tandem features.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.graph import WordGraph
from hvcpd.people.bands import Bands, heard_alone, quiet_mean, stored
from hvcpd.people.enrolled import Person, spoken_takes
from hvcpd.people.phones import NetOutput, centred, phones_of
from hvcpd.people.template_decoder import Hearing, Match, TemplateDecoder
from hvcpd.recognition.events import Recognised, WordSpan
from hvcpd.recognition.fitted import curve, fitted
from hvcpd.recognition.frontend import CONTEXT_FRAMES, HOP_SAMPLES, N_BANDS, Energies, Features, energies_of
from hvcpd.recognition.frontend import features_of as cepstral_features_of
from hvcpd.recognition.scorer import distances, norms_of
from hvcpd.recognition.second_pass import Segment
from hvcpd.recognition.templates import Noise, Template, TemplateBank, noise_features

SILENCE_FRAMES = 30
"""Frames of silence around a take: the net's receptive field."""
ACTIVATIONS, POSTERIORS = 8.9, 10.0
"""Weights of the directions of the net's activations and of the roots of its posteriors, whose distances are
Hellinger's: about as much counts the one as the other, and what is unlike is as far apart as with cepstra in the same
time."""
QUIET_SHARE = 8
"""Share of the frames (one in 8), the quietest, whose mean features stand for the room's noise."""
LEAST_QUIET = 5
TAKES_KEPT = 6000
"""Takes whose features are kept, 9 kB each, those of ten people. A PC needs 2 ms for one, a Raspberry Pi several times
that: they are not computed again when another word or name is learned."""


@cache
def _axes() -> Features:
    """The principal axes of the directions, shape (width of the activations, 64), by `benchmarks/take_bands.py`: as
    many digits are right with them as with all 192 dimensions, in half the memory."""
    return np.asarray(stored("tandem.npz")["axes"], np.float32)


def directions_of(activations: Features) -> Features:
    """Rows scaled to length 1, shape (frames, width)."""
    return np.asarray(activations / np.maximum(np.linalg.norm(activations, axis=1, keepdims=True), 1e-6), np.float32)


def features_of(output: NetOutput) -> Features:
    """Tandem features of the net's output for a segment, shape (frames, width)."""
    directions = directions_of(output.activations) @ _axes()
    return np.concatenate([ACTIVATIONS * directions, POSTERIORS * np.exp(output.log_posteriors / 2.0)], axis=1)


def features_of_take(take: Energies) -> Features:
    """Tandem features of a take, shape (half its frames, rounded up; width)."""
    return _features_of(np.ascontiguousarray(take, np.float32).tobytes()).astype(np.float32)


@lru_cache(TAKES_KEPT)
def _features_of(take: bytes) -> NDArray[np.float16]:
    energies = np.frombuffer(take, np.float32).reshape(-1, N_BANDS)
    found = features_of(phones_of(centred(heard_alone(energies, SILENCE_FRAMES))))
    begin = SILENCE_FRAMES // 2
    return found[begin : begin + (len(energies) + 1) // 2].astype(np.float16)


VoiceTakes = Mapping[str, Mapping[str, Sequence[Energies]]]
"""For each voice and word, its takes, without noise."""


class TandemTakes:
    """Takes of words in one or more voices, to be compared with sound by tandem features."""

    def __init__(self, graph: WordGraph, takes: VoiceTakes) -> None:
        """Raises ValueError without takes of the graph's words."""
        said = [(v, w, take) for v, words in takes.items() for w, of_word in words.items() for take in of_word]
        if not said:
            raise ValueError("no templates")
        templates: list[Template] = []
        rows = [features_of_take(take) for _, _, take in said]
        first = 0
        for (voice, word, _), features in zip(said, rows, strict=True):
            templates.append(Template(voice, word, first, len(features)))
            first += len(features)
        self._decoder = TemplateDecoder(graph, templates)
        self._rows: Features = np.concatenate(rows)

    def hear(self, logs: Bands, output: NetOutput) -> Hearing:
        """A segment of sound beside the takes: its `logs`, shape (frames, N_BANDS), and what the net makes of them."""
        features = features_of(output)
        level = logs.mean(axis=1)[::2]
        quiet = np.argsort(level)[: max(len(level) // QUIET_SHARE, LEAST_QUIET)]
        noise = features[quiet].mean(axis=0, keepdims=True)
        return Hearing(self._decoder, features, self._rows, distances(features, noise, norms_of(noise))[:, 0])


LEAST_GAIN = 1e-9


class ComposedTakes:
    """Takes of words in one or more voices, to be compared with sound by cepstra in its noise."""

    def __init__(self, graph: WordGraph, takes: VoiceTakes) -> None:
        """Raises ValueError without takes of the graph's words."""
        self._bank = TemplateBank(takes)
        self._decoder = TemplateDecoder(graph, self._bank.templates)

    def hear(self, energies: Energies, noise: Noise) -> Hearing:
        """A segment of sound, of whose noise the mean energies, shape (N_BANDS,), are known, beside the takes.

        `energies`, shape (n, N_BANDS), begin and end with a little noise.
        """
        gain = max(self._bank.level_of(energies, noise), LEAST_GAIN)
        mask = self._bank.mask(gain)
        rows = self._bank.compose(np.arange(self._bank.n_frames), noise + mask, gain)
        padded = np.pad(energies + mask, ((CONTEXT_FRAMES, CONTEXT_FRAMES), (0, 0)), mode="edge")
        heard = cepstral_features_of(padded)
        silence = noise_features(noise + mask)[None, :]
        to_noise = distances(heard, silence, norms_of(silence))[:, 0]
        return Hearing(self._decoder, heard, rows, to_noise)


AROUND_FRAMES = 30
"""0.3 s before and after what was noticed as speech, for its faint beginning and end."""

MOST_DEFICIT = 3.0
"""Largest deficit of the worst word; words that people swallow in right sentences have more."""
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

    def __init__(self, graph: WordGraph, people: Iterable[Person]) -> None:
        """Raises ValueError if nobody has a word of `graph`."""
        takes = {person.voice: spoken_takes(person, graph.words) for person in people}
        self._graph = graph
        self._takes = {voice: words for voice, words in takes.items() if words}
        self._composed = ComposedTakes(graph, self._takes)

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Compute the tandem features of the takes, as long as `go_on` holds; otherwise they are computed when first
        needed."""
        for take in (take for words in self._takes.values() for of_word in words.values() for take in of_word):
            if not go_on():
                return
            features_of_take(take)
        _ = self._tandem

    @cached_property
    def _tandem(self) -> TandemTakes:
        return TandemTakes(self._graph, self._takes)

    def nearest(self, segment: Segment) -> Recognised | None:
        """The sentence nearest to the segment, in samples of the segment's own clock, and its confidence; None where
        only noise is nearer."""
        hearing, origin = self._heard(segment)
        return _recognised(hearing, origin)

    def known(self, segment: Segment, logs: Bands, output: NetOutput) -> Known:
        """The nearest sentence by cepstra and by tandem features of the segment's `logs`, shape (frames, N_BANDS)."""
        hearing, origin = self._heard(segment)
        by_net = self._tandem.hear(logs, output) if len(logs) else None

        def votes(words: tuple[str, ...]) -> tuple[float, float] | None:
            if hearing is None or by_net is None:
                return None
            both = hearing.vote(words), by_net.vote(words)
            return None if both[0] is None or both[1] is None else (both[0], both[1])

        return Known(_recognised(hearing, origin), by_net.best if by_net is not None else None, votes)

    def _heard(self, segment: Segment) -> tuple[Hearing | None, int]:
        """The segment's cepstra, and the sample at which they begin; None if it is too short."""
        energies = energies_of(np.asarray(segment.sound, np.float32))
        start = segment.lead // HOP_SAMPLES
        end = start + (segment.end - segment.start) // HOP_SAMPLES
        begin = max(start - AROUND_FRAMES, 0)
        origin = segment.origin + begin * HOP_SAMPLES
        if len(energies) <= begin:
            return None, origin
        noise = np.asarray(quiet_mean(energies, start), np.float32)
        return self._composed.hear(energies[begin : end + AROUND_FRAMES], noise), origin


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
