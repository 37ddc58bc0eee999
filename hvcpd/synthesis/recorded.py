"""A voice that a person lent: words from recordings, put together as the synthesizer's own."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np

from hvcpd.errors import PhraseError
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.homographs import Place
from hvcpd.synthesis.leveling import audible, fade, leveled
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.placement import LEAD_S
from hvcpd.synthesis.speaker import OVERLAP_S, Speaker, UnitPosition, inner
from hvcpd.synthesis.voices import VOICES, Voice


class RecordedSpeaker(Speaker):
    """Speaks with recorded words. One recording of a word serves everywhere in a sentence, at its own pitch."""

    def __init__(self, recordings: Mapping[str, Samples], lexicon: Lexicon, stand_in: Voice | None = None) -> None:
        """`recordings[word]`: the sound of that word alone, any silence around it, shape (n,).

        `stand_in` says words without a recording, such as a name that the robot learns; without it they are an error.
        """
        super().__init__(stand_in or VOICES[0], lexicon)
        self._strict = stand_in is None
        self._recordings = {word.lower(): prepared(sound) for word, sound in recordings.items()}

    def same_as(self, other: RecordedSpeaker) -> bool:
        """Whether the other one has the same words, said alike to the sample."""
        mine, theirs = self._recordings, other._recordings
        return mine.keys() == theirs.keys() and all(np.array_equal(mine[word], theirs[word]) for word in mine)

    def missing(self, words: Iterable[str]) -> list[str]:
        """Which of the words have no recording, or one without sound; each once, sorted."""
        return sorted({word.lower() for word in words if not len(self._recordings.get(word.lower(), ()))})

    def unit(self, word: str, position: UnitPosition, pitch: float = 1.0, place: Place | None = None) -> Samples:
        """Return the recording, shape (n,), float32, ready to be joined, the same for every position, pitch and place.

        Raises PhraseError if there is none and no other voice stands in.
        """
        if self.missing([word]):
            if not self._strict:
                return super().unit(word, position, pitch, place)
            raise PhraseError(f"this voice has no recording of '{word}'; record it as {word.lower()}.wav")
        return self._recordings[word.lower()]

    def sounds(self, word: str, pitch: float) -> list[Samples]:
        """Return the recording twice, shape (n,) each, at its own pitch: before another word and before a pause it
        is the same."""
        if self.missing([word]):
            return [] if self._strict else super().sounds(word, pitch)
        return [self.unit(word, position) for position in UnitPosition]

    def templates(self, word: str, ends: Collection[UnitPosition] = tuple(UnitPosition)) -> list[Samples]:
        """Return the recording as it is heard inside a phrase and before a pause, shape (n,) each; see
        `Speaker.templates`."""
        if not self._strict and self.missing([word]):
            return super().templates(word, ends)
        unit = self.unit(word, UnitPosition.FINAL)
        return [inner(unit, position) for position in UnitPosition if position in ends]


def prepared(sound: Samples) -> Samples:
    """Return a recorded word, shape (n,), float32, at the level of all units, the silence cut to the joints, its ends
    faded; read-only.

    Empty if nothing is to be heard in it.
    """
    sound = np.nan_to_num(np.asarray(sound, dtype=np.float32))
    if len(sound):
        sound = sound - sound.mean(dtype=np.float64).astype(np.float32)  # or a converter's DC would count as sound
    begin, end = audible(sound)
    if end <= begin or np.ptp(sound[begin:end]) <= 0.0:
        return np.zeros(0, dtype=np.float32)
    lead = round(LEAD_S * SAMPLE_RATE_HZ)
    padded = np.pad(sound, (lead, lead))[begin : end + 2 * lead]
    unit = fade(leveled(padded), OVERLAP_S)
    unit.flags.writeable = False
    return unit
