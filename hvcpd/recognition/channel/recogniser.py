"""The channel recogniser: sentences of robots in a segment of sound, through unknown channels.

Sentences are found, verified and subtracted one after the other, and the residual is searched again."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hvcpd.language.addressees import GREETING
from hvcpd.language.graph import WordGraph
from hvcpd.ports import Samples, samples_in
from hvcpd.recognition.channel.endpoints import Onset, OnsetDetector
from hvcpd.recognition.channel.estimation import MAX_SHIFT, Signal, WhitenedSound, blocks_of
from hvcpd.recognition.channel.known import KnownResponse
from hvcpd.recognition.channel.path import Path, RenderedVoice
from hvcpd.recognition.channel.search import (
    MAX_STARTS,
    ROBOT_SCORE,
    ChannelSearch,
    ChannelSegment,
    SearchResult,
    by_score,
)
from hvcpd.recognition.channel.whitening import FRAME
from hvcpd.recognition.events import Received, Recognised, Source, WordSpan
from hvcpd.recognition.fitted import fitted_probability
from hvcpd.recognition.stages import GOES_ON_WITHIN

LEAST_ENERGY, LEAST_PRECEDING_SHARE = 60.0, 0.02
"""Expected energy of a word, in variances of the noise, from which on its absence shows, by 8 standard deviations; and
energy explained by a word right before a sentence in the same voice, with its share of what the sentence explains, from
which on it was said: chance reached 22 in 46 sentences, a soft "will" had 78."""
MISSING_WORD_FIT = 0.2
"""Share of a word's expected energy below which it was not said: 6 standard deviations where LEAST_ENERGY holds."""
MOST_LEAD_SHARE = 0.6
"""Largest lead that carries information, as a share of a sentence's score."""


@dataclass(frozen=True)
class Evidence:
    """Evidence for a sentence: its `lead` in explained energy over any other path that lacks no word, at most
    MOST_LEAD_SHARE of its score, and the `fit` of its worst word."""

    path: Path
    lead: float
    fit: float

    @property
    def features(self) -> tuple[float, ...]:
        """Features of `confidence`: log lead (at least 0), fit (at most 1), and log number of words, since a long
        sentence rarely resembles other sound."""
        return (math.log(max(self.lead, 1.0)), min(self.fit, 1.0), math.log(len(self.path.words)))

    @property
    def confidence(self) -> float:
        """The probability, 0 to 1, that the sentence is right: logistic regression, fitted by `python -m
        benchmarks.fit --only channel_confidence`."""
        return fitted_probability("channel_confidence", self.features)


@dataclass(frozen=True, eq=False)
class _SignalPart:
    """A part of a known signal."""

    length: int
    samples: Samples


def worst_fit(sound: WhitenedSound, path: Path) -> float:
    """Ratio of received to expected energy, through the path's response, of the word that fits worst: about 1 if it was
    said, 0 or less if not. The second half of the last word counts as a word, since the sentence may be cut off there;
    words with little expected energy do not count."""
    last, half = path.renderings[-1], path.renderings[-1].length // 2
    end = _SignalPart(last.length - half, last.samples[half:])
    there: list[tuple[Signal, int]] = [*zip(path.renderings, path.starts, strict=True), (end, path.starts[-1] + half)]
    fits = [1.0]
    for fit in sound.fits(there):
        expected = float(path.tap_weights @ fit.density)
        if expected >= LEAST_ENERGY:
            fits.append(float(path.taps @ path.around(fit)[MAX_SHIFT:-MAX_SHIFT]) / expected)
    return min(fits)


def is_preceded(sound: WhitenedSound, path: Path, words: Iterable[str]) -> bool:
    """Whether the same voice said one of these words, through the same response, right before a path, which then is the
    end of a longer sentence."""
    renderings = (said for word in words for third in range(3) for said in path.book.renderings(word, third))
    place = path.starts[0]
    least = max(LEAST_ENERGY, LEAST_PRECEDING_SHARE * path.score)
    there = [(said, place - said.advance + path.renderings[0].lead * said.final) for said in renderings]
    fits = sound.fits(there)
    return bool(fits) and bool(path.expected_gains(fits)[1].max() > least)


