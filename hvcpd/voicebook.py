"""What robots' voices say, sample by sample, for who listens to their waveform."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable

from hvcpd.recognition.matched import Spectrum, power_of
from hvcpd.recognition.paths import Said
from hvcpd.synthesis.speaker import PITCH_STEPS, Joined, Speaker

KEPT = 90
"""Words with their pitch of which a voice's sounds are kept in memory, at most: 5 MB. The cache has the others."""


class SpokenBook:
    """One speaker's words, each rendered or read from the cache when it is asked for."""

    def __init__(self, voice: str, speaker: Speaker, words: Iterable[str]) -> None:
        """`voice`: what listeners call it; `words`: those that it may say."""
        self.voice = voice
        self._speaker = speaker
        self._words = frozenset(words)
        self._powers: dict[tuple[str, int, int], Spectrum] = {}
        self._kept: OrderedDict[tuple[str, int], tuple[Said, ...]] = OrderedDict()

    def said(self, word: str, third: int) -> tuple[Said, ...]:
        """All ways to say `word` in a third (0, 1, 2) of a sentence; none if it is no word of this voice."""
        key = (word, third)
        if key not in self._kept:
            self._kept[key] = self._made(word, third)
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]

    def __len__(self) -> int:
        """Words with their pitch that are in memory."""
        return len(self._kept)

    def forget(self) -> None:
        """Give back memory: nobody has spoken for a while."""
        self._kept.clear()
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
