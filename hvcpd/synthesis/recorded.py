"""A voice that a person lent: words from recordings, put together as the synthesizer's own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from hvcpd.errors import PhraseError
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.articulation import LEAD_S
from hvcpd.synthesis.homographs import Place
from hvcpd.synthesis.leveling import audible, fade, leveled
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import OVERLAP_S, Speaker, UnitPosition
from hvcpd.synthesis.voices import VOICES


class RecordedSpeaker(Speaker):
    """Speaks with recorded words. One recording of a word serves everywhere in a sentence, at its own pitch."""

    def __init__(self, recordings: Mapping[str, Samples], lexicon: Lexicon) -> None:
        """`recordings[word]`: the sound of that word alone, any silence around it, shape (n,)."""
        super().__init__(VOICES[0], lexicon)
        self._recordings = {word.lower(): prepared(sound) for word, sound in recordings.items()}

    def missing(self, words: Iterable[str]) -> list[str]:
        """Which of the words have no recording, or one without sound; each once, sorted."""
        return sorted({word.lower() for word in words if not len(self._recordings.get(word.lower(), ()))})

    def unit(self, word: str, position: UnitPosition, pitch: float = 1.0, place: Place | None = None) -> Samples:
        """The recording, ready to be joined, one for every position, pitch and place. PhraseError if there is none."""
        del position, pitch, place
        if self.missing([word]):
            raise PhraseError(f"this voice has no recording of '{word}'; record it as {word.lower()}.wav")
        return self._recordings[word.lower()]


def prepared(sound: Samples) -> Samples:
    """A recorded word at the level of all units, the silence cut to the joints, its ends faded; read-only.

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
