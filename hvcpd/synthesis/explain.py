"""Every known pronunciation of a word, which one is said, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hvcpd.synthesis.dictionary import Pronunciation
from hvcpd.synthesis.homographs import Place, place_in
from hvcpd.synthesis.lexicon import Lexicon, Origin
from hvcpd.synthesis.phones import PHONES, Kind, is_vowel

PLACE_WORDS = {
    Place.VERB: "a verb: it begins the phrase, follows such as 'will', 'to' or 'I', or has an object",
    Place.NOUN: "a noun or adjective: it follows such as 'the', 'in' or 'is', or comes before 'is'",
    Place.PAST: "a participle: it follows such as 'have' or 'was'",
}

PAPER_TABLE = {
    "read": "r-eed", "bass": "b-ase", "row": "r-oh", "bow": "b-oh", "tear": "t-e-rh", "live": "l-eye-ve",
    "wind": "w-in-d", "wound": "w-oo-nd", "close": "cl-oh-s", "excuse": "eh-cs-oos", "polish": "p-o-l-i-sh",
    "lead": "l-eed", "dove": "d-uh-ve", "graduate": "g-rad-u-at",
}  # fmt: skip
"""The words of the paper's table I, in its order, each with the one pronunciation that its speech service used."""


@dataclass(frozen=True)
class Known:
    """One pronunciation of a word: where it is from, where in a phrase it belongs, and whether it is said now."""

    phones: Pronunciation
    source: str
    place: Place | None
    used: bool
    why: str


def explain(words: Sequence[str], number: int, lexicon: Lexicon, builtin: Lexicon) -> list[Known]:
    """What is known of the word at `number` of a phrase; exactly one of them is used.

    `builtin` is the lexicon without the user's file: its pronunciations that the file replaces are told as well.
    """
    word = words[number].lower()
    entry = lexicon.find(word)
    place = entry.place(place_in(words, number))
    said = entry.places[place] if place is not None else entry.said[0]
    places = {phones: at for at, phones in entry.places.items()}
    known = []
    for phones in entry.said:
        used = phones == said
        at = places.get(phones)
        if used and place is not None:
            why = f"here it is {PLACE_WORDS[place]}"
        elif used and entry.origin in (Origin.LETTERS, Origin.NUMBER):
            why = "no lexicon has the word"
        elif used:
            why = "the only one listed" if len(entry.said) == 1 else "listed first"
        else:
            why = f"said where it is {PLACE_WORDS[at]}" if at else "listed later"
        known.append(Known(phones, entry.origin.value, at, used, why))
    if entry.origin is Origin.OWN:
        before = builtin.find(word)
        replaced = [phones for phones in before.said if phones not in entry.said]
        known += [Known(phones, before.origin.value, None, False, "your lexicon overrides it") for phones in replaced]
    return known


_VOWELS = {
    "AA": "ah", "AE": "a", "AH": "uh", "AO": "aw", "AW": "ow", "AY": "eye", "EH": "eh", "ER": "er", "EY": "ay",
    "IH": "i", "IY": "ee", "OW": "oh", "OY": "oy", "UH": "uu", "UW": "oo",
    "OH": "o", "AO:": "aw", "AX:": "ur", "EH:": "air", "AXW": "oh", "IA": "eer",
}  # fmt: skip
_CONSONANTS = {"HH": "h", "JH": "j", "TT": "t", "DD": "d"}


def respelled(phones: Sequence[str]) -> str:
    """A pronunciation for people who read no ARPAbet: POL-ish style, syllables apart, the stressed ones in capitals."""
    syllables: list[list[str]] = [[]]
    for number, phone in enumerate(phones):
        if is_vowel(phone) and any(is_vowel(p) for p in syllables[-1]):
            onset = _onset(phones, number)
            tail = syllables[-1][len(syllables[-1]) - onset :]
            syllables[-1] = syllables[-1][: len(syllables[-1]) - onset]
            syllables.append(tail)
        syllables[-1].append(phone)
    return "-".join(_letters(syllable, alone=len(syllables) == 1) for syllable in syllables)


def _onset(phones: Sequence[str], vowel: int) -> int:
    """How many consonants before a vowel begin its syllable."""
    run = 0
    while run < vowel and not is_vowel(phones[vowel - run - 1]):
        run += 1
    if run >= 2 and PHONES[phones[vowel - 1]].kind is Kind.GLIDE:
        if run >= 3 and phones[vowel - 3] == "S":
            return 3
        if PHONES[phones[vowel - 2]].kind in (Kind.STOP, Kind.FRICATIVE):
            return 2
    return min(run, 1)


def _letters(syllable: Sequence[str], alone: bool) -> str:
    text = "".join(_VOWELS.get(p.rstrip("012")) or _CONSONANTS.get(p, p.lower()) for p in syllable)
    stressed = any(phone.endswith("1") for phone in syllable)
    return text.upper() if stressed and not alone else text


def paper_row(word: str, lexicon: Lexicon) -> dict[str, Any]:
    """A row of PAPER_TABLE, respelled as there: `possible` pronunciations, the `paper`'s one, ours said `alone` and, by
    the values of Place, where the words around decide."""
    places = lexicon.find(word).places
    return {
        "word": word,
        "possible": [respelled(p) for p in lexicon.pronunciations(word)],
        "paper": PAPER_TABLE[word],
        "alone": respelled(lexicon.pronounce(word)),
        **{place.value: respelled(places[place]) for place in Place if place in places},
    }
