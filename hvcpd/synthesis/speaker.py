"""One robot's voice: words to sound, put together from rendered word units."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache, partial
from itertools import accumulate, cycle

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.articulation import controls_for
from hvcpd.synthesis.dictionary import Pronunciation
from hvcpd.synthesis.homographs import Place, place_in
from hvcpd.synthesis.klatt import synthesize
from hvcpd.synthesis.leveling import audible, fade, level_gain, leveled
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.natural import unaccented, word_sound
from hvcpd.synthesis.placement import LEAD_S
from hvcpd.synthesis.shipped import from_steps, in_steps
from hvcpd.synthesis.unit_cache import UnitCache, key_of
from hvcpd.synthesis.voices import Voice

PAUSE_S = 0.14
"""Silence at a comma, from the last audible sound to the next (a closure of a stop or the ring of a vowel counts as
silence): long enough to be heard as a pause, short of the recogniser's end of sentence."""

OVERLAP_S = 2.0 * LEAD_S
"""Overlap of the units of neighbouring words, which are cross-faded: the end of one word's last phone and the start of
the next word's first one fall together in its middle."""

PITCH_STEPS = (1.03, 1.0, 0.97)
"""The declination of a sentence in steps, relative to the voice's pitch: first, middle and last third. Few, so that
units can be cached, and small, so that a word sounds like its template wherever it stands; people's pitch falls by
about 10 to 20 % over a sentence."""


UNITS_KEPT = 32
"""Maximum number of units kept in memory, 1 MB, where a cache on the disk has the others. A sentence has 25 at most, to
read one takes 0.06 ms, and all 708 that a robot may come to say in a day are 22 MB."""


class UnitPosition(Enum):
    """Where in a phrase a word stands: followed by another word, or by a pause."""

    MEDIAL = "medial"
    FINAL = "final"


@dataclass(frozen=True)
class Joined:
    """One rendering of a word, shape (n,), and how it joins its neighbours: in samples, how much of it precedes its
    audible part, which is left to the pause before it; and from its start to that of the next word, or to where the
    next word is to be audible if it is `final`, before a pause."""

    samples: Samples
    final: bool
    lead: int
    advance: int


