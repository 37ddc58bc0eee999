"""Searches for the sentence that explains most of a segment of sound, whatever channel it came through.

A path through the word network is a known signal: each word begins at the sample given by the word before it. Its score
is the received energy that it explains through its best-fitting response: every path has its own estimate
("per-survivor processing", R. Raheli, A. Polydoros, C. Tzou, IEEE Trans. Communications 43, 1995). The normal equations
of a path are the sums over its words, so each further word costs one correlation. The short overlap of neighbouring
words is neglected, which makes no difference. A response has few taps while little energy is explained, and up to TAPS
later, because each tap explains one variance of noise by chance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain

import numpy as np

from hvcpd.language.graph import WordGraph, lengths_of
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.weighting import (
    BACK,
    SHIFT,
    TAPS,
    Spectrum,
    Taps,
    WeightedSound,
    autocorrelations,
    energy_weights,
    response,
    responses,
    transform_size,
)
from hvcpd.recognition.frontend import TINY, rfft
from hvcpd.recognition.renderings import GREETING, I_AM, Said, Voicebook, may_have, thirds_of

FIRST_TAPS = 64
"""4 ms: for a first word, enough for most loudspeakers without a room."""
ENOUGH = 6.0
"""Explained energy for each tap."""
BLOCK = 16
"""Resolution in lags of the search for beginnings."""
FAINT = 50.0
"""Explained energy of the best first word below which the search ends: steady noise reaches 20, and the least of any
reported sentence was 78."""
FAINT_BESIDE = 450.0
"""The same after a sentence was removed: its late echoes reached 306 (4 searches), and the least of seven sentences
reported beside another was 1,984."""
PLACES = 3
"""Maximum number of beginnings of each word in each voice."""
MOST_BEGINNINGS = 20
"""Maximum number of places where sentences are sought to begin."""
APART = SAMPLE_RATE_HZ // 10
"""Least distance in samples between these places."""
WIDTH = 8
"""Maximum number of active paths that begin at one place, over all voices."""
TRIED = 16
"""Maximum number of next words whose response is estimated again."""
BEHIND_SHARE, BEHIND = 1.25, 150.0
"""A path is dropped if another one has explained this much more at its end."""
EARLIER, LATER = round(0.6 * SAMPLE_RATE_HZ), round(0.25 * SAMPLE_RATE_HZ)
"""A sentence begins at most this much earlier or later than speech was noticed."""
MOST_LAGS = 12_000
"""Number of beginnings that one transform covers."""
NEAR = 400
"""Maximum distance in samples between the ends of two paths that are compared."""


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
    """Correlation of the sound with the signal, at lags from -BACK on."""
    taps: Taps
    explained: tuple[float, ...]
    """Energy that it explains beyond what its taps do by chance, before its first word and after each one."""

    @staticmethod
    def before(book: Voicebook, node: int) -> Path:
        """A path without words."""
        nothing = np.zeros(TAPS, np.float32)
        return Path(book, node, (), (), (), (), nothing, nothing, nothing[:0], (0.0,))

    @property
    def score(self) -> float:
        """The normal equations of all its words."""
        return self.explained[-1]

    @property
    def end(self) -> int:
        """The sample after its last word's signal."""
        return self.starts[-1] + self.said[-1].length

    @property
    def ends(self) -> bool:
        """Whether it may be complete: a pause follows, and its words are in the right thirds of a sentence of this
        length."""
        return self.said[-1].final and self.thirds == thirds_of(len(self.words))

    def energy(self, sound: WeightedSound, until: int) -> float:
        """The energy received from its first word on, until a sample."""
        return sound.energy(self.starts[0], until)

    def explained_until(self, sample: int) -> float:
        """The energy explained by its words that end before that sample."""
        ends = (start + said.length for start, said in zip(self.starts, self.said, strict=True))
        return max((e for end, e in zip(ends, self.explained[1:], strict=True) if end <= sample), default=0.0)

    def sound(self, n: int) -> Samples:
        """The sentence as received, shape (n,)."""
        said = np.zeros(n + TAPS, np.float32)
        for start, each in zip(self.starts, self.said, strict=True):
            first, last = max(start, 0), min(start + each.length, n + TAPS)
            said[first:last] += each.samples[first - start : last - start]
        size = transform_size(n + TAPS)
        heard = np.fft.irfft(rfft(said, size) * rfft(self.response, size), size)
        return np.asarray(heard[BACK : BACK + n], np.float32)

    @cached_property
    def response(self) -> Taps:
        """Its best-fitting response of TAPS taps, at lags from -BACK on."""
        return response(self.autocorrelation, self.correlation, TAPS)

    @cached_property
    def spread(self) -> Spectrum:
        """The `energy_weights` of its response."""
        return energy_weights(self.taps)

    def moved(self, samples: int) -> Path:
        """The same path in a sound that begins this much earlier."""
        return replace(self, starts=tuple(start + samples for start in self.starts))

    @property
    def delay(self) -> int:
        """Delay in samples from the place of its signal to the strongest part of what was received."""
        return int(np.abs(self.response).argmax()) - BACK


