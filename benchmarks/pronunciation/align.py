"""Aligns each letter of a word with its phones, by expectation maximisation over whole words.

A letter stands for none, one or two phones (Jiampojamarn, Kondrak and Sherif, NAACL 2007; the hidden segmentation of
Bisani and Ney, *Speech Communication* 50, 2008). Words of equal length are treated at once.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

LETTERS = "abcdefghijklmnopqrstuvwxyz"
ROUNDS = 7
"""Of expectation maximisation: one more moved 0.1 % of the letters."""
RARE = 12
"""Uses of a chunk of phones by a letter below which it is no chunk of that letter; words that need it are left out."""
MOST_PHONES = 2

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

Word = tuple[str, tuple[str, ...]]
"""Letters, and phones with stress digits."""
Aligned = tuple[tuple[str, tuple[str, ...]], ...]
"""For each letter, the letter and its phones with stress digits."""


def align(words: Sequence[Word]) -> list[Aligned]:
    """The most likely alignment of each word, in the same order; words without a common one are left out."""
    bare = [(word, tuple(phone.rstrip("012") for phone in phones)) for word, phones in words]
    phones = sorted({phone for _, said in bare for phone in said})
    groups = list(_groups(bare, {phone: number for number, phone in enumerate(phones, start=1)}))
    width = len(phones) + 1
    table = np.full((len(LETTERS), width * width), 1.0)
    for _ in range(ROUNDS):
        counts = np.full_like(table, 1e-9)
        for _, letters, said in groups:
            _expect(letters, said, table, counts, width)
        table = counts / counts.sum(axis=1, keepdims=True)
    table = np.where(counts < RARE, 0.0, table)
    found: dict[int, Aligned] = {}
    for numbers, letters, said in groups:
        for number, ends in _best(numbers, letters, said, table, width):
            word, full = words[number]
            found[number] = tuple(
                (letter, full[begin:end]) for letter, begin, end in zip(word, (0, *ends), ends, strict=False)
            )
    return [found[number] for number in sorted(found)]


Group = tuple[list[int], Ints, Ints]


def _groups(words: Sequence[Word], numbered: Mapping[str, int]) -> Iterator[Group]:
    """Words of the same numbers of letters and phones: their places, letters (n, L) and phones (n, P)."""
    alike: dict[tuple[int, int], list[int]] = defaultdict(list)
    for number, (word, said) in enumerate(words):
        if len(said) <= MOST_PHONES * len(word):
            alike[len(word), len(said)].append(number)
    for numbers in alike.values():
        letters = np.array([[LETTERS.index(letter) for letter in words[n][0]] for n in numbers])
        yield numbers, letters, np.array([[numbered[phone] for phone in words[n][1]] for n in numbers])


def _chunk(said: Ints, begin: int, end: int, width: int) -> Ints:
    """Columns of the table for the phones from `begin` to `end`, at most two."""
    if begin == end:
        return np.zeros(len(said), np.int64)
    return said[:, begin] * width + (said[:, begin + 1] if end - begin == MOST_PHONES else 0)


def _expect(letters: Ints, said: Ints, table: Floats, counts: Floats, width: int) -> None:
    """Add how often each letter is expected to stand for each chunk (forward and backward sums)."""
    n, n_letters = letters.shape
    n_phones = said.shape[1]
    forward = np.zeros((n_letters + 1, n_phones + 1, n))
    backward = np.zeros_like(forward)
    forward[0, 0] = backward[n_letters, n_phones] = 1.0
    steps = [
        (i, j, j + k) for i in range(n_letters) for j in range(n_phones + 1) for k in range(MOST_PHONES + 1)
        if j + k <= n_phones and j <= MOST_PHONES * i and n_phones - j - k <= MOST_PHONES * (n_letters - i - 1)
    ]  # fmt: skip
    weights = [table[letters[:, i], _chunk(said, begin, end, width)] for i, begin, end in steps]
    for (i, begin, end), weight in zip(steps, weights, strict=True):
        forward[i + 1, end] += forward[i, begin] * weight
    for (i, begin, end), weight in zip(reversed(steps), reversed(weights), strict=True):
        backward[i, begin] += backward[i + 1, end] * weight
    total = np.maximum(forward[n_letters, n_phones], 1e-300)
    for (i, begin, end), weight in zip(steps, weights, strict=True):
        share = forward[i, begin] * weight * backward[i + 1, end] / total
        np.add.at(counts, (letters[:, i], _chunk(said, begin, end, width)), share)


def _best(
    numbers: Sequence[int], letters: Ints, said: Ints, table: Floats, width: int
) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Each word that can be aligned, and where the phones of each of its letters end (Viterbi)."""
    n, n_letters = letters.shape
    n_phones = said.shape[1]
    best = np.full((n_letters + 1, n_phones + 1, n), -np.inf)
    taken = np.zeros((n_letters + 1, n_phones + 1, n), np.int8)
    best[0, 0] = 0.0
    with np.errstate(divide="ignore"):
        logs = np.log(table)
    for i in range(n_letters):
        for j in range(n_phones + 1):
            for k in range(min(MOST_PHONES, n_phones - j) + 1):
                score = best[i, j] + logs[letters[:, i], _chunk(said, j, j + k, width)]
                better = score > best[i + 1, j + k]
                best[i + 1, j + k][better] = score[better]
                taken[i + 1, j + k][better] = k
    for row, number in enumerate(numbers):
        if np.isfinite(best[n_letters, n_phones, row]):
            ends, at = [n_phones], n_phones
            for i in range(n_letters, 1, -1):
                at -= int(taken[i, at, row])
                ends.append(at)
            yield number, tuple(reversed(ends))
