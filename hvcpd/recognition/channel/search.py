"""Searches the sentence that explains most of a piece of sound, whatever channel it came through.

A path through the word network is a known signal, each word at the sample that the one before says. Its score is the
energy of what was heard that it explains through the response that fits it best: every path has an estimate of its own
("per-survivor processing", R. Raheli, A. Polydoros, C. Tzou, IEEE Trans. Communications 43, 1995). The normal equations
of a path are the sums over its words, so that a word more costs one correlation; that neighbouring words overlap for a
moment is left out, which makes no difference. A response has few taps as long as
little is explained, and up to TAPS, as each tap explains one variance of noise by chance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.response import Taps, response, transform_size
from hvcpd.recognition.channel.weighting import BACK, SHIFT, TAPS, WeightedSound
from hvcpd.recognition.paths import Said, Voicebook, thirds_of

GREETING = "hi"
"""What robots begin with."""
FIRST_TAPS = 64
"""4 ms: of a first word, all that is known of most loudspeakers without a room."""
ENOUGH = 6.0
"""Explained energy for each tap."""
BLOCK = 16
"""Lags that are told apart where beginnings are sought."""
PLACES = 3
"""Beginnings of each word in each voice."""
STARTS = 64
WIDE, NARROW = 32, 16
"""Paths that are followed, up to WIDE_WORDS words and after them."""
WIDE_WORDS = 4
EXPECTED = 60.0
"""Energy of a word, in variances of the noise, from which on its absence shows: by 8 standard deviations."""
TRIED = 48
"""Of all next words, those whose response is estimated anew."""
BEHIND_SHARE, BEHIND = 1.25, 150.0
"""A path is dropped if another one had so much more explained at its end."""
EARLIER, LATER = round(0.6 * SAMPLE_RATE_HZ), round(0.25 * SAMPLE_RATE_HZ)
"""From where speech was noticed, a sentence begins so much earlier or later."""
MOST_LAGS = 12_000
"""Beginnings that one transform tells of."""
NEAR = 400
"""Samples that one path's end may be after another's, to be compared."""


@dataclass(frozen=True, eq=False)
class Path:
    """A sentence up to a word, with its normal equations over noise of variance 1."""

    book: Voicebook
    node: int
    words: tuple[str, ...]
    said: tuple[Said, ...]
    starts: tuple[int, ...]
    thirds: tuple[int, ...]
    autocorrelation: Taps
    correlation: Taps
    """At lags from -BACK on."""
    taps: Taps
    explained: tuple[float, ...]
    """Energy that it explains beyond what its taps do by chance, up to each of its words."""

    @property
    def score(self) -> float:
        """The same of all its words."""
        return self.explained[-1]

    @property
    def end(self) -> int:
        """The sample after its last word's signal."""
        return self.starts[-1] + self.said[-1].length

    @property
    def ends(self) -> bool:
        """Whether it may be whole: a pause follows, and its words are in the thirds that a sentence of so many has."""
        return self.said[-1].final and self.thirds == thirds_of(len(self.words))

    def energy(self, sound: WeightedSound, until: int) -> float:
        """What was heard from its first word on, until a sample."""
        return sound.energy(self.starts[0], until)

    def explained_until(self, sample: int) -> float:
        """What its words explain that end before that sample."""
        ends = (start + said.length for start, said in zip(self.starts, self.said, strict=True))
        return max((e for end, e in zip(ends, self.explained, strict=True) if end <= sample), default=0.0)

    def sound(self, n: int) -> Samples:
        """What was heard of it, shape (n,)."""
        said = np.zeros(n + TAPS, np.float32)
        for start, each in zip(self.starts, self.said, strict=True):
            first, last = max(start, 0), min(start + each.length, n + TAPS)
            said[first:last] += each.samples[first - start : last - start]
        size = transform_size(n + TAPS)
        heard = np.fft.irfft(np.fft.rfft(said, size) * np.fft.rfft(self.response, size), size)
        return np.asarray(heard[BACK : BACK + n], np.float32)

    @cached_property
    def response(self) -> Taps:
        """The response of TAPS taps that fits it best, at lags from -BACK on."""
        return _estimate(self.autocorrelation, self.correlation, TAPS)[0]

    @property
    def delay(self) -> int:
        """Samples from the place of its signal to where most of it was heard."""
        return int(np.abs(self.response).argmax()) - BACK