@dataclass(frozen=True, eq=False)
class _Next:
    """A possible next word, `SHIFT` around its place, and its expected gain in explained energy."""

    path: Path
    word: str
    node: int
    third: int
    said: Said
    at: int
    shift: int
    expected_score: float

    @property
    def end(self) -> int:
        """The sample after its signal."""
        return self.at + self.said.length


class ChannelSearch:
    """Searches for the sentences of a graph in the voices that may speak."""

    def __init__(self, graph: WordGraph, books: Sequence[Voicebook]) -> None:
        self._books = books
        self._graph = graph
        self._lengths = lengths_of(graph)
        self._names = frozenset[str]().union(*(book.names for book in books))

    def paths(
        self,
        sound: WeightedSound,
        noticed: Sequence[int],
        reported: Sequence[Path] = (),
        earlier: Sequence[Path] = (),
    ) -> list[Path]:
        """Return sentences and partial sentences, those that explain most first. They begin where `earlier` ones did,
        found in less of this sound, or near a sample where speech was `noticed`, or anywhere if with a greeting. None
        that begins within a sentence `reported` is in the same voice, of which late echoes remain: a robot does not say
        two things at once."""
        found: list[Path] = []
        least = FAINT_BESIDE if reported else FAINT
        earlier = [path for path in earlier if not any(_is_within(path, each) for each in reported)]
        begun = (self._begun_again(sound, earlier), self._begun(sound, noticed, reported))
        for level in chain.from_iterable(_by_place(each, least) for each in begun):
            best = _leaders(found, 1)
            while level := _kept(level, best):
                found += level
                level = self._extended(sound, level)
        return sorted(found, key=lambda path: -path.score)

    def is_whole(self, path: Path) -> bool:
        """Whether a path is a sentence."""
        return path.node in self._graph.finals and path.ends

    def _said(self, book: Voicebook, word: str, third: int, node: int) -> Iterator[Said]:
        return (said for said in book.said(word, third) if not said.final or node in self._graph.rests)

    def _begun(self, sound: WeightedSound, noticed: Sequence[int], reported: Sequence[Path]) -> list[Path]:
        """Paths of one word, at the best places of each."""
        begun: list[_Next] = []
        for book in self._books:
            before = [(path.starts[0] - EARLIER, path.end) for path in reported if path.book.voice == book.voice]
            near = _merged([(at - EARLIER, at + LATER) for at in noticed], sound.n, before)
            anywhere = _merged([(-EARLIER, sound.n)], sound.n, before)
            for word, node in self._graph.following[self._graph.start]:
                empty = Path.before(book, self._graph.start)
                said = list(self._said(book, word, 0, node))
                best: dict[tuple[Said, int], None] = {}
                for where in (near, anywhere) if word == GREETING else (near,):
                    places = sorted(_places(sound, said, where), key=lambda place: -place[0])
                    best |= dict.fromkeys((way, at) for _, way, at in places[:PLACES])
                begun += [_Next(empty, word, node, 0, way, at, SHIFT, 0.0) for way, at in best]
        return _joined(sound, begun, FIRST_TAPS)

    def _begun_again(self, sound: WeightedSound, earlier: Sequence[Path]) -> list[Path]:
        """The first words of paths found in less of this sound."""
        nodes = dict(self._graph.following[self._graph.start])
        known = {(path.book, path.words[0], path.said[0], path.starts[0]) for path in earlier}
        words = [
            _Next(Path.before(book, self._graph.start), word, nodes[word], 0, said, at, SHIFT, 0.0)
            for book, word, said, at in known
            if book in self._books
        ]
        return _joined(sound, words, FIRST_TAPS)

    def _may_say(self, book: Voicebook, words: tuple[str, ...], word: str) -> bool:
        """Whether a voice may go on with a word: a robot says no other name than its own after "I am"."""
        return words[-2:] != I_AM or word not in self._names or word in book.names

    def _extended(self, sound: WeightedSound, level: Sequence[Path]) -> list[Path]:
        """The paths extended by one word."""
        promising = [each for path in level for each in self._next(sound, path)]
        if not promising:
            return []
        share = _share_of_best([(each.expected_score, each.path.energy(sound, each.end)) for each in promising])
        promising.sort(key=lambda each: share * each.path.energy(sound, each.end) - each.expected_score)
        promising = promising[:TRIED]
        enough = max(max(each.expected_score for each in promising) / ENOUGH, 1.0)
        n_taps = min(TAPS, max(FIRST_TAPS, 1 << int(np.log2(enough))))
        paths = _best_first(sound, _joined(sound, promising, n_taps))
        return _kept(paths, _leaders(paths, 4))[:WIDTH]

    def _next(self, sound: WeightedSound, path: Path) -> Iterator[_Next]:
        """The possible next words that are expected to explain some energy through the path's own response."""
        third, last, start = path.thirds[-1], path.said[-1], path.starts[-1]
        there = [
            (word, node, later, said, start + last.advance - said.lead * last.final)
            for word, node in self._graph.following[path.node]
            if self._may_say(path.book, path.words, word)
            for later in {third, min(third + 1, 2)}
            if may_have((*path.thirds, later), self._lengths[node])
            for said in self._said(path.book, word, later, node)
        ]
        there = [each for each in there if each[4] + each[3].length <= sound.n]
        if not there:
            return
        begin, n = span_of(len(path.taps))
        fits = sound.fits((said, at) for *_, said, at in there)
        across = np.stack([fit.correlation[begin : begin + n + 2 * SHIFT] for fit in fits])
        heard = np.lib.stride_tricks.sliding_window_view(across, n, axis=1) @ path.taps
        shifts = heard.argmax(axis=1)
        expected = np.stack([fit.density for fit in fits]) @ path.spread
        for (word, node, later, said, at), row, shift, energy in zip(there, heard, shifts, expected, strict=True):
            own = max(float(energy), TINY)
            if row[shift] > 0.0:
                gain = float(row[shift]) ** 2 / own
                yield _Next(path, word, node, later, said, at, int(shift), path.score + min(gain, 2.0 * own))


