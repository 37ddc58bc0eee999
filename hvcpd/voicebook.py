"""What robots' voices say, sample by sample, for who listens to their waveform."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeVar

from hvcpd.ports import Samples
from hvcpd.recognition.matched import Spectrum, power_of
from hvcpd.synthesis.speaker import PITCH_STEPS, Joined, Speaker

KEPT = 80
"""Words with their pitch of which the sounds are kept in memory, of all voices, at most: 5 MB. The cache has the
others; twice as many save no time."""
NOTED = 2000
"""Words with their pitch of which it is noted how they join others, in each book, at most: 1 MB."""

Key = tuple[int, str, int]
Sounds = tuple[Samples, ...]
Made = TypeVar("Made")


class MadeWhenAsked(Mapping[str, Made]):
    """The words of a voice, or the voices themselves, one at a time: all sounds together would be most of the daemon's
    memory."""

    def __init__(self, names: Iterable[str], make: Callable[[str], Made]) -> None:
        self._names = tuple(names)
        self._make = make

    def __getitem__(self, name: str) -> Made:
        return self._make(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


class Shelf:
    """Where books keep the sounds that they were asked for last."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Key, Sounds] = OrderedDict()

    def __len__(self) -> int:
        """Words with their pitch that are in memory."""
        return len(self._kept)

    def get(self, key: Key, made: Callable[[], Sounds]) -> Sounds:
        """What is kept under the key, or what is made now."""
        found = self._kept.get(key)
        if found is None:
            found = self._kept[key] = made()
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        else:
            self._kept.move_to_end(key)
        return found

    def drop(self, book: int) -> None:
        """Forget all of one book."""
        for key in [key for key in self._kept if key[0] == book]:
            del self._kept[key]


@dataclass(frozen=True, eq=False, slots=True)
class SpokenWay:
    """One way to say a word, see `paths.Said`; number `number` of the ways in its book."""

    book: SpokenBook
    word: str
    third: int
    number: int
    length: int
    final: bool
    lead: int
    advance: int

    @property
    def samples(self) -> Samples:
        """Its sound, shape (length,)."""
        return self.book.sounds(self.word, self.third)[self.number]

    @property
    def power(self) -> Spectrum:
        """Its `power_of`."""
        return self.book.power(self)


class SpokenBook:
    """One speaker's words, each rendered or read from the cache when it is asked for."""

    def __init__(self, voice: str, speaker: Speaker, words: Iterable[str], shelf: Shelf | None = None) -> None:
        """`voice`: what listeners call it; `words`: those that it may say; `shelf`: shared with other books."""
        self.voice = voice
        self._speaker = speaker
        self._words = frozenset(words)
        self._powers: dict[SpokenWay, Spectrum] = {}
        self._ways: dict[tuple[str, int], tuple[SpokenWay, ...]] = {}
        self._shelf = shelf if shelf is not None else Shelf()

    def said(self, word: str, third: int) -> tuple[SpokenWay, ...]:
        """All ways to say `word` in a third (0, 1, 2) of a sentence; none if it is no word of this voice."""
        ways = self._ways.get((word, third))
        if ways is None:
            if len(self._ways) >= NOTED:
                self._ways.clear()
                self._powers.clear()
            ways = self._ways[word, third] = self._joined(word, third)
        return ways

    def sounds(self, word: str, third: int) -> Sounds:
        """The sounds of all ways to say a word of this voice."""
        return self._shelf.get((id(self), word, third), lambda: _sounds(self._made(word, third)))

    def power(self, way: SpokenWay) -> Spectrum:
        """The `power_of` one of the ways."""
        found = self._powers.get(way)
        if found is None:
            found = self._powers[way] = power_of(way.samples)
        return found

    def forget(self) -> None:
        """Give back memory: nobody has spoken for a while."""
        self._shelf.drop(id(self))
        self._powers.clear()

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Render all that may be asked for into the cache, while `go_on`. Takes seconds; another thread may do it."""
        for word in sorted(self._words):
            for pitch in PITCH_STEPS:
                if go_on():
                    self._speaker.joined(word, pitch)

    def _joined(self, word: str, third: int) -> tuple[SpokenWay, ...]:
        made = self._made(word, third)
        self._shelf.get((id(self), word, third), lambda: _sounds(made))
        return tuple(
            SpokenWay(self, word, third, number, len(each.samples), each.final, each.lead, each.advance)
            for number, each in enumerate(made)
        )

    def _made(self, word: str, third: int) -> list[Joined]:
        if word not in self._words:
            return []
        return [each for each in self._speaker.joined(word, PITCH_STEPS[third]) if len(each.samples)]


def _sounds(made: Iterable[Joined]) -> Sounds:
    return tuple(each.samples for each in made)
