"""Letter-to-sound: a pronunciation for any word that no lexicon has, such as a robot's name.

A joint n-gram model of letters and the phones they stand for (M. Bisani and H. Ney, "Joint-sequence models for
grapheme-to-phoneme conversion", *Speech Communication* 50, 2008), learned from CMUdict by
`python -m benchmarks.pronunciation learn`. It reads words backwards: English counts stress from the end of a word.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hvcpd.config.names import plain_letters
from hvcpd.errors import reading_own

MODEL_PATH = Path(__file__).with_name("letter_to_sound.npz")

LETTER_NAMES: dict[str, str] = {
    "a": "EY1", "b": "B IY1", "c": "S IY1", "d": "D IY1", "e": "IY1", "f": "EH1 F", "g": "JH IY1", "h": "EY1 CH",
    "i": "AY1", "j": "JH EY1", "k": "K EY1", "l": "EH1 L", "m": "EH1 M", "n": "EH1 N", "o": "OW1", "p": "P IY1",
    "q": "K Y UW1", "r": "AA1 R", "s": "EH1 S", "t": "T IY1", "u": "Y UW1", "v": "V IY1",
    "w": "D AH1 B AH0 L Y UW0", "x": "EH1 K S", "y": "W AY1", "z": "Z IY1",
}  # fmt: skip

LONGEST = 45
"""Letters read as one word; a longer stretch is cut there, so that the time to read it grows in proportion. The longest
word in English dictionaries (pneumonoultramicroscopicsilicovolcanoconiosis) has 45."""
BEAM = 12
"""Readings followed from letter to letter: 20 get 0.3 % more of the words kept back right, and take longer."""
BEAM_NATS = 8.0
"""How much less likely than the best a reading may be and still be followed, natural logarithm."""
UNSEEN_NATS = 20.0
"""Cost of an end that the model has not seen: beyond all that it can store."""
NATS = 1 / 12
"""Step in which the model's file holds costs; its first is `LEAST_NATS`."""
LEAST_NATS = -1.0
"""Back-off weights may exceed 1 once n-grams are dropped."""


@lru_cache(maxsize=1024)
def letter_to_sound(word: str) -> tuple[str, ...]:
    """A pronunciation of a word of Latin letters: ARPAbet phones, one vowel with the main stress.

    Accents are taken off, other characters passed over; a word of nothing else gives no phones. Letters without a vowel
    among them are named one by one.
    """
    letters = "".join(letter for letter in plain_letters(word).lower() if "a" <= letter <= "z")
    phones: list[str] = []
    for begin in range(0, len(letters), LONGEST):
        part = letters[begin : begin + LONGEST]
        read = _model().read(part) if len(part) > 1 and set(part) & set("aeiouy") else ()
        phones += read or [phone for letter in part for phone in LETTER_NAMES[letter].split()]
    return tuple(phones)


class _Reading(NamedTuple):
    """Some letters read: its cost in nats, the tokens, the model's nodes for the last 0, 1, 2 … of them (-1: not in the
    model), and how many main stresses it has."""

    cost: float
    tokens: tuple[int, ...]
    nodes: tuple[int, ...]
    stresses: int


@dataclass(frozen=True)
class JointModel:
    """A back-off n-gram model as a tree: node 0 is the empty n-gram, the children of a node are its continuations.

    `phones` has the phones of each token; `of_letter` the range of the tokens of each letter, in their order; the two
    numbers after the last token are the word's begin and its end. `token`, `cost` (nats) are of each node, `first` of
    each node that may have children the number of the first of them, `backoff` the cost (nats) of leaving it for a
    shorter n-gram. `order`: tokens in the longest n-gram.
    """

    phones: tuple[tuple[str, ...], ...]
    of_letter: dict[str, tuple[int, int]]
    token: memoryview
    cost: memoryview
    first: memoryview
    backoff: memoryview
    order: int

    @classmethod
    def load(cls, path: Path) -> JointModel:
        """The model of a file that `benchmarks.pronunciation` wrote. Raises ConfigError where it is missing or
        damaged."""
        with reading_own(path), np.load(path) as file:
            graphones = bytes(file["graphones"]).decode().splitlines()
            token, cost, backoff = (file[name] for name in ("token", "cost", "backoff"))
            first = 1 + np.concatenate([[0], np.cumsum(file["children"], dtype=np.uint32)])
            order = int(file["order"])
        of_letter: dict[str, tuple[int, int]] = {}
        for number, graphone in enumerate(graphones):
            begin, _ = of_letter.get(graphone[0], (number, number))
            of_letter[graphone[0]] = begin, number + 1
        phones = tuple(tuple(graphone[1:].split()) for graphone in graphones)
        return cls(phones, of_letter, token.data, cost.data, first.astype(np.uint32).data, backoff.data, order)

    def read(self, letters: str) -> tuple[str, ...]:
        """The likeliest phones of letters from a to z that have exactly one main stress; of any, if none has."""
        begin = len(self.phones)
        readings = [_Reading(0.0, (), self._after((0,), begin), 0)]
        for letter in reversed(letters):
            further = [
                (reading.cost + cost, token, reading)
                for reading in readings
                for token, cost in self._costs(reading.nodes, *self.of_letter[letter]).items()
                if reading.stresses + self._stresses(token) <= 1
            ]
            further.sort(key=lambda each: each[:2])
            readings = [
                _Reading(
                    cost, (token, *old.tokens), self._after(old.nodes, token), old.stresses + self._stresses(token)
                )
                for cost, token, old in further[:BEAM]
                if cost < further[0][0] + BEAM_NATS
            ]
        end = begin + 1

        def whole(reading: _Reading) -> tuple[bool, float]:
            ending = self._costs(reading.nodes, end, end + 1).get(end, UNSEEN_NATS)
            return reading.stresses != 1, reading.cost + ending

        best = min(readings, key=whole)
        return tuple(phone for token in best.tokens for phone in self.phones[token])

    def _stresses(self, token: int) -> int:
        return sum(phone.endswith("1") for phone in self.phones[token])

    def _costs(self, nodes: tuple[int, ...], begin: int, end: int) -> dict[int, float]:
        """The cost of each token from `begin` to `end` after n-grams that end here, each by the longest that has it."""
        found: dict[int, float] = {}
        left = 0.0
        for node in reversed(nodes):
            first, last = self._children(node)
            if first == last:
                continue
            for child in range(bisect_left(self.token, begin, first, last), last):
                token = self.token[child]
                if token >= end:
                    break
                found.setdefault(token, left + LEAST_NATS + NATS * self.cost[child])
            left += LEAST_NATS + NATS * self.backoff[node]
        return found

    def _after(self, nodes: tuple[int, ...], token: int) -> tuple[int, ...]:
        """The nodes of the n-grams that end with one more token."""
        found = [0]
        for node in nodes[: self.order - 1]:
            first, last = self._children(node)
            child = bisect_left(self.token, token, first, last)
            found.append(child if child < last and self.token[child] == token else -1)
        while found[-1] < 0:
            found.pop()
        return tuple(found)

    def _children(self, node: int) -> tuple[int, int]:
        return (self.first[node], self.first[node + 1]) if 0 <= node < len(self.backoff) else (0, 0)


@cache
def _model() -> JointModel:
    return JointModel.load(MODEL_PATH)
