"""Pronunciations: our own lexicon in CMUdict's notation, a user's own file on top, and rules for every other word."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from hvcpd.errors import ConfigError
from hvcpd.language.words import NUMBER_MAX, number_words
from hvcpd.synthesis.homographs import Place
from hvcpd.synthesis.inflection import Derived, derive
from hvcpd.synthesis.letter_to_sound import letter_to_sound
from hvcpd.synthesis.phones import ARPABET, is_vowel

Pronunciation = tuple[str, ...]
"""ARPAbet phones, vowels with a stress digit: ("R", "AA1", "B")."""

BUILTIN_PATH = Path(__file__).with_name("lexicon.txt")

_PLACES = {place.value: place for place in Place}


@dataclass(frozen=True)
class Lexicon:
    """Words in lower case and their pronunciations, the preferred one first.

    `places` has, for words whose pronunciation depends on their place in the phrase, the one of each place; `own` are
    the words that a user's file gives, `path` that file.
    """

    entries: Mapping[str, tuple[Pronunciation, ...]]
    places: Mapping[str, Mapping[Place, Pronunciation]] = field(default_factory=dict)
    own: frozenset[str] = frozenset()
    path: Path | None = None

    @classmethod
    def load(cls, extra: Path | None = None) -> Lexicon:
        """Our lexicon, with the entries of the file `extra` (same format) in place of ours.

        Raises `ConfigError` naming every bad line of it, or that it cannot be read.
        """
        ours = _read(BUILTIN_PATH)
        if extra is None:
            return ours
        theirs = _read(extra)
        kept = {word: places for word, places in ours.places.items() if word not in theirs.entries}
        own = frozenset(theirs.entries)
        return cls({**ours.entries, **theirs.entries}, {**kept, **theirs.places}, own, extra)

    def pronunciations(self, word: str) -> tuple[Pronunciation, ...]:
        """Every known pronunciation of a word, the preferred one first; by rule when the lexicon lacks the word."""
        known = self.entries.get(word.lower())
        if known:
            return known
        form = self.form(word)
        return form.said if form is not None else (self._read_out(word),)

    def form(self, word: str) -> Derived | None:
        """How a word is said that is not listed itself but is a regular form of one that is ("rows")."""
        return None if word.lower() in self.entries else derive(word.lower(), self.entries, self.places)

    def places_of(self, word: str) -> Mapping[Place, Pronunciation]:
        """The pronunciation of each place in the phrase, for a word that has such, listed or a form of one listed."""
        form = self.form(word)
        return form.places if form is not None else self.places.get(word.lower(), {})

    def pronounce(self, word: str, place: Place | None = None) -> Pronunciation:
        """The pronunciation of that place in the phrase, if the word has one, or the preferred one.

        Empty only for a word without any letter or digit.
        """
        found = self.places_of(word).get(place) if place is not None else None
        return found or self.pronunciations(word)[0]

    def spoken(self, word: str) -> tuple[Pronunciation, ...]:
        """The pronunciations that our voices may use, the preferred one first: one but for words with places."""
        return tuple(dict.fromkeys((self.pronounce(word), *self.places_of(word).values())))

    def sounds(self, word: str) -> list[tuple[str, ...]]:
        """Every known pronunciation without stress, each once."""
        said = self.pronunciations(word)
        return list(dict.fromkeys(tuple(phone.rstrip("012") for phone in phones) for phones in said))

    def _read_out(self, word: str) -> Pronunciation:
        """A whole number up to 99 as a number, all else by the letter-to-sound rules."""
        if word.isascii() and word.isdecimal() and str(int(word[:9])) == word and int(word) <= NUMBER_MAX:
            return tuple(phone for part in number_words(int(word)) for phone in self.pronounce(part))
        return letter_to_sound(word)


def _read(path: Path) -> Lexicon:
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise ConfigError(f"{path}: cannot read this lexicon: {error}. Give a UTF-8 text file.") from error
    entries: dict[str, list[Pronunciation]] = {}
    places: dict[str, dict[Place, Pronunciation]] = {}
    faults = []
    for number, line in enumerate(text.splitlines(), start=1):
        fields = line.partition("#")[0].split()
        if not fields:
            continue
        fault = _fault(fields)
        if fault:
            faults.append(f"{path}:{number}: {fault}")
            continue
        word, _, mark = fields[0].lower().partition("(")
        phones = tuple(phone.upper() for phone in fields[1:])
        entries.setdefault(word, []).append(phones)
        if mark[:-1] in _PLACES:
            places.setdefault(word, {})[_PLACES[mark[:-1]]] = phones
    if faults:
        raise ConfigError("\n".join(faults))
    return Lexicon({word: tuple(dict.fromkeys(said)) for word, said in entries.items()}, places)


def _fault(fields: list[str]) -> str:
    """What is wrong with the fields of one line; empty when nothing is."""
    word, bracket, mark = fields[0].partition("(")
    bare = word.replace("'", "")
    if not (bare.isascii() and bare.isalnum()):
        return f"'{fields[0]}' is no word: write letters, digits and apostrophes"
    if bracket and not (mark.endswith(")") and (mark[:-1].isdecimal() or mark[:-1].lower() in _PLACES)):
        return f"'{fields[0]}': in brackets stands a number or a place: {', '.join(_PLACES)}"
    if len(fields) == 1:
        return f"no phones after '{fields[0]}': write for example 'rob R AA1 B'"
    for phone in fields[1:]:
        base = phone.upper().rstrip("012")
        if base not in ARPABET or len(phone) - len(base) > 1:
            near = difflib.get_close_matches(base, sorted(ARPABET), 1, cutoff=0.5)
            meant = f"; did you mean {near[0]}?" if near else ""
            return f"unknown phone '{phone}'{meant} The phones are {' '.join(sorted(ARPABET))}"
        if is_vowel(base) != (phone[-1] in "012"):
            return f"phone '{phone}': a vowel takes a stress digit 0, 1 or 2, a consonant none"
    return ""
