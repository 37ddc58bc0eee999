"""What is said with a sentence to prove who says it, or in place of its statement to hide that."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Seal:
    """What a robot with a key says after a sentence, so that others know who said it: a number of four code words."""

    value: int


@dataclass(frozen=True)
class Code:
    """What a person says after a sentence for the same end: six digits that are good once."""

    digits: str = field(repr=False)


@dataclass(frozen=True)
class Cipher:
    """A statement, encrypted: a number of `n_words` code words, said in the statement's place."""

    value: int
    n_words: int


Mark = Seal | Code | Cipher
