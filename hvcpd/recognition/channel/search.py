"""The channel search: the sentences that explain most of a segment of sound, whatever channel they came through.

First words are sought everywhere, and extended word by word; at each place where a sentence may begin the paths that
explain most are kept (a beam). A response has few taps while little energy is explained, and up to TAPS
later, because each tap explains one variance of noise by chance.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.addressees import GREETING
from hvcpd.language.graph import WordGraph, lengths_of
from hvcpd.ports import Samples, samples_in
from hvcpd.recognition.channel.estimation import FIRST_TAPS, MAX_SHIFT, TAPS, WhitenedSound
from hvcpd.recognition.channel.known import KnownResponse
from hvcpd.recognition.channel.path import Extension, Path, RenderedVoice, Rendering, extended, may_have, sayable
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.frontend import TINY

I_AM = ("i", "am")
"""The words before a robot's own name."""
ENERGY_PER_TAP = 6.0
"""Explained energy for each tap."""
LEAST_START = 35.0
"""Least explained energy of a first word: steady noise reaches 20, and the least of any reported sentence was 78."""
ROBOT_SCORE = 450.0
"""Explained energy, in variances of the noise, from which on a robot spoke, whatever it said: chance and other talk
reach 390. After a sentence was removed a first word must have as much: its late echoes reached 306 (4 searches), and
the least of seven sentences reported beside another was 1,984."""
MAX_STARTS_OF_WORD = 3
"""Maximum number of starts of each word in each voice."""
MAX_STARTS = 20
"""Maximum number of samples at which sentences may start, and of paths in progress that count."""
MIN_DISTANCE = samples_in(0.1)
"""Least distance between these samples."""
BEHIND_SHARE, BEHIND = 1.25, 150.0
"""Ratio and difference of explained energy by which another path must be ahead at a path's end for it to be dropped."""
BEAM_WIDTH = 8
"""Maximum number of active paths that start at one of them, over all voices."""
MAX_EXTENSIONS = 48
"""Maximum number of extensions whose channel is estimated."""
ECHO_LEAD = samples_in(0.6)
"""Longest time before a reported sentence within which a path in the same voice is an echo of it."""


@dataclass(frozen=True, eq=False)
class ChannelSegment:
    """Sound, shape (n,), from sample `origin` on. Its first `lead` samples are from before the speech.
    `cut`: sound went on after it."""

    sound: Samples
    origin: int
    lead: int
    cut: bool = False


@dataclass(frozen=True)
class SearchResult:
    """The sentences in a segment; the likeliest path otherwise, if it shows that a robot spoke; and the paths in
    progress at its end, the best first, in samples of the stream."""

    sentences: tuple[Recognised, ...] = ()
    best: Path | None = None
    in_progress: tuple[Path, ...] = ()
    likeliest: tuple[str, ...] = ()
    """The words of the likeliest whole sentence, however unsure; none if no robot spoke."""
    sure_at: int = sys.maxsize
    """The sample by which a sentence has ended that is sure unless more words follow."""

    @property
    def robot(self) -> bool:
        """Whether a robot said something else than the sentences."""
        return self.best is not None


class ChannelSearch:
    """Searches for the sentences of a graph in the voices that may speak."""

    def __init__(self, graph: WordGraph, books: Sequence[RenderedVoice]) -> None:
        self._books = books
        self._graph = graph
        self._lengths = lengths_of(graph)

    def paths(
        self,
        sound: WhitenedSound,
        reported: Sequence[Path] = (),
        greeted: bool = False,
        known: Mapping[str, KnownResponse] | None = None,
    ) -> list[Path]:
        """Sentences and partial sentences, those that explain most first. They start anywhere, if `greeted` with the
        greeting. None in the voice of a `reported` sentence starts within it: those would be its late echoes. If
        responses are `known`, only these voices are sought, and only through them."""
        found: list[Path] = []
        begun = self._started(sound, greeted, known)
        new = [path for path in begun if not any(_is_within(path, each) for each in reported)]
        for level in _by_start(new, ROBOT_SCORE if reported and known is None else LEAST_START):
            best = by_score(found)[:1]
            while level := pruned(level, best):
                found += level
                level = self._extend(sound, level)
        return by_score(found)

    def is_whole(self, path: Path) -> bool:
        """Whether a path is a sentence."""
        return path.node in self._graph.finals and path.ends

    def _started(self, sound: WhitenedSound, greeted: bool, known: Mapping[str, KnownResponse] | None) -> list[Path]:
        """Paths of one word, if `greeted` of the greeting, at its best starts."""
        first: list[Extension] = []
        words = [each for each in self._graph.following[self._graph.start] if not greeted or each[0] == GREETING]
        for book in self._books:
            if known is not None and book.voice not in known:
                continue
            through = None if known is None else known[book.voice]
            empty = Path.empty(book, self._graph.start, through)
            for word, node in words:
                there = sayable(self._graph, book, word, 0, node)
                places = [place for said in there for place in _starts(sound, said, through)]
                best = sorted(places, key=lambda place: -place[0])[:MAX_STARTS_OF_WORD]
                first += [Extension(empty, word, node, 0, said, at, MAX_SHIFT, 0.0) for _, said, at in best]
        alike = groupby(first, lambda each: each.path.known)
        return [path for _, each in alike for path in extended(sound, list(each), FIRST_TAPS)]

    def _extend(self, sound: WhitenedSound, level: Sequence[Path]) -> list[Path]:
        """The paths extended by one word."""
        extensions = [each for path in level for each in self._extensions(sound, path)]
        promising = by_deficit(sound, extensions)[:MAX_EXTENSIONS]
        enough = max([1.0, *(each.score / ENERGY_PER_TAP for each in promising)])
        n_taps = min(TAPS, max(FIRST_TAPS, 1 << int(np.log2(enough))))
        paths = by_deficit(sound, extended(sound, promising, n_taps))
        return pruned(paths, by_score(paths)[:4])[:BEAM_WIDTH]

    def _extensions(self, sound: WhitenedSound, path: Path) -> Iterator[Extension]:
        """The possible next words that are expected to explain some energy through the path's own response."""
        third, last = path.thirds[-1], path.renderings[-1]
        place = path.starts[-1] + last.advance
        there = [
            (word, node, later, said, at)
            for word, node in self._graph.following[path.node]
            if path.words[-2:] != I_AM or word not in path.book.others
            for later in {third, min(third + 1, 2)}
            if may_have((*path.thirds, later), self._lengths[node])
            for said in sayable(self._graph, path.book, word, later, node)
            if (at := place - said.lead * last.final) + said.length <= sound.n
        ]
        if not there:
            return
        shifts, gains = path.expected_gains(sound.fits((said, at) for *_, said, at in there))
        for (word, node, later, said, at), shift, gain in zip(there, shifts.tolist(), gains.tolist(), strict=True):
            if gain > 0.0:
                yield Extension(path, word, node, later, said, at, shift, path.score + gain)


