"""What robots' voices say, sample by sample, for who listens to their waveform."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable

from hvcpd.recognition.matched import Spectrum, power_of
from hvcpd.recognition.paths import Said
from hvcpd.synthesis.speaker import PITCH_STEPS, Joined, Speaker

KEPT = 150
"""Words with their pitch of which the sounds are kept in memory, of all voices, at most: 9 MB. The cache has the
others; one who speaks needs some 90."""

Key = tuple[int, str, int]


class Shelf:
    """Where books keep what they were asked for last."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Key, tuple[Said, ...]] = OrderedDict()

    def __len__(self) -> int:
        """Words with their pitch that are in memory."""
        return len(self._kept)

    def get(self, key: Key, made: Callable[[], tuple[Said, ...]]) -> tuple[Said, ...]:
        """What is kept under the key, or what is made now."""
        if key not in self._kept:
            self._kept[key] = made()
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]

    def drop(self, book: int) -> None:
        """Forget all of one book."""
        for key in [key for key in self._kept if key[0] == book]:
            del self._kept[key]


class SpokenBook:
    """One speaker's words, each rendered or read from the cache when it is asked for."""

    def __init__(self, voice: str, speaker: Speaker, words: Iterable[str], shelf: Shelf | None = None) -> None:
        """`voice`: what listeners call it; `words`: those that it may say; `shelf`: shared with other books."""
        self.voice = voice
        self._speaker = speaker
        self._words = frozenset(words)
        self._powers: dict[tuple[str, int, int], Spectrum] = {}
        self._shelf = shelf if shelf is not None else Shelf()

    def said(self, word: str, third: int) -> tuple[Said, ...]:
        """All ways to say `word` in a third (0, 1, 2) of a sentence; none if it is no word of this voice."""
        return self._shelf.get((id(self), word, third), lambda: self._made(word, third))

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

    def _made(self, word: str, third: int) -> tuple[Said, ...]:
        if word not in self._words:
            return ()
        ways = self._speaker.joined(word, PITCH_STEPS[third])
        return tuple(
            self._with_power(each, (word, third, number)) for number, each in enumerate(ways) if len(each.samples)
        )

    def _with_power(self, each: Joined, key: tuple[str, int, int]) -> Said:
        if key not in self._powers:
            self._powers[key] = power_of(each.samples)
        return Said(each.samples, each.final, each.lead, each.advance, self._powers[key])
