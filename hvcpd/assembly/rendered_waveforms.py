"""The waveforms of each word as robots' synthesizers render it, for listeners that compare waveforms."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

from hvcpd.ports import Samples
from hvcpd.synthesis.shipped import Steps, from_steps, in_steps
from hvcpd.synthesis.speaker import PITCH_STEPS, Speaker

KEPT = 160
"""Maximum number of words, by book and pitch, whose waveforms are kept in memory, of all voices and listeners: 5 MB.
All others are on the disk."""
NOTED = 2000
"""Maximum number of words by pitch of which each book knows how they join their neighbours: 1 MB."""

Value = TypeVar("Value")


class LazyMapping(Mapping[str, Value]):
    """A mapping whose values are made at each access and not kept: all templates together would be most of the daemon's
    memory."""

    def __init__(self, names: Iterable[str], make: Callable[[str], Value]) -> None:
        self._names = tuple(names)
        self._make = make

    def __getitem__(self, name: str) -> Value:
        return self._make(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


@dataclass(frozen=True)
class Unit:
    """One rendering of a word: its waveform, shape (n,), and how it joins its neighbours, samples.

    The waveform is in steps: half the memory, and whole numbers, since half floats take a processor eight times as
    long to make.
    """

    sound: Steps
    final: bool
    lead: int
    advance: int


class WaveformCache:
    """A cache of the waveforms used last, shared by several books."""

    def __init__(self) -> None:
        self.units = lru_cache(KEPT)(WaveformBook.render)

    def clear(self) -> None:
        """Free the memory."""
        self.units.cache_clear()


@dataclass(frozen=True, eq=False, slots=True)
class RenderedWord:
    """One rendering of a word, see `channel.path.Rendering`: number `number` of those in its book."""

    book: WaveformBook
    word: str
    third: int
    number: int
    length: int
    final: bool
    lead: int
    advance: int

    @property
    def samples(self) -> Samples:
        """Its waveform, shape (length,), float32, 1.0 = full scale."""
        return from_steps(self.book.units(self.word, self.third)[self.number].sound)


class WaveformBook:
    """One speaker's words, each rendered or read from the disk when it is needed."""

    def __init__(
        self,
        voice: str,
        speaker: Speaker,
        words: Iterable[str],
        cache: WaveformCache | None = None,
        phrases: Mapping[str, Sequence[Sequence[str]]] | None = None,
        others: Iterable[str] = (),
    ) -> None:
        """`voice`: its name among the listeners; `words`: those that it may say; `cache`: shared with other books;
        `phrases`: what counts as a word; `others`: names of robots with other voices, as words."""
        self.voice = voice
        self.others = frozenset(others)
        self._speaker = speaker
        self._words = frozenset(words)
        self._phrases = phrases or {}
        self._cache = cache if cache is not None else WaveformCache()
        self.renderings = lru_cache(NOTED)(self._said)

    def units(self, word: str, third: int) -> tuple[Unit, ...]:
        """All renderings of `word` in a third (0, 1, 2) of a sentence; none if it is no word of this voice."""
        return self._cache.units(self, word, third)

    def free_memory(self) -> None:
        """Free the memory of all books that share this cache: nobody has spoken for a while."""
        self._cache.clear()

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Render all that may be asked for to the disk, and note how it joins its neighbours, while `go_on`. Takes
        seconds; another thread may do it."""
        for word in sorted(self._words):
            for third in range(len(PITCH_STEPS)):
                if go_on():
                    self.renderings(word, third)
            self.free_memory()

    def render(self, word: str, third: int) -> tuple[Unit, ...]:
        """`units`, computed again."""
        if word not in self._words:
            return ()
        made = self._speaker.joined(word, PITCH_STEPS[third], self._phrases.get(word, ()))
        return tuple(Unit(in_steps(each.samples), each.final, each.lead, each.advance) for each in made)

    def _said(self, word: str, third: int) -> tuple[RenderedWord, ...]:
        """All ways to say `word` in a third (0, 1, 2) of a sentence, with their waveforms left in the cache."""
        return tuple(
            RenderedWord(self, word, third, number, len(unit.sound), unit.final, unit.lead, unit.advance)
            for number, unit in enumerate(self.units(word, third))
            if len(unit.sound)
        )