def _places(
    sound: WeightedSound, said: Sequence[Said], ranges: Sequence[tuple[int, int]]
) -> Iterator[tuple[float, Said, int]]:
    """The best places of a word in these ranges of samples: energy, rendering and first sample."""
    for way in said:
        for first, last in ranges:
            at = first - way.lead
            for energy, k in _peaks(sound.seek(way, at, last - first + FIRST_TAPS)):
                yield energy, way, at + k


def span_of(n: int) -> tuple[int, int]:
    """The range of a response of `n` taps within a correlation at lags from -BACK on: its beginning, which depends on
    how far back a long response reaches, and its length."""
    return BACK * (TAPS - n) // (TAPS - FIRST_TAPS), n


def _merged(
    ranges: Sequence[tuple[int, int]], n: int, without: Sequence[tuple[int, int]] = ()
) -> list[tuple[int, int]]:
    """Ranges of `n` samples, each once, in pieces of MOST_LAGS at most, but for those `without`."""
    merged: list[tuple[int, int]] = []
    for first, last in sorted((first, min(last, n)) for first, last in _apart(ranges, without)):
        first = max(first, merged[-1][1]) if merged else first
        while last > first:
            merged.append((first, min(last, first + MOST_LAGS)))
            first = merged[-1][1]
    return merged


