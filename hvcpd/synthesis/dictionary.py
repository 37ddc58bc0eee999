"""A pronouncing dictionary of a hundred thousand words in one small file, read a block at a time.

Words are sorted and front-coded (each says how many letters it shares with the one before; Witten, Moffat and Bell,
*Managing Gigabytes*, 1999, ch. 4), a block's words apart from their phones, and each block is deflated. Only the first
word of each block is held in memory.

    magic, 8 bytes │ length of the index, uint32 │ index │ blocks

The index is deflated text, a line for each block: its first word and its length in bytes. Integers are little-endian.
"""

from __future__ import annotations

import struct
import zlib
from bisect import bisect_right
from collections.abc import Mapping
from functools import cached_property, lru_cache
from itertools import accumulate, takewhile
from pathlib import Path

from hvcpd.errors import reading_own
from hvcpd.synthesis.phones import ARPABET, is_vowel

Pronunciation = tuple[str, ...]
"""ARPAbet phones, vowels with a stress digit: ("R", "AA1", "B")."""

MAGIC = b"hvcpdic1"
BLOCK_WORDS = 128
"""Twice as many would save 6 % of the file, and take twice as long to read."""
WORDS_KEPT = 4096
"""Maximum number of looked-up words kept in memory: more than any team says."""

SYMBOLS = tuple(
    symbol for phone in sorted(ARPABET) for symbol in ([f"{phone}{s}" for s in "012"] if is_vowel(phone) else [phone])
)
"""Phones as a lexicon has them: vowels with a stress digit."""
_CHARACTER = {symbol: chr(ord("!") + number) for number, symbol in enumerate(SYMBOLS)}
_SYMBOL = {character: symbol for symbol, character in _CHARACTER.items()}


def pack(words: Mapping[str, tuple[Pronunciation, ...]]) -> bytes:
    """The file of words in lower case (a to z, digits, apostrophe) and their pronunciations."""
    ordered = sorted(words)
    heads, blocks = [], []
    for begin in range(0, len(ordered), BLOCK_WORDS):
        part = ordered[begin : begin + BLOCK_WORDS]
        coded, before = [], ""
        for word in part:
            shared = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(before, word, strict=False)))
            coded.append(chr(ord("A") + shared) + word[shared:])
            before = word
        said = [" ".join("".join(_CHARACTER[p] for p in phones) for phones in words[word]) for word in part]
        blocks.append(zlib.compress("\n".join([*coded, *said]).encode(), 9))
        heads.append(f"{part[0]} {len(blocks[-1])}")
    index = zlib.compress("\n".join(heads).encode(), 9)
    return MAGIC + struct.pack("<I", len(index)) + index + b"".join(blocks)


class Dictionary:
    """A packed dictionary; `path` is opened when the first word is looked up. Raises ConfigError where it is missing or
    damaged."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.look_up = lru_cache(WORDS_KEPT)(self._look_up)
        """The pronunciations of a word in lower case, the preferred one first; none if it is not listed."""

    def __reduce__(self) -> tuple[type[Dictionary], tuple[Path]]:
        """Another process gets the path, and reads for itself."""
        return type(self), (self._path,)

    @cached_property
    def _index(self) -> tuple[list[str], list[int]]:
        """First words of the blocks, and where each block begins, the end of the file last."""
        with reading_own(self._path), self._path.open("rb") as file:
            head = file.read(len(MAGIC) + 4)
            if not head.startswith(MAGIC):
                raise ValueError("not a packed dictionary")
            (length,) = struct.unpack("<I", head[len(MAGIC) :])
            pairs = [line.split() for line in zlib.decompress(file.read(length)).decode().splitlines()]
        return [word for word, _ in pairs], list(accumulate((int(n) for _, n in pairs), initial=len(head) + length))

    def _look_up(self, word: str) -> tuple[Pronunciation, ...]:
        number = bisect_right(self._index[0], word) - 1
        with reading_own(self._path):
            lines = self._block(number) if number >= 0 else []
            half, found = len(lines) // 2, ""
            for coded, said in zip(lines[:half], lines[half:], strict=True):
                found = found[: ord(coded[0]) - ord("A")] + coded[1:]
                if found == word:
                    return tuple(tuple(_SYMBOL[character] for character in phones) for phones in said.split())
        return ()

    def _block(self, number: int) -> list[str]:
        """The lines of a block: its words, front-coded, and then the phones of each."""
        begin, end = self._index[1][number : number + 2]
        with self._path.open("rb") as file:
            file.seek(begin)
            return zlib.decompress(file.read(end - begin)).decode().split("\n")