@dataclass(frozen=True, eq=False)
class _Next:
    """A word that may come next, `SHIFT` around its place, and what it promises."""

    path: Path
    word: str
    node: int
    third: int
    said: Said
    at: int
    shift: int
    promise: float

    @property
    def end(self) -> int:
        """The sample after its signal."""
        return self.at + self.said.length


class ChannelSearch:
    """Knows who may speak, and what."""

    def __init__(self, graph: WordGraph, books: Sequence[Voicebook]) -> None:
        self._books = books
        self._graph = graph
        self._arcs: dict[int, list[tuple[str, int]]] = {}
        for arc in graph.arcs:
            self._arcs.setdefault(arc.source, []).append((arc.word, arc.target))
        self._pauses = graph.pauses | graph.finals

    def paths(self, sound: WeightedSound, noticed: Sequence[int]) -> list[Path]:
        """Sentences, and beginnings of some, that begin near a sample where speech was `noticed`, or anywhere if with a
        greeting: those that explain most first."""
        found: list[Path] = []
        level = self._begun(sound, noticed)
        while level:
            found += level
            level = self._extended(sound, level)
        return sorted(found, key=lambda path: -path.score)

    def least_fit(self, sound: WeightedSound, path: Path) -> float:
        """Of the word that fits worst, what was heard of it through the path's response over what was expected: about 1
        if it was said, 0 or less if not. Words of which little was to be expected do not count."""
        fits = [1.0]
        n = len(path.taps)
        around = np.correlate(path.taps, path.taps, "full")[n - 1 :]
        around[1:] *= 2.0
        first = SHIFT + _begin(n)
        for said, start in zip(path.said, path.starts, strict=True):
            fit = sound.fit(said, start)
            expected = float(around @ fit.autocorrelation[:n])
            if expected >= EXPECTED:
                fits.append(float(path.taps @ fit.correlation[first : first + n]) / expected)
        return min(fits)

    def is_whole(self, path: Path) -> bool:
        """Whether a path is a sentence."""
        return path.node in self._graph.finals and path.ends

    def _said(self, book: Voicebook, word: str, third: int, node: int) -> Iterator[Said]:
        return (said for said in book.said(word, third) if not said.final or node in self._pauses)

    def _begun(self, sound: WeightedSound, noticed: Sequence[int]) -> list[Path]:
        """Paths of one word, at the best places of each."""
        near = _merged([(at - EARLIER, at + LATER) for at in noticed], sound.n)
        anywhere = _merged([(-EARLIER, sound.n)], sound.n)
        paths: list[Path] = []
        for book in self._books:
            for word, node in self._arcs.get(self._graph.start, ()):
                places: list[tuple[float, Said, int]] = []
                for said in self._said(book, word, 0, node):
                    for first, last in anywhere if word == GREETING else near:
                        at = first - said.lead
                        found, energy = sound.seek(said, at, last - first + FIRST_TAPS)
                        places += [(gain / max(energy, 1e-9), said, at + k) for gain, k in _peaks(found)]
                places.sort(key=lambda place: -place[0])
                paths += [_first(sound, book, word, node, said, at) for _, said, at in places[:PLACES]]
        return _best_first(sound, paths)[:STARTS]

    def _extended(self, sound: WeightedSound, level: Sequence[Path]) -> list[Path]:
        """The paths of one word more."""
        promising = [each for path in level for each in self._next(sound, path)]
        if not promising:
            return []
        share = _share_of_best([(each.promise, each.path.energy(sound, each.end)) for each in promising])
        promising.sort(key=lambda each: share * each.path.energy(sound, each.end) - each.promise)
        promising = promising[:TRIED]
        enough = max(max(each.promise for each in promising) / ENOUGH, 1.0)
        n_taps = min(TAPS, max(FIRST_TAPS, 1 << int(np.log2(enough))))
        paths = _best_first(sound, [_joined(sound, each, n_taps) for each in promising])
        leaders = sorted(paths, key=lambda path: -path.score)[:4]
        kept = [path for path in paths if not any(_is_behind(path, leader) for leader in leaders)]
        return kept[: WIDE if len(paths[0].words) < WIDE_WORDS else NARROW]

    def _next(self, sound: WeightedSound, path: Path) -> Iterator[_Next]:
        """What may come next, if it promises to explain anything through the path's own response."""
        n, begin = len(path.taps), _begin(len(path.taps))
        around = np.correlate(path.taps, path.taps, "full")[n - 1 :]
        around[1:] *= 2.0
        third, last, start = path.thirds[-1], path.said[-1], path.starts[-1]
        for word, node in self._arcs.get(path.node, ()):
            for later in {third, min(third + 1, 2)}:
                for said in self._said(path.book, word, later, node):
                    at = start + last.advance - said.lead * last.final
                    if at + said.length > sound.n:
                        continue
                    fit = sound.fit(said, at)
                    heard = np.correlate(fit.correlation[begin : begin + n + 2 * SHIFT], path.taps, "valid")
                    shift = int(heard.argmax())
                    own = max(float(around @ fit.autocorrelation[:n]), 1e-9)
                    if heard[shift] > 0.0:
                        gain = float(heard[shift]) ** 2 / own
                        yield _Next(path, word, node, later, said, at, shift, path.score + min(gain, 2.0 * own))


