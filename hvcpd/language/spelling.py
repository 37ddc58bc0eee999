"""Letters and numbers as words that can be distinguished in noise.

Names letter by letter, in the radio alphabet: in this way robots learn names that they were not given in advance.
Numbers in code words, for seals and keys: 64 words, 6 bits each, the alphabet among them. The alphabet is the
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
    """The words of a name: "zorg" is ("zulu", "oscar", "romeo", "golf"). KeyError for any other character."""
    return tuple(WORD_OF[letter] for letter in letters.lower())


def letters_of(words: Sequence[str]) -> str | None:
    """The letters that these words spell; None if they do not spell a robot's name, which begins with a letter."""
    letters = "".join(_LETTER_OF.get(word, " ") for word in words)
    return letters if letters and " " not in letters and letters[0].isalpha() else None


def written_name(letters: str) -> str:
    """A spelled name, as all robots that learn it write it: "Zorg"."""
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


_OTHERS = (
    "autumn banana birch bucket cookie couch cupboard garage grape hammer maple medicine mirror motor omega onion "
    "orion pencil pepper pixel rabbit rubber saturn scissors sensor shovel shower smoke sphere sponge sugar teacher "
    "terrace toaster tomato turtle window wrench"
).split()
"""Each chosen from 200 short words of the lexicon as the farthest from all chosen before it, beginning with the
alphabet: in the worst of our voices, at the worse of white and pink noise at -5 dB, no two are nearer than 19.8 (the
alphabet's own "echo" and "xray": 16.9). Beyond 22 nothing was ever confused (`vocabulary.FAR`)."""

CODE_WORDS = (*ALPHABET, *_OTHERS)
BITS = 6
"""Of a word; 32 words would need a fifth one for the same number, which takes half a second."""
_NUMBER_OF = {word: number for number, word in enumerate(CODE_WORDS)}


def words_for(bits: int) -> int:
    """Number of words that hold a number of that size."""
    return -(-bits // BITS)


def words_of(value: int, n_words: int) -> tuple[str, ...]:
    """A number of up to `n_words` times BITS bits, the highest first. Raises ValueError for any other."""
    if not 0 <= value < 1 << (BITS * n_words):
        raise ValueError(f"{value} has no place in {n_words} code words")
    return tuple(CODE_WORDS[value >> (BITS * place) & (len(CODE_WORDS) - 1)] for place in reversed(range(n_words)))


def number_of(words: Sequence[str]) -> int | None:
    """The number in these words; None if one of them is no code word."""
    value = 0
    for word in words:
        number = _NUMBER_OF.get(word)
        if number is None:
            return None
        value = value << BITS | number
    return value
