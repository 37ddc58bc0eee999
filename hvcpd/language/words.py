"""Words as they are spoken: numbers, and the way from written text to spoken words."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import chain

from hvcpd.config.names import plain_letters
from hvcpd.config.written import read_out, with_quantities

_UNITS = (
    "zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen "
    "seventeen eighteen nineteen"
).split()
_TENS = "twenty thirty forty fifty sixty seventy eighty ninety".split()
_IRREGULAR = {
    "one": "first", "two": "second", "three": "third", "five": "fifth", "eight": "eighth", "nine": "ninth",
    "twelve": "twelfth",
}  # fmt: skip
"""Ordinals that are not their number with "th"."""
KEYWORD = "stop"
"""Whoever says it halts robots, in any voice."""
SAFETY_WORDS = frozenset({KEYWORD, "resume"})
"""Spoken alone they halt and release robots, so that nothing of a team's own may have one in it."""
NUMBER_MAX = 99
"""The largest number with a spoken form here: task repositories are small."""
MAX_DIGITS = len(str(NUMBER_MAX))
"""Of a number that is said as one: in 007 the zeros count."""

_ORDINAL = re.compile("([0-9]{1,4})(?:st|nd|rd|th)")
_ZEROS = {"00": ("hundred",), "000": ("thousand",), "00000": ("hundred", "thousand"), "000000": ("million",)}
_ROUND = re.compile(f"([1-9][0-9]??)({'|'.join(_ZEROS)})")
"""Numbers that are said as such: 100, 1500, 20000, 100000. Others above NUMBER_MAX are rooms, years and the like."""
_BEFORE_AM = frozenset((*_UNITS, *_TENS))
"""Where "am" follows, it is a time of day and no verb."""
_TOKEN = re.compile(r"[a-z0-9']+")
_PAUSE = re.compile(r"[,;!?…—\n]|:(?=\s)|\.\.+|\s[–-]+\s")
_FULL_STOP = re.compile(r"\b(?=\w*[AEIOUYaeiouy\d])(\w*\d|\w\w+)\.(?=[\"”)]?\s+[\"“(]?[A-Z])")
"""The end of a sentence, and no "Mr. Smith" or "J. Smith"."""
_STRICT_TOKEN = re.compile(r"(?<![\w.–—-])(?:[–—-][.]?|[.,])[0-9]\S*|[0-9]+[.][0-9]+[a-z]*|[^\s,.!?;:\"“”()\[\]…–—-]+")
"""A minus sign and a decimal point belong to their number, also one that begins with it: ".5 m" is not five metres. Any
other hyphen or point parts words."""


def number_words(number: int) -> tuple[str, ...]:
    """A whole number from 0 to 99 in words: 21 is ("twenty", "one"). Raises ValueError outside."""
    if not 0 <= number <= NUMBER_MAX:
        raise ValueError(f"no spoken form for {number}")
    if number < len(_UNITS):
        return (_UNITS[number],)
    tens, unit = divmod(number, 10)
    return (_TENS[tens - 2],) if unit == 0 else (_TENS[tens - 2], _UNITS[unit])


def ordinal_words(number: int) -> tuple[str, ...]:
    """An ordinal from 0 to 9999 in words: 121 is ("one", "hundred", "twenty", "first"). Raises ValueError outside."""
    count, rest = divmod(number, 100)
    if count:
        count, unit = (count, "hundred") if count % 10 else (count // 10, "thousand")
        return (*number_words(count), *((unit, *ordinal_words(rest)) if rest else (f"{unit}th",)))
    *tens, last = number_words(number)
    regular = f"{last[:-1]}ieth" if last.endswith("y") else f"{last}th"
    return (*tens, _IRREGULAR.get(last, regular))


def digit_words(number: int) -> tuple[str, str]:
    """The two digits of a number from 0 to 99: 7 is ("zero", "seven")."""
    tens, unit = divmod(number, 10)
    return _UNITS[tens], _UNITS[unit]


def spoken_words(text: str) -> tuple[str, ...]:
    """Written text as the words that are spoken: lower case, no punctuation, quantities, ordinals, numbers up to 99
    and round ones in words.

    Characters that no English word has end a word, so that arbitrary text gives some words and never an error.
    """
    return tuple(chain.from_iterable(spoken_phrases(text)))


def spoken_phrases(text: str) -> tuple[tuple[str, ...], ...]:
    """Like `spoken_words`, in phrases: a comma, a dash and the end of a sentence are pauses."""
    parts = _PAUSE.split(_FULL_STOP.sub(r"\1,", read_out(plain_letters(text))).lower())
    phrases = (chain.from_iterable(map(_round_words, _with_numbers(_TOKEN.findall(part)))) for part in parts)
    return tuple(filter(None, map(tuple, phrases)))


def strict_words(text: str) -> tuple[str, ...]:
    """Like `spoken_words`, but nothing is left out: a word with other signs stays, for its reader to refuse.

    Omitting a sign could change the meaning: "task -1" is not task one.
    """
    return _with_numbers(_STRICT_TOKEN.findall(with_quantities(plain_letters(text)).lower()))


def spoken_as(text: str | None, choices: Iterable[str]) -> str | None:
    """The one of the choices that is spoken like the text; None if there is none."""
    words = spoken_words(text or "")
    return next((choice for choice in choices if words and spoken_words(choice) == words), None)


def _round_words(word: str) -> tuple[str, ...]:
    found = _ROUND.fullmatch(word)
    return (*number_words(int(found[1])), *_ZEROS[found[2]]) if found else (word,)


def _with_numbers(tokens: list[str]) -> tuple[str, ...]:
    words: list[str] = []
    for token in tokens:
        token = token.strip("'")
        if token.isascii() and token.isdigit() and len(token) <= MAX_DIGITS:
            words += number_words(int(token))
        elif ordinal := _ORDINAL.fullmatch(token):
            words += ordinal_words(int(ordinal[1]))
        elif token == "am" and words and words[-1] in _BEFORE_AM:
            words += ("a", "m")
        elif token:
            words.append(token)
    return tuple(words)
