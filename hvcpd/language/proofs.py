"""Words that prove the speaker of a sentence, or that encrypt its statement."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Seal:
    """A robot's seal after a sentence, which proves its speaker: a number of four code words."""

    value: int


@dataclass(frozen=True)
class Code:
    """A person's code after a sentence, for the same purpose: six digits that are valid once."""

    digits: str = field(repr=False)


@dataclass(frozen=True)
class Cipher:
    """A statement, encrypted: a number of `n_words` code words, said in the statement's place."""

    value: int
    n_words: int


Mark = Seal | Code | Cipher
