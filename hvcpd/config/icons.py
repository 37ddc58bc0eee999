"""The marks that tasks may have on maps and in lists: a few by name, or any single character."""

from __future__ import annotations

from itertools import pairwise
from unicodedata import category

from hvcpd.errors import did_you_mean

ICONS = ("flower", "book", "box", "shelf", "bottle", "door", "lamp", "tool", "bin", "flag")
"""Names of the icons that are drawn; `hvcpd.reporting.icons` has their outlines."""

_JOINER = "\u200d"
_EXTENDING = {"\ufe0e", "\ufe0f", "\u20e3", *map(chr, range(0x1F3FB, 0x1F400)), *map(chr, range(0xE0020, 0xE0080))}
"""What changes the character before it: how an emoji is shown, a key's frame, a skin's colour, a region's flag."""


def valid_icon(icon: str) -> str | None:
    """What is wrong with a task's icon and what to do, None if nothing is."""
    if icon in ICONS or is_one_character(icon):
        return None
    hint = did_you_mean(icon[:40], ICONS)
    stop = "" if hint.endswith("?") else ";"
    return f"{icon[:40]!r} is not an icon; {hint}{stop} any single character or emoji also works"


def is_one_character(text: str) -> bool:
    """Whether the text is shown as one visible character (a grapheme cluster, UAX #29, as far as emoji need it)."""
    if not text or category(text[0])[0] in "CMZ" or _extends(text[0]):
        return False
    if len(text) == 2 and all("\U0001f1e6" <= letter <= "\U0001f1ff" for letter in text):  # a country's flag
        return True
    if text[-1] == _JOINER:
        return False
    return all(_extends(this) or (last == _JOINER and category(this) == "So") for last, this in pairwise(text))


def _extends(letter: str) -> bool:
    return letter == _JOINER or letter in _EXTENDING or category(letter)[0] == "M"
