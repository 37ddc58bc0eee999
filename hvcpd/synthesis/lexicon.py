"""Pronunciations: a user's own file, over our lexicon, over CMUdict, over letter to sound for every other word."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cache
from pathlib import Path
from sys import intern

from hvcpd.config.document import decoded, read_bytes
from hvcpd.config.names import Accent, plain_letters
from hvcpd.errors import ConfigError, alike
from hvcpd.language.words import NUMBER_MAX, number_words
from hvcpd.synthesis.accent import WORDS as BRITISH_WORDS
from hvcpd.synthesis.accent import british
from hvcpd.synthesis.dictionary import SYMBOLS, Dictionary, Pronunciation
from hvcpd.synthesis.homographs import Place
from hvcpd.synthesis.inflection import american_spellings, derive, with_ending
from hvcpd.synthesis.letter_to_sound import LETTER_NAMES, letter_to_sound
from hvcpd.synthesis.phones import ARPABET, BRITISH

BUILTIN_PATH = Path(__file__).with_name("lexicon.txt")
DICTIONARY_PATH = Path(__file__).with_name("cmudict.bin")
COMMON_PATH = Path(__file__).with_name("common_words.txt")

CMUDICT = Dictionary(DICTIONARY_PATH)

SPELT_BESIDE_DIGITS = 2
"""Letters beside digits that are spelt, not read: C3PO ends in "P O", nova7 begins with "nova"."""

_PLACES = {place.value: place for place in Place}
_PART = re.compile("[a-z]+|[0-9]")


class Origin(Enum):
    """Where a pronunciation is from; the value is how people are told."""

    OWN = "your lexicon"
    BUILTIN = "built-in lexicon"
    FORM = "a regular form of a listed word"
    SPELLING = "a British spelling of a listed word"
    NUMBER = "read as a number"
    LETTERS = "letter to sound"


@dataclass(frozen=True)
class Entry:
    """How a word is said: the preferred way first, and the one of each place in the phrase that tells them apart."""

    said: tuple[Pronunciation, ...]
    origin: Origin
    places: Mapping[Place, Pronunciation] = field(default_factory=dict)

    def place(self, place: Place | None) -> Place | None:
        """Whose pronunciation is said at that place of a phrase; None where the preferred one is.

        After "is" or "have" a word without a participle of its own is a noun or an adjective ("the power is live").
        """
        if place is Place.PAST and place not in self.places:
            place = Place.NOUN
        return place if place in self.places else None


@dataclass(frozen=True)
class Lexicon:
    """Words in lower case and their pronunciations, the preferred one first, over those of `dictionary`.

    `places` has, for words whose pronunciation depends on their place in the phrase, the one of each place; `own` are
    the words that a user's file gives. All these are American; with `accent` "gb" each is said as British English has
    it (`accent.py`).
    """

    entries: Mapping[str, tuple[Pronunciation, ...]]
    places: Mapping[str, Mapping[Place, Pronunciation]] = field(default_factory=dict)
    own: frozenset[str] = frozenset()
    dictionary: Dictionary = CMUDICT
    accent: Accent = "us"

    @classmethod
    def load(cls, extra: Path | None = None, accent: Accent = "us") -> Lexicon:
        """Our lexicon in that accent, with the entries of the file `extra` (same format) in place of ours.

        Raises `ConfigError` naming every bad line of it, or that it cannot be read.
        """
        ours = replace(_builtin(), accent=accent)
        if extra is None:
            return ours
        theirs = _read(extra)
        kept = {word: places for word, places in ours.places.items() if word not in theirs.entries}
        own = frozenset(theirs.entries)
        return cls({**ours.entries, **theirs.entries}, {**kept, **theirs.places}, own, accent=accent)

    def find(self, word: str) -> Entry:
        """How a word is said, and where that is from. Without any letter or digit it is said as nothing."""
        word = word.lower()
        entry = self._american(word)
        if self.accent == "us" or entry.origin in (Origin.NUMBER, Origin.LETTERS):
            return entry
        said = tuple(dict.fromkeys(british(word, phones) for phones in entry.said))
        return replace(entry, said=said, places={at: british(word, said) for at, said in entry.places.items()})

    def _american(self, word: str) -> Entry:
        """As `find`, before the rules of the accent; but of what is read by its words or letters, after them."""
        if said := self._otherwise(word):
            origin = Origin.OWN if word in self.own else Origin.BUILTIN
            return Entry(said, origin, self.places.get(word, {}))
        form = derive(word, self._otherwise, self.places)
        if form is None and (listed := self.dictionary.look_up(word)):
            return Entry(listed, Origin.BUILTIN)
        for spelling in american_spellings(word) if form is None else ():
            if american := self.listed(spelling):
                return Entry(american, Origin.SPELLING, self.places.get(spelling, {}))
        form = form or derive(word, self._in_either_spelling, self.places)
        if form is not None:
            return Entry(form.said, Origin.FORM, form.places)
        if word.isascii() and word.isdecimal() and str(int(word[:9])) == word and int(word) <= NUMBER_MAX:
            parts = (self.pronounce(part) for part in number_words(int(word)))
            return Entry((tuple(phone for part in parts for phone in part),), Origin.NUMBER)
        if word.endswith("'s") and (owner := self._read_out(word[:-2])):
            return Entry((with_ending(owner, "s"),), Origin.LETTERS)
        return Entry((self._read_out(word),), Origin.LETTERS)

    def listed(self, word: str) -> tuple[Pronunciation, ...]:
        """The pronunciations of a word that a lexicon or the dictionary has; empty of any other."""
        return self._otherwise(word.lower()) or self.dictionary.look_up(word.lower())

    def _in_either_spelling(self, word: str) -> tuple[Pronunciation, ...]:
        return next(filter(None, map(self.listed, (word, *american_spellings(word)))), ())

    def _otherwise(self, word: str) -> tuple[Pronunciation, ...]:
        """As `listed`, of words that are said otherwise than in the dictionary: so are their forms."""
        if self.accent == "gb" and word in BRITISH_WORDS and word not in self.own:
            return (BRITISH_WORDS[word],)
        return self.entries.get(word, ())

    def pronunciations(self, word: str) -> tuple[Pronunciation, ...]:
        """Every known pronunciation of a word, the preferred one first; read by its letters when no lexicon has it."""
        return self.find(word).said

    def pronounce(self, word: str, place: Place | None = None) -> Pronunciation:
        """The pronunciation of that place in the phrase, if the word has one, or the preferred one.

        Empty only for a word without any letter or digit.
        """
        entry = self.find(word)
        said_as = entry.place(place)
        return entry.places[said_as] if said_as is not None else entry.said[0]

    def spoken(self, word: str) -> tuple[Pronunciation, ...]:
        """The pronunciations that our voices may use, the preferred one first: one but for words with places."""
        entry = self.find(word)
        return tuple(dict.fromkeys((entry.said[0], *entry.places.values())))

    def sounds(self, word: str) -> list[tuple[str, ...]]:
        """Every known pronunciation without stress, each once, in the 39 phones that people are heard by."""
        said = replace(self, accent="us").pronunciations(word)
        return list(dict.fromkeys(tuple(phone.rstrip("012") for phone in phones) for phones in said))

    def _read_out(self, word: str) -> Pronunciation:
        """Letters read as a word, digits named one by one, and so the letters of a short part beside digits (R2D2)."""
        phones: list[str] = []
        parts = _PART.findall(plain_letters(word).lower().replace("'", ""))
        for part in parts:
            if part.isdigit():
                phones += self.pronounce(number_words(int(part))[0])
            elif len(parts) > 1 and len(part) <= SPELT_BESIDE_DIGITS:
                phones += [phone for letter in part for phone in self._accented(letter, LETTER_NAMES[letter].split())]
            else:
                known = self.listed(part)
                phones += self._accented(part, known[0] if known else letter_to_sound(part))
        return tuple(phones)

    def _accented(self, word: str, phones: Sequence[str]) -> Pronunciation:
        return tuple(phones) if self.accent == "us" else british(word, phones)


def common_words() -> tuple[str, ...]:
    """Words that robots, teachers and tasks commonly use, in lower case and in order."""
    lines = COMMON_PATH.read_text(encoding="utf-8").splitlines()
    return tuple(word for line in lines if not line.startswith("#") for word in line.split())


@cache
def _builtin() -> Lexicon:
    """A command's settings and its sentences ask for it one after the other."""
    return _read(BUILTIN_PATH)


