"""Words as they are spoken: numbers, and the way from written text to spoken words."""

from __future__ import annotations

import re
import unicodedata

_UNITS = (
    "zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen "
    "seventeen eighteen nineteen"
).split()
_TENS = "twenty thirty forty fifty sixty seventy eighty ninety".split()
NUMBER_MAX = 99
"""The largest number with a spoken form here: task repositories are small."""

_TOKEN = re.compile(r"[a-z0-9']+")


def number_words(number: int) -> tuple[str, ...]:
    """A whole number from 0 to 99 in words: 21 is ("twenty", "one"). Raises ValueError outside."""
    if not 0 <= number <= NUMBER_MAX:
        raise ValueError(f"no spoken form for {number}")
    if number < len(_UNITS):
        return (_UNITS[number],)
    tens, unit = divmod(number, 10)
    return (_TENS[tens - 2],) if unit == 0 else (_TENS[tens - 2], _UNITS[unit])


def spoken_words(text: str) -> tuple[str, ...]:
    """Written text as the words that are spoken: lower case, no punctuation, numbers up to 99 in words.

    Characters that no English word has end a word, so that arbitrary text gives some words and never an error.
    """
    plain = unicodedata.normalize("NFKD", text).replace("\u2019", "'").lower()
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    words: list[str] = []
    for token in _TOKEN.findall(plain):
        token = token.strip("'")
        if token.isascii() and token.isdigit() and int(token[-9:]) <= NUMBER_MAX and len(token) <= 9:
            words += number_words(int(token))
        elif token:
            words.append(token)
    return tuple(words)
