"""Pronunciations: our own lexicon in CMUdict's notation, a user's own file on top, and rules for every other word."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hvcpd.errors import ConfigError
from hvcpd.synthesis.letter_to_sound import letter_to_sound
from hvcpd.synthesis.phones import ARPABET, is_vowel

Pronunciation = tuple[str, ...]
"""ARPAbet phones, vowels with a stress digit: ("R", "AA1", "B")."""

BUILTIN_PATH = Path(__file__).with_name("lexicon.txt")


@dataclass(frozen=True)
class Lexicon:
    """Words in lower case and their pronunciations, the preferred one first."""

    entries: dict[str, tuple[Pronunciation, ...]]

    @classmethod
    def load(cls, extra: Path | None = None) -> Lexicon:
        """Our lexicon, with the entries of the file `extra` (same format) in place of ours.

        Raises `ConfigError` naming every bad line of it, or that it cannot be read.
        """
        entries = _read(BUILTIN_PATH)
        if extra is not None:
            entries |= _read(extra)
        return cls(entries)

    def pronunciations(self, word: str) -> tuple[Pronunciation, ...]:
        """Every known pronunciation of a word, the preferred one first; by rule when the lexicon lacks the word."""
        known = self.entries.get(word.lower())
        return known if known else (letter_to_sound(word),)

    def pronounce(self, word: str) -> Pronunciation:
        """The preferred pronunciation. Empty only for a word without any letter or digit."""
        return self.pronunciations(word)[0]


def _read(path: Path) -> dict[str, tuple[Pronunciation, ...]]:
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot read this lexicon: {error}. Give a UTF-8 text file.") from error
    entries: dict[str, list[Pronunciation]] = {}
    faults = []
    for number, line in enumerate(text.splitlines(), start=1):
        fields = line.partition("#")[0].split()
        if not fields:
            continue
        fault = _fault(fields)
        if fault:
            faults.append(f"{path}:{number}: {fault}")
            continue
        word = fields[0].lower().partition("(")[0]
        entries.setdefault(word, []).append(tuple(phone.upper() for phone in fields[1:]))
    if faults:
        raise ConfigError("\n".join(faults))
    return {word: tuple(said) for word, said in entries.items()}


def _fault(fields: list[str]) -> str:
    """What is wrong with the fields of one line; empty when nothing is."""
    word = fields[0].partition("(")[0].replace("'", "")
    if not (word.isascii() and word.isalnum()):
        return f"'{fields[0]}' is no word: write letters, digits and apostrophes"
    if len(fields) == 1:
        return f"no phones after '{fields[0]}': write for example 'rob R AA1 B'"
    for phone in fields[1:]:
        base = phone.upper().rstrip("012")
        if base not in ARPABET or len(phone) - len(base) > 1:
            return f"unknown phone '{phone}': the phones are {' '.join(sorted(ARPABET))}"
        if is_vowel(base) != (phone[-1] in "012"):
            return f"phone '{phone}': a vowel takes a stress digit 0, 1 or 2, a consonant none"
    return ""
