"""What robots' voices say, sample by sample, for who listens to their waveform."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from hvcpd.ports import Samples
from hvcpd.recognition.matched import Spectrum, power_of
from hvcpd.recognition.rounded import Rounded, restored, rounded
from hvcpd.synthesis.speaker import PITCH_STEPS, Speaker

KEPT = 80
"""Words with their pitch of which the sounds are kept in memory, of all voices, at most: 2.5 MB. The cache has the
others; twice as many save no time."""
POWERS_KEPT = 600
"""Likewise ways to say a word of which the `power_of` is: 1.2 MB."""
NOTED = 2000
"""Words with their pitch of which it is noted how they join others, in each book, at most: 1 MB."""

Sounds = tuple[Rounded, ...]
Key = TypeVar("Key", bound=Hashable)
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


class LastAsked(Generic[Key, Made]):
    """What was asked for last, at most `most` of it."""

    def __init__(self, most: int) -> None:
        self._kept: OrderedDict[Key, Made] = OrderedDict()
        self._most = most

    def __len__(self) -> int:
        return len(self._kept)

    def get(self, key: Key, made: Callable[[], Made]) -> Made:
        """What is kept under the key, or what is made now."""
        found = self._kept.get(key)
        if found is None:
            found = self._kept[key] = made()
            if len(self._kept) > self._most:
                self._kept.popitem(last=False)
        else:
            self._kept.move_to_end(key)
        return found

    def clear(self) -> None:
        """Forget it all."""
        self._kept.clear()


class Shelf:
    """Where books keep what they were asked for last: sounds by book, word and third, and powers by the way."""

    def __init__(self) -> None:
        self.sounds: LastAsked[tuple[int, str, int], Sounds] = LastAsked(KEPT)
        self.powers: LastAsked[SpokenWay, Spectrum] = LastAsked(POWERS_KEPT)


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
        return restored(self.book.sounds(self.word, self.third)[self.number])

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
        self._ways: dict[tuple[str, int], tuple[SpokenWay, ...]] = {}
        self._shelf = shelf if shelf is not None else Shelf()

    def said(self, word: str, third: int) -> tuple[SpokenWay, ...]:
        """All ways to say `word` in a third (0, 1, 2) of a sentence; none if it is no word of this voice."""
        ways = self._ways.get((word, third))
        if ways is None:
            if len(self._ways) >= NOTED:
                self._ways.clear()
            ways = self._ways[word, third] = self._joined(word, third)
        return ways

    def sounds(self, word: str, third: int) -> Sounds:
        """The sounds of all ways to say a word of this voice."""
        key = (id(self), word, third)
        return self._shelf.sounds.get(key, lambda: _kept(self._speaker.sounds(word, PITCH_STEPS[third])))

    def power(self, way: SpokenWay) -> Spectrum:
        """The `power_of` one of the ways."""
        return self._shelf.powers.get(way, lambda: power_of(way.samples))

    def forget(self) -> None:
        """Give back memory: nobody has spoken for a while, in any voice."""
        self._shelf.sounds.clear()
        self._shelf.powers.clear()

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Render all that may be asked for into the cache, while `go_on`. Takes seconds; another thread may do it."""
        for word in sorted(self._words):
            for pitch in PITCH_STEPS:
                if go_on():
                    self._speaker.joined(word, pitch)

    def _joined(self, word: str, third: int) -> tuple[SpokenWay, ...]:
        made = self._speaker.joined(word, PITCH_STEPS[third]) if word in self._words else []
        self._shelf.sounds.get((id(self), word, third), lambda: _kept(each.samples for each in made))
        return tuple(
            SpokenWay(self, word, third, number, len(each.samples), each.final, each.lead, each.advance)
            for number, each in enumerate(made)
            if len(each.samples)
        )


def _kept(sounds: Iterable[Samples]) -> Sounds:
    return tuple(map(rounded, sounds))