NOISE_LENGTH = samples_in(0.5)
"""Length of the quiet part from which the noise is estimated."""
QUIET_QUANTILE = 0.2
"""Quantile of the parts' energies that is chosen: gain control and drop-outs make the quietest ones untypical."""
IN_PROGRESS_SCORE = 150.0
"""ROBOT_SCORE for a path in progress at a cut: another search costs little."""
IN_PROGRESS_SHARE = 0.5
"""Least share of the likeliest path's score that a path in progress at a cut explains; one with less is there by
chance."""
LEAST_CONFIDENCE = 0.7
"""Least confidence of a reported sentence (`python -m benchmarks.channel_confidence` measures it)."""
EDGE = samples_in(0.1)
"""Time by which a sentence's edges may be off: so much of it may be missing at the end of the sound, since
recordings are trimmed as closely, and with so much around it its phones are checked."""
MOST_LOSS = 3.0
"""Largest loss of a sentence's phones against the likeliest ones, nats per phone. Of 64 right sentences
in 24 worlds none has more than 2.5, of 13 that were made of people ordering coffee none less than 3.5."""
SentenceCheck = Callable[[Sequence[str], Samples, Samples], float]
"""The loss of words' phones, nats per phone, in a sound, shape (n,), with the sound of the room alone, shape (m,)."""
LEAST_WORD_FIT = 0.4
"""Least ratio of received to expected energy of each word of a reported sentence."""
MAX_SPEAKERS = 2
"""Maximum number of simultaneous speakers."""


class ChannelRecogniser:
    """Recognises robots' sentences in segments of sound."""

    def __init__(
        self,
        graph: WordGraph,
        books: Sequence[RenderedVoice],
        prepared: bool = True,
        check: SentenceCheck | None = None,
        unmodelled: frozenset[str] = frozenset(),
    ) -> None:
        """`prepared`: words may be rendered when they are needed; otherwise no onset is found before `prepare`.
        `check`: verifies a sentence before it is reported. `unmodelled`: words that are also said, or followed by
        others, in ways that the search lacks."""
        self._check = check
        self.unmodelled = unmodelled
        rates: list[list[RenderedVoice]] = []
        for book in books:
            rate = next((rate for rate in rates if all(other.voice != book.voice for other in rate)), None)
            rates.append([book]) if rate is None else rate.append(book)
        self._searches = [ChannelSearch(graph, rate) for rate in rates]
        """One for each speaking rate, the usual one first."""
        self._books = books
        self._graph = graph
        self._usual = rates[0] if rates else []
        self._onsets = OnsetDetector(graph, self._usual if prepared else ())
        self._known: dict[str, KnownResponse] = {}
        """The response from each voice, as its last sentences showed it."""

    def onset(self, heard: Samples, before: Samples) -> Onset | None:
        """The onset of a robot's sentence in `heard` (see `OnsetDetector.find`); `before`: the sound before it, shape
        (n,), n ≥ FRAME."""
        return self._onsets.find(heard, noise_sample(before, heard))

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make the slow first-time preparations, as long as `go_on` holds."""
        if go_on():
            self._onsets = OnsetDetector(self._graph, self._usual)
        for book in self._books:
            book.prepare(go_on)

    def free_memory(self) -> None:
        """Free cached spectra and waveforms: nobody has spoken for a while. Any thread may call this."""
        blocks_of.cache_clear()
        for book in self._books:
            book.free_memory()

    def search(self, segment: ChannelSegment) -> SearchResult:
        """The robots' sentences in a segment."""
        begin = max(segment.lead - NOISE_LENGTH, 0)
        origin, heard = segment.origin + begin, segment.sound[begin:].copy()
        if len(heard) < FRAME:
            return SearchResult()
        noise = noise_sample(segment.sound[: segment.lead], heard)
        reported: list[Path] = []
        sentences: list[Recognised] = []
        while len(reported) < MAX_SPEAKERS:
            sound = WhitenedSound(heard, noise)
            paths, evidence = self._found(sound, segment.cut, reported)
            sure_at = sys.maxsize
            if evidence is not None and segment.cut and evidence.path.end + GOES_ON_WITHIN > sound.n:
                sure_at, evidence = evidence.path.end + GOES_ON_WITHIN + origin, None
            elif evidence is not None and self._is_contradicted(evidence.path, heard, noise):
                evidence = None
            if evidence is None:
                best = paths[0].shifted(origin) if paths and paths[0].score >= ROBOT_SCORE else None
                last = _in_progress(paths, len(heard), IN_PROGRESS_SCORE if segment.cut else ROBOT_SCORE)
                whole = (path.words for path in paths if best is not None and self._searches[0].is_whole(path))
                going_on = tuple(path.shifted(origin) for path in last)
                return SearchResult(tuple(sentences), best, going_on, next(whole, ()), sure_at)
            reported.append(evidence.path)
            self._learn(evidence.path)
            received = evidence.path.received(len(heard))
            sentences.append(_recognised(evidence, origin, received))
            heard -= received
        return SearchResult(tuple(sentences))

    def _found(self, sound: WhitenedSound, cut: bool, reported: Sequence[Path]) -> tuple[list[Path], Evidence | None]:
        """The candidates in a sound apart from the `reported` sentences, most likely first; and the sentence that was
        surely said. Other speaking rates are searched only where no sentence at the usual one is sure, or in progress;
        sentences without a greeting only where none with it is sure: to seek all first words takes ten times as
        long; and unknown responses only where no sentence came through a known one, or is in progress."""
        paths: list[Path] = []
        for search in self._searches[:1] if reported else self._searches:
            before = paths
            for greeted in (False,) if reported else (True, False):
                found: list[Path] = []
                for known in (self._known, None) if self._known else (None,):
                    found += search.paths(sound, reported, greeted, known)
                    paths = by_score(before + found)
                    if (best := self._certain(sound, paths)) is not None:
                        return paths, best
                    if cut and known is not None and _in_progress(found, sound.n, ROBOT_SCORE):
                        return paths, None
            if not found:
                break
            if cut and _in_progress(found, sound.n, max(IN_PROGRESS_SCORE, IN_PROGRESS_SHARE * paths[0].score)):
                break
        return paths, None

    def _learn(self, path: Path) -> None:
        """Keep what a sentence showed of the response that it came through."""
        self._known[path.book.voice] = path.shown if path.known is None else path.known.updated(path.shown)

    def _is_contradicted(self, path: Path, heard: Samples, noise: Samples) -> bool:
        """Whether other phones were heard than a sentence has. Through a known response no other talk fits, and there
        may be a louder voice, too."""
        there = heard[max(path.starts[0] - EDGE, 0) : path.end + EDGE]
        return path.known is None and self._check is not None and self._check(path.words, there, noise) > MOST_LOSS

    def evidence(self, sound: WhitenedSound, paths: Sequence[Path]) -> Evidence | None:
        """The evidence for the path that explains most, among those whose words were all heard, to their end. `paths`:
        by score, the best first."""
        for path in paths:
            is_whole = self._searches[0].is_whole(path) and path.end <= sound.n + EDGE
            if is_whole and (fit := worst_fit(sound, path)) >= LEAST_WORD_FIT:
                least = (1.0 - MOST_LEAD_SHARE) * path.score
                rivals = (each for each in paths if each.score > least and each.words != path.words[: len(each.words)])
                rival = next((each.score for each in rivals if worst_fit(sound, each) >= MISSING_WORD_FIT), least)
                return Evidence(path, path.score - rival, fit)
        return None

    def _certain(self, sound: WhitenedSound, paths: Sequence[Path]) -> Evidence | None:
        """The evidence for that sentence; None if it is not sure enough, or the end of a longer one."""
        evidence = self.evidence(sound, paths)
        if evidence is None or evidence.confidence < LEAST_CONFIDENCE:
            return None
        first = evidence.path.words[0]
        if first == GREETING:
            return evidence
        nodes = {arc.source for arc in self._graph.arcs if arc.word == first}
        before = {arc.word for arc in self._graph.arcs if arc.target in nodes}
        return None if is_preceded(sound, evidence.path, before) else evidence