def _apart(ranges: Sequence[tuple[int, int]], without: Sequence[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    for first, last in ranges:
        for begin, end in sorted(without):
            yield first, min(last, begin)
            first = max(first, end)
        yield first, last


def _joined(sound: WeightedSound, words: Sequence[_Next], n_taps: int) -> list[Path]:
    """Paths extended by one word each, with responses of `n_taps`."""
    if not words:
        return []
    fits = sound.fits((word.said, word.at) for word in words)
    own = np.stack([word.path.autocorrelation for word in words]) + autocorrelations(fits)
    across = np.stack(
        [
            word.path.correlation + fit.correlation[word.shift : word.shift + TAPS]
            for word, fit in zip(words, fits, strict=True)
        ]
    )
    begin, _ = span_of(n_taps)
    there = across[:, begin : begin + n_taps]
    taps = responses(own, there, n_taps)
    explained = np.einsum("ij,ij->i", taps, there) - n_taps
    return [
        Path(
            word.path.book,
            word.node,
            (*word.path.words, word.word),
            (*word.path.said, word.said),
            (*word.path.starts, word.at + word.shift - SHIFT),
            (*word.path.thirds, word.third),
            own[k],
            across[k],
            taps[k],
            (*word.path.explained, float(explained[k])),
        )
        for k, word in enumerate(words)
    ]


def _best_first(sound: WeightedSound, paths: Sequence[Path]) -> list[Path]:
    """Paths by their deficit in explained energy against the best path over the same sound: they end at different
    places."""
    heard = [path.energy(sound, path.end) for path in paths]
    share = _share_of_best([(path.score, energy) for path, energy in zip(paths, heard, strict=True)])
    order = sorted(range(len(paths)), key=lambda k: share * heard[k] - paths[k].score)
    return [paths[k] for k in order]


def _share_of_best(explained: Sequence[tuple[float, float]]) -> float:
    """The share of explained energy for the pair with most explained energy, of pairs of explained and received
    energy."""
    score, energy = max(explained, default=(0.0, 0.0))
    return score / max(energy, TINY)


def _by_place(begun: Sequence[Path], least: float) -> Iterator[list[Path]]:
    """Paths of one word by the place where they begin, the place of the best one first. Paths compete only with those
    from the same place: their shares of the energy compare only over the same sound."""
    left = sorted(begun, key=lambda path: -path.score)
    for _ in range(MOST_BEGINNINGS):
        if not left or left[0].score < least:
            return
        at = left[0].starts[0]
        yield [path for path in left if abs(path.starts[0] - at) < APART][:WIDTH]
        left = [path for path in left if abs(path.starts[0] - at) >= APART]


def _is_within(path: Path, reported: Path) -> bool:
    """Whether a path begins within a sentence in the same voice."""
    return path.book.voice == reported.book.voice and reported.starts[0] - EARLIER <= path.starts[0] < reported.end


def _leaders(paths: Sequence[Path], n: int) -> list[Path]:
    return sorted(paths, key=lambda path: -path.score)[:n]


def _kept(paths: Sequence[Path], leaders: Sequence[Path]) -> list[Path]:
    return [path for path in paths if not any(_is_behind(path, leader) for leader in leaders)]


def _is_behind(path: Path, leader: Path) -> bool:
    """Whether another path explains much more of the same sound; what begins after its end may be another sentence."""
    explained = leader.explained_until(path.end + NEAR)
    return path.starts[0] < leader.end and explained > BEHIND_SHARE * path.score + BEHIND


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
