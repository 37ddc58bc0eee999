"""Searches the sentence that explains most of a piece of sound, whatever channel it came through.

A path through the word network is a known signal, each word at the sample that the one before says. Its score is the
energy of what was heard that it explains through the response that fits it best: every path has an estimate of its own
("per-survivor processing", R. Raheli, A. Polydoros, C. Tzou, IEEE Trans. Communications 43, 1995). The normal equations
of a path are the sums over its words, so that a word more costs one correlation. A response has few taps as long as
little is explained, and up to TAPS, as each tap explains one variance of noise by chance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.recognition.channel.response import Taps, response
from hvcpd.recognition.channel.weighting import SHIFT, TAPS, WeightedSound
from hvcpd.recognition.paths import Said, Voicebook, thirds_of

FIRST_TAPS = 64
"""4 ms: of a first word, all that is known of most loudspeakers without a room."""
ENOUGH = 6.0
"""Explained energy for each tap."""
BLOCK = 16
"""Lags that are told apart where beginnings are sought."""
PLACES = 6
"""Beginnings of each word."""
STARTS = 64
WIDE, NARROW = 32, 16
"""Paths that are followed, up to WIDE_WORDS words and after them."""
WIDE_WORDS = 4
TRIED = 48
"""Of all next words, those whose response is estimated anew."""
MISFIT = 0.6
"""A next word is none if it would explain so much of its own energy less than nothing."""
BEHIND_SHARE, BEHIND = 1.25, 150.0
"""A path is dropped if another one had so much more explained at its end."""
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
        """Whether it may be whole: a pause follows, and its words stand in the thirds that a sentence of so many has."""
        return self.said[-1].final and self.thirds == thirds_of(len(self.words))

    def explained_until(self, sample: int) -> float:
        """What its words explain that end before that sample."""
        ends = (start + said.length for start, said in zip(self.starts, self.said, strict=True))
        return max((e for end, e in zip(ends, self.explained, strict=True) if end <= sample), default=0.0)

    def with_taps(self, n: int) -> tuple[Taps, float]:
        """The response of `n` taps that fits it best, and what it explains then."""
        taps = response(self.autocorrelation, self.correlation, n)
        return taps, float(taps @ self.correlation[:n]) - n


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


class ChannelSearch:
    """Knows who may speak, and what."""

    def __init__(self, graph: WordGraph, books: Sequence[Voicebook]) -> None:
        self._books = books
        self._graph = graph
        self._arcs: dict[int, list[tuple[str, int]]] = {}
        for arc in graph.arcs:
            self._arcs.setdefault(arc.source, []).append((arc.word, arc.target))
        self._pauses = graph.pauses | graph.finals

    def paths(self, sound: WeightedSound, first: int, last: int) -> list[Path]:
        """Sentences, and beginnings of some, that begin between samples `first` and `last`: those that explain most
        first."""
        found: list[Path] = []
        level = self._begun(sound, first, last)
        while level:
            found += level
            level = self._extended(sound, level)
        return sorted(found, key=lambda path: -path.score)

    def is_whole(self, path: Path) -> bool:
        """Whether a path is a sentence."""
        return path.node in self._graph.finals and path.ends

    def _said(self, book: Voicebook, word: str, third: int, node: int) -> Iterator[Said]:
        return (said for said in book.said(word, third) if not said.final or node in self._pauses)

    def _begun(self, sound: WeightedSound, first: int, last: int) -> list[Path]:
        """Paths of one word, at the best places of each."""
        places: list[tuple[float, Voicebook, str, int, Said, int]] = []
        for book in self._books:
            for word, node in self._arcs.get(self._graph.start, ()):
                for said in self._said(book, word, 0, node):
                    begin = first - said.lead - FIRST_TAPS // 2
                    found, energy = sound.seek(said, begin, last - first + FIRST_TAPS)
                    places += [
                        (gain / max(energy, 1e-9), book, word, node, said, begin + at) for gain, at in _peaks(found)
                    ]
        places.sort(key=lambda place: -place[0])
        paths = []
        for _, book, word, node, said, at in places[: 2 * STARTS]:
            fit = sound.fit(said, at)
            correlation = fit.correlation[SHIFT : SHIFT + TAPS]
            taps = response(fit.autocorrelation, correlation, FIRST_TAPS)
            explained = float(taps @ correlation[:FIRST_TAPS]) - FIRST_TAPS
            paths.append(
                Path(book, node, (word,), (said,), (at,), (0,), fit.autocorrelation, correlation, taps, (explained,))
            )
        paths.sort(key=lambda path: -path.score)
        return paths[:STARTS]

    def _extended(self, sound: WeightedSound, level: Sequence[Path]) -> list[Path]:
        """The paths of one word more."""
        promising = sorted((n for path in level for n in self._next(sound, path)), key=lambda n: -n.promise)[:TRIED]
        if not promising:
            return []
        enough = max(promising[0].promise / ENOUGH, 1.0)
        n_taps = min(TAPS, max(FIRST_TAPS, 1 << int(np.log2(enough))))
        paths = sorted((_joined(sound, each, n_taps) for each in promising), key=lambda path: -path.score)
        leaders = paths[:4]
        kept = [path for path in paths if not any(_is_behind(path, leader) for leader in leaders)]
        return kept[: WIDE if len(paths[0].words) < WIDE_WORDS else NARROW]

    def _next(self, sound: WeightedSound, path: Path) -> Iterator[_Next]:
        """What may come next, if it promises to explain anything through the path's own response."""
        n = len(path.taps)
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
                    heard = np.correlate(fit.correlation[: n + 2 * SHIFT], path.taps, "valid")
                    shift = int(heard.argmax())
                    own = float(around @ fit.autocorrelation[:n])
                    both = float(around @ _halved(sound.overlap(last, start, said, at)[:n]))
                    gain = 2.0 * (float(heard[shift]) - both) - own
                    if gain > -MISFIT * own:
                        yield _Next(path, word, node, later, said, at, shift, path.score + gain)


def _halved(overlap: Taps) -> Taps:
    """Sums over the lags k and -k, for weights that count either twice."""
    return 0.5 * overlap


def _joined(sound: WeightedSound, word: _Next, n_taps: int) -> Path:
    """A path and one more word."""
    path, fit = word.path, sound.fit(word.said, word.at)
    overlap = sound.overlap(path.said[-1], path.starts[-1], word.said, word.at)
    autocorrelation = path.autocorrelation + fit.autocorrelation + overlap
    correlation = path.correlation + fit.correlation[word.shift : word.shift + TAPS]
    taps = response(autocorrelation, correlation, n_taps)
    explained = float(taps @ correlation[:n_taps]) - n_taps
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
