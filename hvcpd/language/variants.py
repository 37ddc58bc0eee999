"""Other words for those of the phrasebook, which are understood when read or heard, and are never said.

In typed sentences: contractions, American spellings, singular and plural, decimals. By ear: the phrases that a team
lists. Robots' own sentences have one form of each word; a word that fits in its place is never replaced.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from hvcpd.config.names import CONTRACTED, CONTRACTED_ENDINGS
from hvcpd.config.written import unsayable
from hvcpd.errors import VocabularyError, alike
from hvcpd.language.graph import WordGraph, ends_of
from hvcpd.language.pattern import Words
from hvcpd.language.words import SAFETY_WORDS, number_words, spoken_words

_WHOLE = {
    **{short: tuple(full.split()) for short, full in CONTRACTED.items()},
    "im": ("i", "am"),
    "whats": ("what", "is"),
    "whos": ("who", "is"),
    "&": ("and",),
    "m": ("metres",),
    "v": ("volts",),
    "everybody": ("all",),
    "everyone": ("all",),
    "robots": ("all",),
    "halt": ("stop",),
    "hey": ("hi",),
}
_ENDINGS = CONTRACTED_ENDINGS | {"'s": "is", "'d": "would"}
"""Contractions and their full words."""
_SPELLINGS = (
    (re.compile(r"er(s?)$"), r"re\1"),
    (re.compile(r"re(s?)$"), r"er\1"),
    (re.compile(r"or(?=$|s$|ed$|ing$)"), "our"),
    (re.compile(r"our(?=$|s$|ed$|ing$)"), "or"),
    (re.compile(r"i[sz](?=e|ing)"), lambda found: "iz" if found[0] == "is" else "is"),
    (re.compile(r"(?<=[aeiou])ll(?=ed$|er$|ing$)"), "l"),
    (re.compile(r"(?<=[aeiou])l(?=ed$|er$|ing$)"), "ll"),
    (re.compile(r"og$"), "ogue"),
    (re.compile(r"ogue$"), "og"),
    (re.compile(r"ense$"), "ence"),
    (re.compile(r"ence$"), "ense"),
    (re.compile(r"^gray"), "grey"),
    (re.compile(r"^grey"), "gray"),
)
"""British and American, both ways: a team spells its tasks as it likes."""
_DECIMAL = re.compile(r"([0-9]{1,2})[.]([05])0?")
_CLITIC = re.compile(r"(n't|'[a-z]+)$")


def variants(word: str) -> Iterator[Words]:
    """Other readings of a typed word, the likeliest first."""
    if word in _WHOLE:
        yield _WHOLE[word]
        yield (_one_or_many(_WHOLE[word][0]),)
    if (found := _CLITIC.search(word)) and found[0] in _ENDINGS:
        yield (word[: found.start()], _ENDINGS[found[0]])
    if decimal := _DECIMAL.fullmatch(word):
        whole = number_words(int(decimal[1]))
        if decimal[2] == "5":
            yield (*whole, "and", "a", "half") if int(decimal[1]) else ("half", "a")
        else:
            yield whole
    if not word.isalpha() and unsayable(word) is None:
        yield spoken_words(word)
    for pattern, other in _SPELLINGS:
        respelled = pattern.sub(other, word)
        if respelled != word:
            yield (respelled,)
            yield (_one_or_many(respelled),)
    yield (_one_or_many(word),)


def _one_or_many(word: str) -> str:
    return word[:-1] if word.endswith("s") else word + "s"


def as_spoken(graph: WordGraph, words: Words) -> Words:
    """The words, each that cannot stand in its place in the network replaced by a variant that can.

    From the first word without such a variant on, the rest stays as it is.
    """
    node, read = graph.start, list[str]()
    for place, word in enumerate(words):
        for choice in ((word,), *variants(word)):
            if ends := ends_of(graph, node, choice):
                (node,), read = ends, [*read, *choice]
                break
        else:
            return (*read, *words[place:])
    return tuple(read)


def by_word(pairs: Iterable[tuple[str, str]]) -> dict[str, tuple[Words, ...]]:
    """The phrases of each word, in spoken words."""
    found: dict[str, tuple[Words, ...]] = {}
    for word, phrase in pairs:
        found[word] = (*found.get(word, ()), tuple(phrase.split()))
    return found


def refuse_senseless(graph: WordGraph, alternatives: Mapping[str, tuple[Words, ...]]) -> None:
    """Raises VocabularyError for an alternative of no word of the network, one that can be said in its place, or one
    with a word that halts or releases robots."""
    for word, phrases in alternatives.items():
        said = " ".join(phrases[0])
        places = {arc.source for arc in graph.arcs if arc.word == word}
        if not places:
            close = alike(word, graph.words)
            hint = f"did you mean '{close}'?" if close else "leave it out (all words: hvcpctl phrases)"
            raise VocabularyError(
                f"alternatives: '{word}' is not a word of the phrasebook; {hint}", "tasks", written=said
            )
        for phrase in phrases:
            said = " ".join(phrase)
            if safety := SAFETY_WORDS.intersection(phrase) - {word}:
                why = f"because '{min(safety)}' counts as itself everywhere"
                text = f"'{said}' cannot count as '{word}', {why}"
                raise VocabularyError(f"alternatives: {text}; leave it out", "tasks", written=said)
            if any(ends_of(graph, place, phrase) for place in places):
                text = f"'{said}' cannot count as '{word}', because it can be said there itself"
                raise VocabularyError(f"alternatives: {text}; leave it out", "tasks", written=said)
