"""Sentences of people that differ in words, and not in what they mean to robots."""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.language.addressees import GREETINGS, TO_ALL
from hvcpd.language.pattern import Words
from hvcpd.language.words import KEYWORD

MOST_CALL_WORDS = 3
"""Words of a call for a halt at most: an addressee and the keyword, as in "team plant stop"."""


def is_call(words: Words) -> bool:
    """Whether a sentence is a call for a halt."""
    return len(words) <= MOST_CALL_WORDS and words[-1] == KEYWORD


def by_name(words: Words, name: str) -> Words:
    """The same sentence by a speaker with another name."""
    at = words.index("am") + 1
    return (*words[:at], name, *words[at + 1 :])


def wordings(words: Words) -> Sequence[Words]:
    """All sentences with the same meaning: with either greeting, and to all or to nobody in particular, which are the
    same to robots ("Hi, I am Anna" and "hello all, I am Anna")."""
    if not words or words[0] not in GREETINGS:
        return (words,)
    rest = words[2:] if words[1:3] == (TO_ALL, "i") else words[1:]
    to_all = ((), (TO_ALL,)) if rest[:1] == ("i",) else ((),)
    return [(greeting, *to, *rest) for greeting in GREETINGS for to in to_all]


def same_meaning(one: Words, other: Words) -> bool:
    """Whether two sentences have the same meaning; calls for a halt have, whomever they address."""
    return one in wordings(other) or (bool(one) and bool(other) and is_call(one) and is_call(other))