def _first(sound: WeightedSound, book: Voicebook, word: str, node: int, said: Said, at: int) -> Path:
    """A path of one word."""
    fit = sound.fit(said, at)
    correlation = fit.correlation[SHIFT : SHIFT + TAPS]
    taps, explained = _estimate(fit.autocorrelation, correlation, FIRST_TAPS)
    return Path(book, node, (word,), (said,), (at,), (0,), fit.autocorrelation, correlation, taps, (explained,))


def _begin(n: int) -> int:
    """Where in a correlation at lags from -BACK on those of a response of `n` taps begin: a long one reaches back."""
    return BACK * (TAPS - n) // (TAPS - FIRST_TAPS)


def _estimate(autocorrelation: Taps, correlation: Taps, n: int) -> tuple[Taps, float]:
    """The response of `n` taps that fits best, and what it explains beyond chance."""
    there = correlation[_begin(n) : _begin(n) + n]
    taps = response(autocorrelation, there, n)
    return taps, float(taps @ there) - n


def _merged(ranges: Sequence[tuple[int, int]], n: int) -> list[tuple[int, int]]:
    """Ranges of `n` samples, each once, in pieces of MOST_LAGS at most."""
    merged: list[tuple[int, int]] = []
    for first, last in sorted((first, min(last, n)) for first, last in ranges):
        first = max(first, merged[-1][1]) if merged else first
        while last > first:
            merged.append((first, min(last, first + MOST_LAGS)))
            first = merged[-1][1]
    return merged


def _joined(sound: WeightedSound, word: _Next, n_taps: int) -> Path:
    """A path and one more word."""
    path, fit = word.path, sound.fit(word.said, word.at)
    autocorrelation = path.autocorrelation + fit.autocorrelation
    correlation = path.correlation + fit.correlation[word.shift : word.shift + TAPS]
    taps, explained = _estimate(autocorrelation, correlation, n_taps)
    return Path(
        path.book,
        word.node,
        (*path.words, word.word),
        (*path.said, word.said),
        (*path.starts, word.at + word.shift - SHIFT),
        (*path.thirds, word.third),
        autocorrelation,
        correlation,
        taps,
        (*path.explained, explained),
    )


def _best_first(sound: WeightedSound, paths: Sequence[Path]) -> list[Path]:
    """Paths by how much they explain less than the best one does of as much sound: they end at different places."""
    heard = [path.energy(sound, path.end) for path in paths]
    share = _share_of_best([(path.score, energy) for path, energy in zip(paths, heard, strict=True)])
    order = sorted(range(len(paths)), key=lambda k: share * heard[k] - paths[k].score)
    return [paths[k] for k in order]


def _share_of_best(explained: Sequence[tuple[float, float]]) -> float:
    """Of pairs of what is explained and what was heard, the share of that pair that explains most."""
    score, energy = max(explained, default=(0.0, 0.0))
    return score / max(energy, 1e-9)


def _is_behind(path: Path, leader: Path) -> bool:
    return leader.explained_until(path.end + NEAR) > BEHIND_SHARE * path.score + BEHIND


def _peaks(correlation: Taps) -> Iterator[tuple[float, int]]:
    """The energies of the correlation in the strongest stretches of FIRST_TAPS, and where they begin."""
    blocks = np.square(correlation[: len(correlation) // BLOCK * BLOCK]).reshape(-1, BLOCK).sum(axis=1)
    total = np.concatenate([[0.0], np.cumsum(blocks)])
    across = FIRST_TAPS // BLOCK
    energies = total[across:] - total[:-across]
    for _ in range(PLACES):
        best = int(energies.argmax())
        if energies[best] <= 0.0:
            return
        yield float(energies[best]), best * BLOCK
        energies[max(best - across, 0) : best + across] = 0.0