def _read(path: Path) -> Lexicon:
    text = decoded(read_bytes(path), str(path))
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
        phones = tuple(intern(phone.upper()) for phone in fields[1:])
        entries.setdefault(word, []).append(phones)
        if mark[:-1] in _PLACES:
            places.setdefault(word, {}).setdefault(_PLACES[mark[:-1]], phones)
    if faults:
        raise ConfigError("\n".join(faults))
    return Lexicon({word: tuple(dict.fromkeys(said)) for word, said in entries.items()}, places)


_STOP = ("S T AA1 P", "S T AO1 P")
"""What the keyword's net was trained to hear."""

_WRITTEN = frozenset(SYMBOLS)


def _fault(fields: list[str]) -> str:
    """What is wrong with the fields of one line; empty when nothing is."""
    word, bracket, mark = fields[0].partition("(")
    bare = word.replace("'", "")
    if not (bare.isascii() and bare.isalnum()):
        plain = plain_letters(bare)
        hint = (
            f"'{plain}', as it is looked up"
            if plain.isascii() and plain.isalnum()
            else "letters, digits and apostrophes"
        )
        return f"'{fields[0]}' is not a word: write {hint}"
    if bracket and not (mark.endswith(")") and (mark[:-1].isdecimal() or mark[:-1].lower() in _PLACES)):
        return f"'{fields[0]}': in brackets stands a number or a place: {', '.join(_PLACES)}"
    if len(fields) == 1:
        return f"no phones after '{fields[0]}': write for example 'rob R AA1 B'"
    for phone in fields[1:]:
        if phone in _WRITTEN:
            continue
        base = phone.upper().rstrip("0123456789")
        if base in BRITISH:
            return f"phone '{phone}': write the American pronunciation; `accent: gb` makes the British one of it"
        if base not in ARPABET:
            near = alike(base, sorted(ARPABET), 0.5)
            hint = f"did you mean {near}?" if near else f"the phones are {' '.join(sorted(ARPABET))}"
            return f"unknown phone '{phone}'; {hint}"
        if phone.upper() not in _WRITTEN:
            return f"phone '{phone}': a vowel takes a stress digit 0, 1 or 2, a consonant none"
    said = " ".join(fields[1:]).upper()
    if word.lower() == "stop" and said not in _STOP:
        return f"'stop' must stay {' or '.join(_STOP)}, or nobody could stop the robots"
    if word.lower() != "stop" and said.replace("0", "1").replace("2", "1") in _STOP:
        return f"'{fields[0]}' would sound like 'stop', and halt every robot"
    return ""
