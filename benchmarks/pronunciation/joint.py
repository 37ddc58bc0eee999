"""A joint n-gram model of letters and the phones they stand for, smoothed by Kneser and Ney's method.

The tokens are letters with their phones ("graphones"; Bisani and Ney, "Joint-sequence models for grapheme-to-phoneme
conversion", *Speech Communication* 50, 2008). Smoothing is interpolated and modified (Chen and Goodman, *Computer
Speech and Language* 13, 1999); then n-grams that hardly change the model's entropy are dropped (Stolcke, "Entropy-based
pruning of backoff language models", 1998).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


@dataclass
class Level:
    """The n-grams of one length, sorted by their first n - 1 tokens, then by the last one."""

    parent: Ints
    """Number, in the level below, of the first n - 1 tokens."""
    token: Ints
    suffix: Ints
    """Number, in the level below, of the last n - 1 tokens."""
    uses: Ints
    count: Floats
    """As Kneser and Ney count: the uses of the longest, else before how many tokens it stands."""
    p: Floats
    kept: NDArray[np.bool_]


@dataclass(frozen=True)
class Model:
    """Kept n-grams by level: their numbers of children, tokens, and natural logarithms of probability and back-off."""

    children: tuple[Ints, ...]
    tokens: tuple[Ints, ...]
    log_p: tuple[Floats, ...]
    log_backoff: tuple[Floats, ...]


def train(words: Sequence[Sequence[int]], n_tokens: int, order: int, threshold: float) -> Model:
    """The model of token sequences, each with a token for its begin and one for its end; `threshold` in nats a token
    of the training text."""
    levels = _count(words, n_tokens, order)
    _smooth(levels, n_tokens)
    _prune(levels, threshold, sum(len(word) - 1 for word in words))
    return _model(levels)


def _count(words: Sequence[Sequence[int]], n_tokens: int, order: int) -> list[Level]:
    tokens = np.concatenate([np.asarray(word) for word in words])
    place = np.concatenate([np.arange(len(word)) for word in words])
    number = np.zeros(len(tokens), np.int64)  # of the n-gram that ends here, in the level below
    levels: list[Level] = []
    for length in range(1, order + 1):
        ends = np.flatnonzero(place >= length - 1)
        before = number[ends - 1] if length > 1 else np.zeros(len(ends), np.int64)
        keys, first, inverse, uses = np.unique(
            before * n_tokens + tokens[ends], return_index=True, return_inverse=True, return_counts=True
        )
        suffix = number[ends[first]] if length > 1 else np.zeros(len(keys), np.int64)
        blank = np.zeros(len(keys))
        levels.append(
            Level(keys // n_tokens, keys % n_tokens, suffix, uses, blank, blank.copy(), np.ones(len(keys), bool))
        )
        if length > 1:
            below = levels[-2]
            seen_after = np.bincount(suffix, minlength=len(below.token))
            below.count = np.where(seen_after > 0, seen_after, below.uses).astype(float)
        number = np.full(len(tokens), -1)
        number[ends] = inverse
    levels[-1].count = levels[-1].uses.astype(float)
    return levels


def _smooth(levels: Sequence[Level], n_tokens: int) -> None:
    below = np.full(1, 1.0 / n_tokens)
    for level in levels:
        n_parents = int(level.parent.max()) + 1
        ones, twos, threes, fours = (1.0 + float(np.sum(level.count == k)) for k in (1, 2, 3, 4))
        unit = ones / (ones + 2.0 * twos)
        discounts = np.array(
            [0.0, 1 - 2 * unit * twos / ones, 2 - 3 * unit * threes / twos, 3 - 4 * unit * fours / threes]
        )
        less = np.clip(discounts, 0.0, None)[np.minimum(level.count, 3).astype(int)]
        total = np.bincount(level.parent, level.count, n_parents)[level.parent]
        spare = np.bincount(level.parent, less, n_parents)[level.parent]
        level.p = (level.count - less) / total + spare / total * below[level.suffix]
        below = level.p


def _prune(levels: Sequence[Level], threshold: float, n_uses: int) -> None:
    for k in range(len(levels) - 1, 0, -1):
        level, below = levels[k], levels[k - 1]
        if k + 1 < len(levels):
            has_children = np.bincount(levels[k + 1].parent[levels[k + 1].kept], minlength=len(level.token)).astype(
                bool
            )
        else:
            has_children = np.zeros(len(level.token), bool)
        n_parents = len(below.token)
        mass = np.bincount(level.parent, level.p, n_parents)
        lower = np.bincount(level.parent, below.p[level.suffix], n_parents)
        backoff = np.maximum(1 - mass, 1e-4) / np.maximum(1 - lower, 1e-4)
        change = np.log(level.p) - np.log(backoff[level.parent] * below.p[level.suffix])
        gain = level.uses / n_uses * change
        level.kept = has_children | (gain > threshold)


def _model(levels: Sequence[Level]) -> Model:
    children, tokens, log_p, log_backoff = [], [], [], []
    below_p = np.ones(1)
    for k, level in enumerate(levels):
        kept = level.kept
        tokens.append(level.token[kept])
        log_p.append(np.log(level.p[kept]))
        n_parents = len(levels[k - 1].token) if k else 1
        of_parent = levels[k - 1].kept if k else np.ones(1, bool)
        mass = np.bincount(level.parent[kept], level.p[kept], n_parents)
        lower = np.bincount(level.parent[kept], (levels[k - 1].p if k else below_p)[level.suffix[kept]], n_parents)
        backoff = np.maximum(1 - mass, 1e-4) / np.maximum(1 - lower, 1e-4) if k else np.ones(1)
        children.append(np.bincount(level.parent[kept], minlength=n_parents)[of_parent])
        log_backoff.append(np.log(backoff[of_parent]))
    return Model(tuple(children), tuple(tokens), tuple(log_p), tuple(log_backoff))
