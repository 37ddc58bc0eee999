"""Letter-to-sound rules: a pronunciation for any word that no lexicon has, such as a robot's name.

Ordered rules in context, the form of Elovitz et al. ("Letter-to-sound rules for automatic translation of English text
to phonetics", IEEE ASSP-24, 1976), written anew and short. At each place the first rule that fits is taken. Stress goes
to the first vowel, since the words here are names and nouns, but for such as Amanda. The rules stand in
`letter_rules.txt`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from hvcpd.config.names import plain_letters
from hvcpd.synthesis.phones import is_vowel

RULES_PATH = Path(__file__).with_name("letter_rules.txt")

LETTER_NAMES: dict[str, str] = {
    "a": "EY1", "b": "B IY1", "c": "S IY1", "d": "D IY1", "e": "IY1", "f": "EH1 F", "g": "JH IY1", "h": "EY1 CH",
    "i": "AY1", "j": "JH EY1", "k": "K EY1", "l": "EH1 L", "m": "EH1 M", "n": "EH1 N", "o": "OW1", "p": "P IY1",
    "q": "K Y UW1", "r": "AA1 R", "s": "EH1 S", "t": "T IY1", "u": "Y UW1", "v": "V IY1",
    "w": "D AH1 B AH0 L Y UW0", "x": "EH1 K S", "y": "W AY1", "z": "Z IY1",
    "0": "Z IH1 R OW0", "1": "W AH1 N", "2": "T UW1", "3": "TH R IY1", "4": "F AO1 R", "5": "F AY1 V",
    "6": "S IH1 K S", "7": "S EH1 V AH0 N", "8": "EY1 T", "9": "N AY1 N",
}  # fmt: skip

_CONSONANT = "[^aeiouy]"


@dataclass(frozen=True)
class _Rule:
    """Letters, the surroundings in which the rule holds, and the phones they stand for there."""

    before: re.Pattern[str]
    letters: str
    after: re.Pattern[str]
    phones: tuple[str, ...]

    def fits(self, word: str, place: int) -> bool:
        return (
            word.startswith(self.letters, place)
            and self.before.search(word[:place]) is not None
            and self.after.match(word[place + len(self.letters) :]) is not None
        )


@cache
def _rules() -> dict[str, tuple[_Rule, ...]]:
    """The rules by their first letter, in the order of the file."""
    rules: dict[str, list[_Rule]] = {}
    for line in RULES_PATH.read_text(encoding="utf-8").splitlines():
        if line.startswith("#") or not line.strip():
            continue
        before, letters, after, phones = (field.strip() for field in line.replace("{C}", _CONSONANT).split(";"))
        rule = _Rule(re.compile(f"(?:{before})$"), letters, re.compile(after), tuple(phones.split()))
        rules.setdefault(letters[0], []).append(rule)
    return {letter: tuple(found) for letter, found in rules.items()}


LONGEST = 45
"""Letters read as one word; a longer stretch is cut there, so that the time to read it grows in proportion. The longest
word in English dictionaries (pneumonoultramicroscopicsilicovolcanoconiosis) has 45."""

SPELT_BESIDE_DIGITS = 2
"""Letters beside digits that are spelt, not read: C3PO ends in "P O", nova7 begins with "nova"."""

_PART = re.compile(rf"[a-z]{{1,{LONGEST}}}|[0-9]")
_PENULTIMATE = re.compile(r"[aeiouy].*[aeiou][^aeiouy]{2,}[ao]$")
"""Words of three syllables or more that end in A or O with a heavy syllable before: Amanda, Zorlando. They keep the
stress of Latin and Italian (Chomsky and Halle, *The Sound Pattern of English*, 1968, ch. 3)."""
_DOUBLE = re.compile(r"(.)\1\1+")


def letter_to_sound(word: str) -> tuple[str, ...]:
    """A pronunciation of any word: ARPAbet phones, the first vowel stressed or the last but one.

    Digits are read one by one, and so are the letters of a stretch that the rules give no vowel, and of a short one
    beside digits (R2D2). Accents are taken off; characters that are neither Latin letters nor digits are passed over; a
    word of nothing else gives no phones.
    """
    phones: list[str] = []
    parts = _PART.findall(plain_letters(word).lower().replace("'", ""))
    for part in parts:
        spelt = part.isdigit() or len(part) == 1 or (len(parts) > 1 and len(part) <= SPELT_BESIDE_DIGITS)
        read = [] if spelt else _by_rule(_DOUBLE.sub(r"\1\1", part))
        if any(map(is_vowel, read)):
            phones += _stressed(read, _PENULTIMATE.search(part) is not None)
        else:
            for letter in part:
                phones += LETTER_NAMES[letter].split()
    return tuple(phones)


def _by_rule(part: str) -> list[str]:
    phones: list[str] = []
    place = 0
    while place < len(part):
        rule = next((rule for rule in _rules()[part[place]] if rule.fits(part, place)), None)
        phones += rule.phones if rule else ()
        place += len(rule.letters) if rule else 1
    return phones


def _stressed(phones: list[str], penultimate: bool) -> list[str]:
    """Stress on the first vowel, or on the last but one; the others have none, or a secondary stress where they are not
    often reduced."""
    vowels = sum(map(is_vowel, phones))
    if penultimate and vowels > 2:
        return _on(vowels - 2, phones)
    return _on(0, phones)


def _on(stressed: int, phones: list[str]) -> list[str]:
    out = []
    vowel = 0
    for phone in phones:
        if not is_vowel(phone):
            out.append(phone)
            continue
        reduced = phone in ("AH", "ER", "IH", "IY", "OW", "UH") or vowel < stressed
        if vowel < stressed and phone in ("AE", "EH", "AA"):
            phone = "AH"
        out.append(phone + ("1" if vowel == stressed else "0" if reduced else "2"))
        vowel += 1
    return out
