"""A team whose words are hisses, each its own: no two are alike, and they are made in a moment."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence

import numpy as np

from hvcpd.language.graph import Arc, WordGraph
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.path import Rendering, thirds_of
from hvcpd.recognition.channel.recogniser import ChannelRecogniser
from tests.recognition.way import Way

GRAPH = WordGraph(
    n_nodes=8,
    arcs=(
        Arc(0, 1, "hi"),
        Arc(1, 2, "rob"),
        Arc(1, 2, "bot"),
        Arc(2, 3, "water"),
        Arc(3, 4, "rose"),
        Arc(3, 4, "lily"),
        Arc(2, 4, "stop"),
        Arc(0, 5, "all"),
        Arc(5, 4, "stop"),
        Arc(0, 4, "stop"),
        Arc(5, 6, "who"),
        Arc(0, 6, "who"),
        Arc(6, 7, "is"),
        Arc(7, 4, "here"),
    ),
    start=0,
    finals=frozenset({2, 4}),
    pauses=frozenset({2, 5}),
)
OVERLAP, PAUSE, LEAD = 320, 2240, 160


class Book:
    """A voice whose words are hisses of their own, another one at each pitch."""

    def __init__(self, voice: str, others: frozenset[str] = frozenset()) -> None:
        self.voice = voice
        self.others = others
        self.prepared = False
        self._ways: dict[tuple[str, int], Sequence[Rendering]] = {}

    def renderings(self, word: str, third: int) -> Sequence[Rendering]:
        if (word, third) not in self._ways:
            self._ways[word, third] = self._made(word, third)
        return self._ways[word, third]

    def _made(self, word: str, third: int) -> Sequence[Rendering]:
        ways = []
        for final in (False, True):
            random = np.random.default_rng(zlib.crc32(f"{self.voice} {word} {third} {final}".encode()))
            n = 3200 + 400 * len(word) + 800 * final
            hiss = np.convolve(random.standard_normal(n), [1.0, 0.8, 0.4], "same") * np.hanning(n) ** 0.3
            advance = n + PAUSE if final else n - OVERLAP
            sound = np.asarray(0.1 * hiss, np.float32)
            ways.append(Way(sound, final, LEAD * final, advance))
        return ways

    def free_memory(self) -> None:
        """Nothing is kept."""

    def prepare(self, go_on: Callable[[], bool]) -> None:
        self.prepared = go_on()


BOOKS = {voice: Book(voice) for voice in ("oak", "willow")}


def fresh(*voices: str) -> ChannelRecogniser:
    """A recogniser of these voices, or of all, that has heard nothing."""
    return ChannelRecogniser(GRAPH, tuple(BOOKS[voice] for voice in voices or BOOKS))


def spoken(text: str, voice: str = "oak", book: Book | None = None) -> Samples:
    """The sound of a sentence; a comma is a pause."""
    book = book or BOOKS[voice]
    words = [(word.rstrip(","), word.endswith(",")) for word in text.split()]
    words[-1] = (words[-1][0], True)
    out = np.zeros(160_000, np.float32)
    at, paused, last = 0, False, 0
    for (word, final), third in zip(words, thirds_of(len(words)), strict=True):
        said = book.renderings(word, third)[final]
        at -= said.lead * paused
        out[at : at + said.length] += said.samples
        last = at + said.length
        at, paused = at + said.advance, final
    return out[:last]


def through_a_room(said: Samples, seed: int, seconds: float = 0.03) -> Samples:
    """What a loudspeaker and a room make of it: a random response that decays, with a direct sound."""
    random = np.random.default_rng(seed)
    n = round(seconds * SAMPLE_RATE_HZ)
    taps = random.standard_normal(n) * np.exp(-np.arange(n) / (0.2 * n))
    taps[0] = 4.0
    heard = np.convolve(said, taps)
    return np.asarray(heard / np.sqrt(np.mean(heard**2)), np.float32)


def scene(n: int, *sounds: tuple[int, Samples], noise: float = 0.3, seed: int = 1) -> Samples:
    """Sounds at their places in white noise, shape (n,), all at -26 dBFS where a sound has a mean square of 1."""
    heard = noise * np.random.default_rng(seed).standard_normal(n)
    for at, sound in sounds:
        heard[at : at + len(sound)] += sound
    return np.asarray(0.05 * heard, np.float32)
