"""Which pronunciation a word has by its place in the phrase.

The sentences of the phrasebook are so plain that a word's neighbours tell what it is: a phrase or what follows "will"
begins with a verb ("wind the clock"), what follows an article is a noun or stands before one ("the lead pipe"), and
after "have" comes a participle ("i have read"). Lexicon entries may carry such a place: `wind(verb) W AY1 N D`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import Enum


class Place(Enum):
    """What a word is where it stands; the value is how a lexicon writes it."""

    VERB = "verb"
    NOUN = "noun"
    PAST = "past"


_SUBJECTS = frozenset("i he she it you we they".split())
_AUXILIARIES = {
    **dict.fromkeys(
        "will would can cannot could should must may do does did won't wouldn't can't couldn't shouldn't mustn't don't "
        "doesn't didn't".split(),
        Place.VERB,
    ),
    **dict.fromkeys(
        "have has had am is are was were haven't hasn't hadn't isn't aren't wasn't weren't".split(), Place.PAST
    ),
}
"""They may stand before their subject, too: "is it live", "have you read it"."""
_VERB_FOLLOWS = frozenset("to and please let's who i'll you'll he'll she'll it'll we'll they'll".split())
_NOUN_FOLLOWS = frozenset(
    "a an the this that these those my your our his her its their each every any some no of in on at by with from for "
    "one two three four five six seven eight nine very too quite how stay".split()
)
_PAST_FOLLOWS = frozenset(
    "be been being got i'm i've you're you've he's she's it's we're we've they're they've that's there's who's".split()
)
_MAKING = frozenset("keep come get make take".split())
_NOUN_LIKELY = _MAKING | frozenset("many few several so as".split())
"""As above, but before an object the word is a verb nevertheless: "come close" beside "come close the door"."""
_PLACES = {
    **_AUXILIARIES,
    **dict.fromkeys(_SUBJECTS | _VERB_FOLLOWS, Place.VERB),
    **dict.fromkeys(_NOUN_FOLLOWS | _NOUN_LIKELY, Place.NOUN),
    **dict.fromkeys(_PAST_FOLLOWS, Place.PAST),
}
_ADVERBS = frozenset("not never always already now also just still ever only then again".split())
"""They change nothing: "have not read", "now close the door"."""
_OBJECT_BEGINS = frozenset(
    "a an the this these those my your our his her its their each every it him us me them".split()
)
"""What stands before one of these, and not right after an article, is a verb: "the robots use the water"."""
NOUN_PHRASE_WORDS = 3
"""Words after an article that still belong to its noun: "the old lead pipe"."""
_PLURAL = re.compile("[a-z]{2,}[^'sui]s")
"""A noun that ends the phrase of its article, as nouns before another one have no plural: "the robots use water"."""
_NO_VERB_AFTER = _MAKING | {word for word, place in _AUXILIARIES.items() if place is Place.PAST}
"""Words that leave the one after a plural an adjective: "keep the bins separate", "are the doors close"."""


def place_in(words: Sequence[str], number: int) -> Place | None:
    """What the word at `number` of a phrase is, by its neighbours; None for a word alone or where they don't tell."""
    lowered = [word.lower() for word in words]
    before = [word for word in lowered[:number] if word not in _ADVERBS]
    after = lowered[number + 1] if number + 1 < len(words) else ""
    if not before:
        if lowered[:number] == ["not"]:
            return Place.PAST
        return None if len(words) == 1 else Place.NOUN if _AUXILIARIES.get(after) is Place.PAST else Place.VERB
    if _asks(before):
        return _AUXILIARIES[before[-2]]
    verb = Place.VERB if after in _OBJECT_BEGINS else None
    for distance, word in enumerate(reversed(before), start=1):
        place = _PLACES.get(word)
        if place is Place.NOUN and distance == 2 and _PLURAL.fullmatch(before[-1]):
            verb = verb if _NO_VERB_AFTER.intersection(before) else Place.VERB
        if place is Place.NOUN and distance <= NOUN_PHRASE_WORDS:
            return place if distance == 1 and word not in _NOUN_LIKELY else verb or place
        if place is not None:
            return place if distance == 1 else verb
    return verb


def _asks(before: Sequence[str]) -> bool:
    """Whether these words end in an auxiliary and its subject: "have you", or at the beginning "has rob"."""
    if len(before) < 2 or before[-2] not in _AUXILIARIES:
        return False
    return before[-1] in _SUBJECTS or (len(before) == 2 and before[-1] not in _PLACES)
