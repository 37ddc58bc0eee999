"""Names letter by letter, in the radio alphabet: the way in which robots learn names that nobody told them before.

International Radiotelephony Spelling Alphabet (ICAO Annex 10, volume II), with digits as ordinary numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hvcpd.language.graph import Arc, WordGraph
from hvcpd.language.words import number_words

ALPHABET = (
    "alpha bravo charlie delta echo foxtrot golf hotel india juliet kilo lima mike november oscar papa quebec romeo "
    "sierra tango uniform victor whiskey xray yankee zulu"
).split()
WORD_OF = {word[0]: word for word in ALPHABET} | {str(digit): number_words(digit)[0] for digit in range(10)}
"""The word of each letter and digit."""
_LETTER_OF = {word: letter for letter, word in WORD_OF.items()}

ANY_LETTERS = "LETTERS"
"""Stands in a network for one letter's word and more: `with_letters` puts them there. No word is in capitals."""


def letter_words(letters: str) -> tuple[str, ...]:
    """The words of a name: "zorg" is ("zulu", "oscar", "romeo", "golf"). KeyError for what is no letter or digit."""
    return tuple(WORD_OF[letter] for letter in letters.lower())


def letters_of(words: Sequence[str]) -> str | None:
    """The letters that these words spell; None if they do not spell a robot's name, which begins with a letter."""
    letters = "".join(_LETTER_OF.get(word, " ") for word in words)
    return letters if letters and " " not in letters and letters[0].isalpha() else None


def written_name(letters: str) -> str:
    """A name that was spelled, as it is written by all who learn it so: "Zorg"."""
    return letters.capitalize()


def with_letters(graph: WordGraph) -> WordGraph:
    """The network with any number of letters in place of each arc ANY_LETTERS; they may be said with pauses."""
    arcs: list[Arc] = []
    pauses = set(graph.pauses)
    for arc in graph.arcs:
        if arc.word != ANY_LETTERS:
            arcs.append(arc)
            continue
        arcs += [Arc(source, arc.target, word) for source in (arc.source, arc.target) for word in WORD_OF.values()]
        pauses |= {arc.source, arc.target}
    return replace(graph, arcs=tuple(arcs), pauses=frozenset(pauses))
