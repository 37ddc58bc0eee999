"""Which pronunciation a word has by its place in the phrase.

The sentences of the phrasebook are so plain that a word's neighbours tell what it is: a phrase or what follows "will"
begins with a verb ("wind the clock"), what follows an article is a noun or stands before one ("the lead pipe"), and
after "have" comes a participle ("i have read"). Lexicon entries may carry such a place: `wind(verb) W AY1 N D`.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum


class Place(Enum):
    """What a word is where it stands; the value is how a lexicon writes it."""

    VERB = "verb"
    NOUN = "noun"
    PAST = "past"


_VERB_FOLLOWS = frozenset(
    "will cannot can could would should must may to not and please do does did don't let's i you we they who".split()
)
_NOUN_FOLLOWS = frozenset(
    "a an the this that these those my your our his her its their each every any some no of in on at by with from for "
    "one two three four five six seven eight nine".split()
)
_PAST_FOLLOWS = frozenset("have has had is are was were been be being got".split())
_PLACES = {
    **dict.fromkeys(_VERB_FOLLOWS, Place.VERB),
    **dict.fromkeys(_NOUN_FOLLOWS, Place.NOUN),
    **dict.fromkeys(_PAST_FOLLOWS, Place.PAST),
}
NOUN_PHRASE_WORDS = 3
"""Words after an article that still belong to its noun: "the old lead pipe"."""


def place_in(words: Sequence[str], number: int) -> Place | None:
    """What the word at `number` of a phrase is, by its neighbours; None for a word alone or where they don't tell."""
    lowered = [word.lower() for word in words]
    for distance, word in enumerate(reversed(lowered[:number]), start=1):
        place = _PLACES.get(word)
        if place is Place.NOUN and distance <= NOUN_PHRASE_WORDS:
            return place
        if place is not None:
            return place if distance == 1 else None
    return Place.VERB if number == 0 and len(words) > 1 else None
