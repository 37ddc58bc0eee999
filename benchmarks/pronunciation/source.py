"""The Carnegie Mellon Pronouncing Dictionary as published: one line for each word, with stress."""

from __future__ import annotations

import re
from pathlib import Path

from hvcpd.synthesis.dictionary import Pronunciation

_WORD = re.compile(r"([a-z0-9']+)(?:\(\d+\))?")


def read_cmudict(path: Path) -> dict[str, tuple[Pronunciation, ...]]:
    """Words of letters, digits and apostrophes, and their pronunciations in the file's order.

    Reads `cmudict-0.7b` (comments begin with ";;;") and `cmudict.dict` (with "#").
    """
    found: dict[str, dict[Pronunciation, None]] = {}
    for line in path.read_text(encoding="latin-1").splitlines():
        fields = line.partition("#")[0].split()
        if fields and (word := _WORD.fullmatch(fields[0].lower())):
            found.setdefault(word[1], {})[tuple(fields[1:])] = None
    return {word: tuple(said) for word, said in found.items()}
