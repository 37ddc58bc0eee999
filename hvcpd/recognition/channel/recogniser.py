"""Searches a stretch of sound for sentences of robots with unknown channels.

Sentences are found, verified and removed from the sound one after the other, and the residual is searched again."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.estimation import MAX_SHIFT, Signal, WhitenedSound, free_memory
from hvcpd.recognition.channel.onsets import Onset, OnsetDetector
from hvcpd.recognition.channel.path import GREETING, Path, RenderedVoice
from hvcpd.recognition.channel.search import ChannelSearch
from hvcpd.recognition.channel.whitening import FRAME
from hvcpd.recognition.events import Received, Recognised, Source, WordSpan
from hvcpd.recognition.fitted import curve, fitted
from hvcpd.recognition.frontend import TINY

EXPECTED = 60.0
"""Energy of a word, in variances of the noise, from which on its absence shows: by 8 standard deviations."""
BEFORE, BEFORE_SHARE = 100.0, 0.02
"""Explained energy, and its share of what a sentence explains, from which on a word in the same voice was said right
before it. Chance reaches 20."""
MISSING = 0.2
"""A word of whose energy less was heard was not said: its absence shows by 6 standard deviations where it counts."""
MOST_LEAD_SHARE = 0.6
"""Share of a sentence's score up to which its lead carries information."""


@dataclass(frozen=True)
class Evidence:
    """Evidence for a sentence: its `lead` over any other path no word of which is missing (MOST_LEAD_SHARE of its score
    at most), and the `fit` of its worst word."""

    path: Path
    lead: float
    fit: float

    @property
    def features(self) -> tuple[float, ...]:
        """Features of `confidence`: log lead (at least 0), fit (at most 1), and log number of words: the longer a
        sentence, the less likely other sound is like it."""
        return (math.log(max(self.lead, 1.0)), min(self.fit, 1.0), math.log(len(self.path.words)))

    @property
    def confidence(self) -> float:
        """The probability, 0 to 1, that the sentence is right: logistic regression, fitted by `python -m
        benchmarks.fit --only channel_confidence`."""
        weights = fitted("channel_confidence")["weights"]
        return curve(weights["bias"], weights["features"], self.features)


def evidence_of(sound: WhitenedSound, path: Path, fit: float, paths: Sequence[Path]) -> Evidence:
    """The evidence for one of `paths`, which are sorted by score, the best first; `fit`: its `worst_fit`."""
    least = (1.0 - MOST_LEAD_SHARE) * path.score
    rivals = (each for each in paths if each.score > least and each.words != path.words[: len(each.words)])
    rival = next((each.score for each in rivals if worst_fit(sound, each) >= MISSING), least)
    return Evidence(path, path.score - rival, fit)


@dataclass(frozen=True, eq=False)
class _Part:
    """A part of a known signal."""

    length: int
    samples: Samples


def worst_fit(sound: WhitenedSound, path: Path) -> float:
    """Ratio of received to expected energy of the word that fits worst, through the path's response: about 1 if it was
    said, 0 or less if not. The second half of the last word counts as a word, since a sentence may have been cut off in
    it. Words with little expected energy do not count."""
    last, half = path.renderings[-1], path.renderings[-1].length // 2
    end = _Part(last.length - half, last.samples[half:])
    words = zip(path.renderings, path.starts, strict=True)
    there: Iterable[tuple[Signal, int]] = chain(words, [(end, path.starts[-1] + half)])
    fits = [1.0]
    for fit in sound.fits(there):
        expected = float(path.spread @ fit.density)
        if expected >= EXPECTED:
            fits.append(float(path.taps @ path.around(fit)[MAX_SHIFT:-MAX_SHIFT]) / expected)
    return min(fits)


def is_preceded(sound: WhitenedSound, path: Path, words: Iterable[str]) -> bool:
    """Whether one of these words was said by the same voice, through the same response, right before a path: then it is
    the end of a longer sentence."""
    renderings = (said for word in words for third in range(3) for said in path.book.renderings(word, third))
    place = path.starts[0]
    least = max(BEFORE, BEFORE_SHARE * path.score)
    there = [(said, place - said.advance + path.renderings[0].lead * said.final) for said in renderings]
    for fit in sound.fits(there):
        heard = float(np.correlate(path.around(fit), path.taps, "valid").max())
        own = max(float(path.spread @ fit.density), TINY)
        if heard > 0.0 and min(heard**2 / own, 2.0 * own) > least:
            return True
    return False