class Speaker:
    """Speaks with one voice. Units are kept in memory: all of them, or the last ones where `cache` has them on disk."""

    def __init__(self, voice: Voice, lexicon: Lexicon, cache: UnitCache | None = None) -> None:
        self.voice = voice
        self._lexicon = lexicon
        self._make = partial(_make, voice, cache)  # does not know the speaker, or units would stay until a collection
        self._said = lru_cache(UNITS_KEPT if cache is not None else None)(self._make)

    def unit(self, word: str, position: UnitPosition, pitch: float = 1.0, place: Place | None = None) -> Samples:
        """One word as sound, shape (n,), read-only; `pitch` multiplies the voice's pitch.

        `place` chooses among the pronunciations of such as "wind". A word without letters or digits gives an
        empty unit.
        """
        return self._said(self._phones(word, self._lexicon.pronounce(word, place), position), position, pitch)

    def _phones(self, word: str, phones: Pronunciation, position: UnitPosition) -> Pronunciation:
        """A pronunciation as this voice says it there: a natural one gives no accent to "the", "I" or "am" in a
        phrase."""
        medial = position is UnitPosition.MEDIAL
        return unaccented(word, phones) if self.voice.natural and medial else phones

    def _spoken(self, word: str) -> list[tuple[Pronunciation, UnitPosition]]:
        """All that a sentence may have of a word: each pronunciation before another word and before a pause."""
        return [
            (self._phones(word, phones, position), position)
            for phones in self._lexicon.spoken(word)
            for position in UnitPosition
        ]

    def keyed(self, word: str, pitch: float = 1.0) -> Iterator[tuple[str, Samples]]:
        """Yield each rendering of a word at that pitch under its key in a unit cache."""
        for phones, position in self._spoken(word):
            yield key_of(_content(self.voice, phones, position, pitch)), self._make(phones, position, pitch)

    def templates(self, word: str, ends: Collection[UnitPosition] = tuple(UnitPosition)) -> list[Samples]:
        """Return the renderings of a word that `render` uses, at the voice's own pitch: shape (n,) each.

        There is one for every pronunciation that a phrase may ask for and each of `ends`, as `inner` leaves it.
        """
        spoken = [(phones, position) for phones, position in self._spoken(word) if position in ends]
        return [inner(self._said(phones, position, 1.0), position) for phones, position in spoken]

    def joined(self, word: str, pitch: float, phrases: Sequence[Sequence[str]] = ()) -> list[Joined]:
        """Return all renderings of a word at that pitch of `PITCH_STEPS`, of every pronunciation and of the `phrases`
        that count as it; not kept in memory."""
        sounds = self.sounds(word, pitch) + [sound for phrase in phrases for sound in self.phrase_sounds(phrase, pitch)]
        return [joined(unit, end is UnitPosition.FINAL) for unit, end in zip(sounds, cycle(UnitPosition), strict=False)]

    def sounds(self, word: str, pitch: float) -> list[Samples]:
        """Return the waveforms of `joined` alone, shape (n,) each, float32."""
        return [self._make(phones, position, pitch) for phones, position in self._spoken(word)]

    def phrase_templates(self, words: Sequence[str]) -> list[Samples]:
        """Return the templates of several words said as one, before another word and before a pause: shape (n,) each,
        as `templates`."""
        return [inner(unit, end) for unit, end in zip(self.phrase_sounds(words), UnitPosition, strict=True)]

    def phrase_sounds(self, words: Sequence[str], pitch: float = 1.0) -> list[Samples]:
        """Return the waveforms of several words said as one, before another word and before a pause, shape (n,) each,
        float32."""
        overlap = round(OVERLAP_S * SAMPLE_RATE_HZ)
        found = []
        for end in UnitPosition:
            units = [self.unit(word, UnitPosition.MEDIAL, pitch) for word in words[:-1]]
            units = [unit for unit in (*units, self.unit(words[-1], end, pitch)) if len(unit)]
            starts = accumulate((len(unit) - overlap for unit in units), initial=0)
            found.append(_overlaid(list(zip(starts, units, strict=False))))
        return found

    def render(self, phrases: Sequence[Sequence[str]]) -> Samples:
        """Return a sentence as sound, shape (n,), float32 at 16 kHz: groups of words, between which the speaker
        pauses."""
        out = _overlaid(self.placed(phrases))
        out *= level_gain(out)  # joints and pauses change the loudness of the whole by up to 1.5 LU
        return out

    def placed(self, phrases: Sequence[Sequence[str]]) -> list[tuple[int, Samples]]:
        """Return the units of a sentence's words, shape (n,) each, and the sample of the sentence at which each
        starts."""
        spoken = [
            (word, number == len(phrase) - 1, place_in(phrase, number))
            for phrase in phrases
            for number, word in enumerate(phrase)
        ]
        placed: list[tuple[int, Samples]] = []
        cursor, after_pause = 0, True
        for number, (word, final, place) in enumerate(spoken):
            pitch = PITCH_STEPS[min(len(PITCH_STEPS) - 1, len(PITCH_STEPS) * number // len(spoken))]
            unit = self.unit(word, UnitPosition.FINAL if final else UnitPosition.MEDIAL, pitch, place)
            if not len(unit):
                continue
            piece = joined(unit, final)
            if after_pause:
                cursor = max(cursor - piece.lead, 0)
            after_pause = final
            placed.append((cursor, unit))
            cursor += piece.advance
        return placed


def _content(voice: Voice, phones: Pronunciation, position: UnitPosition, pitch: float) -> tuple[object, ...]:
    """All that makes a unit what it is, beside the synthesizer's source."""
    return phones, voice, position.value, pitch


def _make(
    voice: Voice, cache: UnitCache | None, phones: Pronunciation, position: UnitPosition, pitch: float
) -> Samples:
    if not phones:
        return np.zeros(0, dtype=np.float32)

    def fresh() -> Samples:
        final = position is UnitPosition.FINAL
        if voice.natural:
            sound = word_sound(phones, voice, final, pitch)
        else:
            sound = synthesize(controls_for(phones, voice, final, pitch))
        return from_steps(in_steps(fade(leveled(sound), OVERLAP_S)))

    unit = fresh() if cache is None else cache.get(_content(voice, phones, position, pitch), fresh)
    unit.flags.writeable = False
    return unit


def _overlaid(pieces: Sequence[tuple[int, Samples]]) -> Samples:
    """The sum of units, shape (n,) each, from their samples `start` on; empty without any."""
    out = np.zeros(max((start + len(unit) for start, unit in pieces), default=0), dtype=np.float32)
    for start, unit in pieces:
        out[start : start + len(unit)] += unit
    return out


def inner(unit: Samples, position: UnitPosition) -> Samples:
    """Return a unit, shape (n,), without the outer half of each joint: there a sentence has the neighbouring word's
    sound too."""
    edge = round(LEAD_S * SAMPLE_RATE_HZ)
    return unit[edge:] if position is UnitPosition.FINAL else unit[edge : len(unit) - edge]


def joined(unit: Samples, final: bool) -> Joined:
    """Return a rendered word, shape (n,), with how it joins its neighbours."""
    begin, end = audible(unit)
    advance = end + round(PAUSE_S * SAMPLE_RATE_HZ) if final else len(unit) - round(OVERLAP_S * SAMPLE_RATE_HZ)
    return Joined(unit, final, begin, advance)
