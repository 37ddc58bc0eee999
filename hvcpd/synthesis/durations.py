"""Durations of the phones of a word: Klatt's rules.

D. H. Klatt, "Synthesis by rule of segmental durations in English sentences" (1979): a phone lasts
least + (inherent - least) · percent / 100, and each rule multiplies the percentage.
"""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.synthesis.allophones import allophone
from hvcpd.synthesis.phones import PHONES, Kind, is_vowel, stress_of

FINAL_STRETCH = 1.35
"""Lengthening of the last vowel and what follows it before a pause (Klatt's rule 2)."""

NOT_LAST_SYLLABLE = 0.85
"""A vowel before the word's last syllable (rule 3 and 4)."""

LONG_WORD = 0.85
"""Each vowel of a word of more than one syllable (rule 5)."""

UNSTRESSED_VOWEL = 0.6
"""A vowel without stress (rule 7)."""

SECONDARY_VOWEL = 0.85
"""A vowel with secondary stress; between the two others."""

LONE_VOWEL = 0.35
"""A word of one vowel inside a phrase, "I" before its verb: a pronoun without accent. Drawn out like a stressed vowel
its glide towards IY was over long before "will" began, and PocketSphinx lost the sentence there."""

BEFORE_VOICELESS = 0.75
"""A vowel closed by a voiceless obstruent (rule 9)."""

BEFORE_VOICED = {Kind.FRICATIVE: 1.4, Kind.STOP: 1.15, Kind.AFFRICATE: 1.1, Kind.NASAL: 0.9}
"""A vowel closed by a voiced consonant (rule 9)."""

INSIDE_PHRASE = 0.3
"""Share of that lengthening that is left where no pause follows (rule 9: 70 + 0.3 of the percentage)."""

IN_CLUSTER = 0.75
"""A consonant beside another consonant (rule 10)."""


def durations_s(phones: Sequence[str], final: bool) -> list[float]:
    """Seconds for each phone (of a stop: its closure) of a word; `final` when a pause follows."""
    vowels = [number for number, phone in enumerate(phones) if is_vowel(phone)]
    last = vowels[-1] if vowels else -1
    lengths = []
    for number in range(len(phones)):
        phone = allophone(phones, number)
        if phone.kind is Kind.VOWEL:
            percent = _vowel_factor(phones, number, number == last, len(vowels), final)
        else:
            percent = _consonant_factor(phones, number)
        if final and number >= last:
            percent *= FINAL_STRETCH
        lengths.append(phone.least_s + max(0.0, phone.inherent_s - phone.least_s) * percent)
    return lengths


def _vowel_factor(phones: Sequence[str], number: int, is_last: bool, syllables: int, final: bool) -> float:
    factor = {0: UNSTRESSED_VOWEL, 1: 1.0, 2: SECONDARY_VOWEL}[stress_of(phones[number])]
    if not is_last:
        factor *= NOT_LAST_SYLLABLE
    if syllables > 1:
        factor *= LONG_WORD
    follower = PHONES[phones[number + 1].rstrip("012")] if number + 1 < len(phones) else None
    if follower is None:
        return factor * (LONE_VOWEL if len(phones) == 1 and not final else 1.1)
    closing = BEFORE_VOICED.get(follower.kind, 1.0) if follower.voiced else BEFORE_VOICELESS
    return factor * (closing if final else 1.0 + INSIDE_PHRASE * (closing - 1.0))


def _consonant_factor(phones: Sequence[str], number: int) -> float:
    beside = [phones[k] for k in (number - 1, number + 1) if 0 <= k < len(phones)]
    return IN_CLUSTER if any(not is_vowel(phone) for phone in beside) else 1.0