def _starts(
    sound: WhitenedSound, said: Rendering, known: KnownResponse | None
) -> Iterator[tuple[float, Rendering, int]]:
    """The best starts of a rendering of which at least half was heard: the energy of the correlation in a stretch of
    FIRST_TAPS, or through a known response, the rendering, and its first sample there."""
    n = sound.n - said.length // 2
    if n <= 0:
        return
    if known is None:
        energies, step = stretch_energies(sound.correlation(said, -said.lead, n + FIRST_TAPS)), MAX_SHIFT
    else:
        energies, step = np.square(np.maximum(sound.correlation(said, -said.lead, n, known.taps), 0.0)), 1
    across = FIRST_TAPS // step
    for _ in range(MAX_STARTS_OF_WORD):
        best = int(energies.argmax())
        if energies[best] <= 0.0:
            return
        yield float(energies[best]), said, best * step - said.lead
        energies[max(best - across, 0) : best + across] = 0.0


def _is_within(path: Path, reported: Path) -> bool:
    """Whether a path begins within a sentence in the same voice."""
    return path.book.voice == reported.book.voice and reported.starts[0] - ECHO_LEAD <= path.starts[0] < reported.end


def _by_start(begun: Sequence[Path], least: float) -> Iterator[list[Path]]:
    """Paths of one word, grouped by their start, that of the best path first. Only paths with the same start compete,
    since their shares of the energy compare only over the same sound."""
    left = by_score(begun)
    for _ in range(MAX_STARTS):
        if not left or left[0].score < least:
            return
        at = left[0].starts[0]
        yield [path for path in left if abs(path.starts[0] - at) < MIN_DISTANCE][:BEAM_WIDTH]
        left = [path for path in left if abs(path.starts[0] - at) >= MIN_DISTANCE]


Tried = TypeVar("Tried", Path, Extension)


def by_deficit(sound: WhitenedSound, paths: Sequence[Tried]) -> list[Tried]:
    """Paths by their deficit in explained energy against the best path over the same sound: their ends differ."""
    heard = [(path.score, path.energy(sound), path) for path in paths]
    score, energy = max((each[:2] for each in heard), default=(0.0, 0.0))
    share = score / max(energy, TINY)
    return [path for *_, path in sorted(heard, key=lambda each: share * each[1] - each[0])]


def by_score(paths: Sequence[Path]) -> list[Path]:
    """Paths sorted by the energy that they explain, most first."""
    return sorted(paths, key=lambda path: -path.score)


def pruned(paths: Sequence[Path], ahead: Sequence[Path]) -> list[Path]:
    """The paths that are not far behind any of those `ahead` (pruning)."""
    return [path for path in paths if not any(_is_behind(path, leader) for leader in ahead)]


def _is_behind(path: Path, leader: Path) -> bool:
    """Whether another path explains much more of the same sound; what begins after its end may be another sentence."""
    explained = leader.explained_until(path.end)
    return path.starts[0] < leader.end and explained > BEHIND_SHARE * path.score + BEHIND


def stretch_energies(correlations: NDArray[np.floating]) -> NDArray[np.float64]:
    """The energies of correlations, shape (..., n), in stretches of FIRST_TAPS lags from every MAX_SHIFT-th on."""
    n = correlations.shape[-1] // MAX_SHIFT
    squares = np.square(correlations[..., : n * MAX_SHIFT], dtype=np.float32)
    blocks = squares.reshape(*squares.shape[:-1], n, MAX_SHIFT).sum(axis=-1)
    total = np.zeros((*squares.shape[:-1], n + 1))
    total[..., 1:] = np.cumsum(blocks, axis=-1)
    across = FIRST_TAPS // MAX_SHIFT
    return total[..., across:] - total[..., :-across]
