"""Regular forms of known words: "rows", "closed", "winding" sound like "row", "close" and "wind" with an ending.

English spells and says them by rule (Quirk et al., *A Comprehensive Grammar of the English Language*, 1985, 3.5 and
5.80), so that a form which no lexicon has is better taken from its stem than read letter by letter.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from hvcpd.synthesis.dictionary import Pronunciation
from hvcpd.synthesis.homographs import Place

_HISSING = frozenset("S Z SH ZH CH JH".split())
_VOICELESS = frozenset("P T K F TH".split())
_UNDOUBLED = "aeiouys"

_DOUBLES = re.compile(r"[^aeiou]*[aeiouy][^aeiouywx]")
"""Stems that double their last letter: "caring" is no form of "car", "starred" one of "star"."""

SHORTEST_STEM = 3
"""Letters; shorter ones are seldom meant: "as", "bed", "sing"."""


@dataclass(frozen=True)
class Derived:
    """How a form is said: the preferred way first, and by its place where the stem tells noun from verb."""

    said: tuple[Pronunciation, ...]
    places: Mapping[Place, Pronunciation]


def derive(
    word: str, listed: Callable[[str], tuple[Pronunciation, ...]], places: Mapping[str, Mapping[Place, Pronunciation]]
) -> Derived | None:
    """The form `word` (lower case) of a word that `listed` has pronunciations of; None if it is no regular form of
    any."""
    for stem, ending in _stems(word):
        known = listed(stem) if len(stem) >= SHORTEST_STEM else ()
        if not known:
            continue
        takes = _that_take(ending, places.get(stem, {}))
        taking = [phones for phones in known if phones in takes.values()] or known
        said = (with_ending(phones, ending) for phones in taking)
        by_place = {place: with_ending(phones, ending) for place, phones in takes.items()} if ending == "s" else {}
        return Derived(tuple(dict.fromkeys(said)), by_place)
    return None


def _that_take(ending: str, of_stem: Mapping[Place, Pronunciation]) -> dict[Place, Pronunciation]:
    """Pronunciations that take an ending: of "wind" only the verb is "winding"; "reads" is never the participle, nor
    "LEDs" a form of the verb "led"."""
    is_past = of_stem.get(Place.VERB) == of_stem.get(Place.PAST)
    places = [at for at in (Place.VERB, Place.NOUN) if at in of_stem and not (is_past and at is Place.VERB)]
    return {at: of_stem[at] for at in (places if ending == "s" else places[:1])}


def _stems(word: str) -> Iterator[tuple[str, str]]:
    """Words that `word` may be a form of, and the ending; the likelier first."""
    if word.endswith("'s"):
        yield word[:-2], "s"
    elif word.endswith("ies"):
        yield word[:-3] + "y", "s"
    elif word.endswith("s") and not _is_singular(word):
        yield word[:-1], "s"
        if word.endswith(("ses", "xes", "zes", "ches", "shes", "oes")):
            yield word[:-2], "s"
    for ending in ("ed", "ing"):
        if word.endswith(ending):
            bare = word[: -len(ending)]
            if len(bare) < SHORTEST_STEM:
                continue
            yield bare + "e", ending
            if not _DOUBLES.fullmatch(bare) and not word.endswith("ied"):
                yield bare, ending
            if len(bare) > SHORTEST_STEM and bare[-1] == bare[-2] and bare[-1] not in _UNDOUBLED:
                yield bare[:-1], ending
            if word.endswith("ied"):
                yield word[:-3] + "y", ending


def _is_singular(word: str) -> bool:
    """Whether the S is the word's own, as in "class", "cactus" and "basis"; "cpus" and "apis" are too short."""
    return word.endswith("ss") or (word.endswith(("us", "is")) and len(word) > SHORTEST_STEM + 1)


_AMERICAN = (
    (re.compile(r"([iy])s(e|ed|es|er|ers|ing|ation|ations|able)$"), r"\1z\2"),
    (re.compile(r"([bgt])re(s|d)?$"), r"\1er\2"),
    (re.compile(r"([aeiou].*[aeiou])ll(ed|ing|er|ers)$"), r"\1l\2"),
    (re.compile(r"([aeiou])l(s|ful|ment|ments)?$"), r"\1ll\2"),
    (re.compile(r"our(s|y|ed|ing)?$"), r"or\1"),
    (re.compile(r"ence(s)?$"), r"ense\1"),
    (re.compile(r"ould(er|ers|ered|ering)$"), r"old\1"),
    (
        re.compile(
            r"(?<=[chkn])ae(?=m)|(?<=n)ae(?=[cs])|(?<=p)ae(?=d)|(?<=f)ae(?=c)|(?<=i)ae(?=v)"
            r"|(?<=f)oe(?=t)|^oe(?=s)"
        ),
        "e",
    ),
)
"""British spellings, and the American ones that CMUdict lists: "organise", "litre", "modelling", "enrol", "vapour",
"offence", "smoulder", "paediatric"."""


def american_spellings(word: str) -> list[str]:
    """The American spelling of a word (lower case) that may be British; none of any other."""
    return [pattern.sub(other, word) for pattern, other in _AMERICAN if pattern.search(word)]


def with_ending(phones: Pronunciation, ending: str) -> Pronunciation:
    """The phones with "s" (plural, possessive, third person), "ed" or "ing", as the last sound asks."""
    last = phones[-1].rstrip("012")
    if ending == "ing":
        return (*phones, "IH0", "NG")
    if ending == "ed":
        return (*phones, *(("IH0", "D") if last in ("T", "D") else ("T",) if last in _VOICELESS | _HISSED else ("D",)))
    return (*phones, *(("IH0", "Z") if last in _HISSING else ("S",) if last in _VOICELESS else ("Z",)))


_HISSED = frozenset("S SH CH".split())
"""Voiceless too, but with a vowel before an "s"."""