NOISE_S = 0.5
"""Length of the quiet stretch from which the noise is estimated."""
QUIETER = 0.2
"""Share of the stretches that are quieter than the chosen one: gain controls and drop-outs make some that are not
representative."""
LEAST_SCORE = 450.0
"""Least explained energy, in variances of the noise, from which on it is a robot that somebody heard, though perhaps
not what it said: chance and other talk reach 390."""
BEGUN = 150.0
"""The same for a beginning where sound was cut: a second search costs little."""
GOES_ON = SAMPLE_RATE_HZ
"""A sentence this close (1 s) to a cut may have more words, of which the next one is not heard to its end."""
REACH = SAMPLE_RATE_HZ
"""A sentence that ends earlier than this (1 s) before the end of the sound has ended."""
MAX_IN_PROGRESS = 16
"""Maximum number of paths with which the next search goes on."""
LEAST_CONFIDENCE = 0.7
"""Least confidence of a sentence that is reported (`benchmarks.channel_confidence` prints what it lets pass)."""
TAIL = SAMPLE_RATE_HZ // 10
"""Most samples (0.1 s) of a sentence that may be missing at the end of the sound: recordings are trimmed as closely."""
MOST_LOSS = 3.0
"""Nats per phone by which the phones of a sentence may be less likely than the likeliest ones. Of 64 right sentences
in 24 worlds none has more than 2.5, of 13 that were made of people ordering coffee none less than 3.5."""
MARGIN = SAMPLE_RATE_HZ // 10
"""Samples (0.1 s) before and after a sentence with which its phones are checked."""
Check = Callable[[Sequence[str], Samples, Samples], float]
"""The loss of words' phones, nats per phone, in a sound, shape (n,), with the sound of the room alone, shape (m,)."""
LEAST_WORD_FIT = 0.4
"""Smallest share of each word's expected sound, through the response, that must have been heard."""
MAX_SPEAKERS = 2
"""Maximum number of robots that speak at the same time."""


@dataclass(frozen=True, eq=False)
class ChannelSegment:
    """Sound, shape (n,), from sample `origin` on. Its first `lead` samples are from before the speech.
    `cut`: sound went on after it. `earlier`: the `in_progress` of the search before."""

    sound: Samples
    origin: int
    lead: int
    cut: bool = False
    earlier: tuple[Path, ...] = ()


@dataclass(frozen=True)
class SearchResult:
    """The sentences in a stretch; whether a robot said something else there; and the paths in progress at its end, the
    best first, by the samples that `origin` counts."""

    sentences: tuple[Recognised, ...] = ()
    robot: bool = False
    in_progress: tuple[Path, ...] = ()
    likeliest: tuple[str, ...] = ()
    """The words of the whole sentence that is likeliest, however unsure it is; none if there is none."""
    sure_at: int = sys.maxsize
    """The sample by which it has ended, if it is sure but for the words that may follow."""


