"""Numbers in code words: 64 words, 6 bits each, that can be told from one another in noise."""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.language.spelling import ALPHABET

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
    """Return the number of words that hold a number of that size."""
    return -(-bits // BITS)


def words_of(value: int, n_words: int) -> tuple[str, ...]:
    """A number of up to `n_words` times BITS bits, the highest first. Raises ValueError for any other."""
    if not 0 <= value < 1 << (BITS * n_words):
        raise ValueError(f"{value} has no place in {n_words} code words")
    return tuple(CODE_WORDS[value >> (BITS * place) & (len(CODE_WORDS) - 1)] for place in reversed(range(n_words)))


def number_of(words: Sequence[str]) -> int | None:
    """The number that these words are; None if one of them is no code word."""
    value = 0
    for word in words:
        number = _NUMBER_OF.get(word)
        if number is None:
            return None
        value = value << BITS | number
    return value