def _in_progress(paths: Iterable[Path], n: int, least: float) -> list[Path]:
    """The best paths that may go on after the last of `n` samples and explain this much."""
    return [path for path in paths if path.end + GOES_ON_WITHIN > n and path.score >= least][:MAX_STARTS]


def noise_sample(before: Samples, heard: Samples) -> Samples:
    """A quiet part, NOISE_LENGTH at most, of the sound before; of what was heard if that is too short to have one."""
    where = before if len(before) >= 2 * NOISE_LENGTH else heard
    n = max(min(NOISE_LENGTH, len(where) // 4), FRAME)
    energy = np.concatenate([[0.0], np.cumsum(np.square(where, dtype=np.float64))])
    starts = np.arange(0, max(len(where) - n, 0) + 1, FRAME // 2)
    order = np.argsort(energy[np.minimum(starts + n, len(where))] - energy[starts])
    at = int(starts[order[int(QUIET_QUANTILE * (len(order) - 1))]])
    return where[at : at + n]


def _recognised(evidence: Evidence, origin: int, received: Samples) -> Recognised:
    path, sure = evidence.path, evidence.confidence
    delay = path.delay + origin
    spans = [
        WordSpan(word, start + delay, start + delay + said.length, sure)
        for word, start, said in zip(path.words, path.starts, path.renderings, strict=True)
    ]
    found = Recognised.of(spans, path.book.voice, sure, Source.CHANNEL)
    return replace(found, received=Received(origin, received))