class ChannelRecogniser:
    """Knows the voices of robots."""

    def __init__(
        self, graph: WordGraph, books: Sequence[RenderedVoice], prepared: bool = True, check: Check | None = None
    ) -> None:
        """`prepared`: the words may be rendered when they are needed; otherwise no beginning is found before
        `prepare`. `check`: by another listener, of what would be reported."""
        self._check = check
        rates: list[list[RenderedVoice]] = []
        for book in books:
            rate = next((rate for rate in rates if all(other.voice != book.voice for other in rate)), None)
            rates.append([book]) if rate is None else rate.append(book)
        self._searches = [ChannelSearch(graph, rate) for rate in rates]
        """One for each rate: the usual one first."""
        self._books = books
        self._before = _words_before(graph)
        self._graph = graph
        self._usual = rates[0] if rates else []
        self._onsets = OnsetDetector(graph, self._usual if prepared else ())

    def onset(self, heard: Samples, before: Samples) -> Onset | None:
        """Where a robot's sentence may begin in `heard` (see `OnsetDetector.find`); `before`: the sound before it,
        shape (n,), n ≥ FRAME."""
        return self._onsets.find(heard, noise_sample(before, heard))

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Make the slow first-time preparations, as long as `go_on` holds."""
        if go_on():
            self._onsets = OnsetDetector(self._graph, self._usual)
        for book in self._books:
            book.prepare(go_on)

    def free_memory(self) -> None:
        """Free the memory of all listeners: nobody has spoken for a while. Any thread may call this."""
        free_memory()
        for book in self._books:
            book.free_memory()

    def search(self, stretch: ChannelSegment) -> SearchResult:
        """Return the robots' sentences in a stretch."""
        begin = max(stretch.lead - round(0.5 * SAMPLE_RATE_HZ), 0)
        heard = stretch.sound[begin:].copy()
        if len(heard) < FRAME:
            return SearchResult()
        noise = noise_sample(stretch.sound[: stretch.lead], heard)
        reported: list[Path] = []
        sentences: list[Recognised] = []
        while len(reported) < MAX_SPEAKERS:
            sound = WhitenedSound(heard, noise)
            paths, evidence = self._found(sound, stretch, begin, reported)
            sure_at = sys.maxsize
            if evidence is not None and stretch.cut and evidence.path.end + GOES_ON > sound.n:
                sure_at, evidence = evidence.path.end + GOES_ON + stretch.origin + begin, None
            elif evidence is not None and self._is_contradicted(evidence.path, heard, noise):
                evidence = None
            if evidence is None:
                if not paths:
                    break
                robot = paths[0].score >= LEAST_SCORE
                last = _in_progress(paths, len(heard), BEGUN if stretch.cut else LEAST_SCORE)
                likeliest = next(filter(self._searches[0].is_whole, paths), None)
                words = likeliest.words if robot and likeliest is not None else ()
                going_on = tuple(path.shifted(stretch.origin + begin) for path in last)
                return SearchResult(tuple(sentences), robot, going_on, words, sure_at)
            reported.append(evidence.path)
            received = evidence.path.sound(len(heard))
            sentences.append(_recognised(evidence, stretch.origin + begin, received))
            heard -= received
        return SearchResult(tuple(sentences))

    def _found(
        self, sound: WhitenedSound, stretch: ChannelSegment, begin: int, reported: Sequence[Path]
    ) -> tuple[list[Path], Evidence | None]:
        """The candidates in a sound that begins at sample `begin` of the stretch, apart from the `reported` sentences,
        most likely first; and the sentence that was surely said. Other speaking rates are searched only where the usual
        rate finds nobody, or a sentence at another one is in progress."""
        earlier = [path.shifted(-stretch.origin - begin) for path in stretch.earlier]
        others = any(path.book in self._books and path.book not in self._usual for path in earlier)
        paths: list[Path] = []
        best = None
        for search in self._searches[:1] if reported else self._searches:
            found = search.paths(sound, reported, earlier)
            paths += found
            paths.sort(key=lambda path: -path.score)
            best = self._certain(sound, paths)
            done = not others and (not found or (stretch.cut and _in_progress(found, sound.n)))
            if best is not None or done:
                break
        return paths, best

    def _is_contradicted(self, path: Path, heard: Samples, noise: Samples) -> bool:
        """Whether other phones were heard than a sentence has."""
        there = heard[max(path.starts[0] - MARGIN, 0) : path.end + MARGIN]
        return self._check is not None and self._check(path.words, there, noise) > MOST_LOSS

    def evidence(self, sound: WhitenedSound, paths: Sequence[Path]) -> Evidence | None:
        """The evidence for the path that explains most, among those whose words were all heard, to their end. `paths`:
        most likely first."""
        whole = (path for path in paths if self._searches[0].is_whole(path) and path.end <= sound.n + TAIL)
        fits = ((path, worst_fit(sound, path)) for path in whole)
        return next((evidence_of(sound, path, fit, paths) for path, fit in fits if fit >= LEAST_WORD_FIT), None)

    def _certain(self, sound: WhitenedSound, paths: Sequence[Path]) -> Evidence | None:
        """The evidence for that sentence; None if it is not sure enough, or the end of a longer one."""
        evidence = self.evidence(sound, paths)
        if evidence is None or evidence.confidence < LEAST_CONFIDENCE:
            return None
        best = evidence.path
        before = self._before.get(best.words[0], ())
        return None if best.words[0] != GREETING and is_preceded(sound, best, before) else evidence


def _in_progress(paths: Iterable[Path], n: int, least: float = BEGUN) -> list[Path]:
    """The best paths that may go on after the last of `n` samples and explain this much."""
    return [path for path in paths if path.end + REACH > n and path.score >= least][:MAX_IN_PROGRESS]


def _words_before(graph: WordGraph) -> dict[str, set[str]]:
    """For each word, the words that may be said right before it."""
    into: dict[int, set[str]] = {}
    before: dict[str, set[str]] = {}
    for arc in graph.arcs:
        into.setdefault(arc.target, set()).add(arc.word)
    for arc in graph.arcs:
        before.setdefault(arc.word, set()).update(into.get(arc.source, ()))
    return before


def noise_sample(before: Samples, heard: Samples) -> Samples:
    """A quiet NOISE_S of the sound before; all of that sound if it is shorter."""
    n = round(NOISE_S * SAMPLE_RATE_HZ)
    where = before if len(before) >= 2 * n else heard
    n = max(min(n, len(where) // 4), FRAME)
    energy = np.concatenate([[0.0], np.cumsum(np.square(where, dtype=np.float64))])
    starts = np.arange(0, max(len(where) - n, 0) + 1, FRAME // 2)
    order = np.argsort(energy[np.minimum(starts + n, len(where))] - energy[starts])
    at = int(starts[order[int(QUIETER * (len(order) - 1))]])
    return where[at : at + n]


def _recognised(evidence: Evidence, origin: int, received: Samples) -> Recognised:
    path, sure = evidence.path, evidence.confidence
    delay = path.delay + origin
    spans = tuple(
        WordSpan(word, start + delay, start + delay + said.length, sure)
        for word, start, said in zip(path.words, path.starts, path.renderings, strict=True)
    )
    start, end = spans[0].start_sample, spans[-1].end_sample
    sound = Received(origin, received)
    return Recognised(path.words, path.book.voice, start, end, sure, math.nan, spans, Source.CHANNEL, sound)
