"""Names that can be spoken: of robots, teams and tasks. Each check says what is wrong and what to do, or None."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Literal

NameCheck = Callable[[str], str | None]
"""A further check of a name, such as the phrasebook's: its text for a name that cannot be used, else None."""

VoiceName = Literal["oak", "rose", "granite", "wren", "brook", "lark", "cedar", "willow"]
"""The synthesizer's voices, as settings name them; what they sound like stands in `synthesis/voices.py`."""

Accent = Literal["us", "gb"]
"""General American or Standard Southern British pronunciations."""

NameCheckBy = Callable[[Path | None, Accent], NameCheck]
"""Makes a check of names by the pronunciations of a lexicon file, if there is one, in an accent."""

MAX_NAME_LENGTH = 16
"""Letters and digits of a robot's or a team's name; longer ones take longer to say than the rest of a greeting."""

MIN_TASK_WORDS = 2
MAX_TASK_WORDS = 8
"""Words of a task's name: one word is too easily misheard, and eight take some three seconds to say."""

MAX_WORD_LENGTH = 20
"""Letters of a word; ordinary English words are shorter."""

MAX_ALTERNATIVE_WORDS = 3
"""Most words of a phrase that counts as another word: the number that the check for confusable phrases compares."""

_UNDECOMPOSED = str.maketrans(
    dict(zip("øØđĐðÐłŁıħĦŧŦəƏ’‘‐«»„“”", 'oOdDdDlLihHtTeE\'\'-"""""', strict=True))
    | {"ß": "ss", "ẞ": "SS", "æ": "ae", "Æ": "Ae", "œ": "oe", "Œ": "Oe", "þ": "th", "Þ": "Th", "ŋ": "ng", "Ŋ": "Ng"}
)
"""Latin letters that Unicode does not take apart into a plain letter and a mark, and typographic punctuation."""
_MISTAKEN = str.maketrans({"№": "No.", "™": None, "º": "°", "˚": "°", "´": "'", "`": "'", "ʼ": "'"})
"""Signs that Unicode would take for letters or nothing: No 5, RobTM, 20 oC, don t."""
_SILENT = ("Mn", "Cf")
"""Unicode's categories of accents and of what shows no sign, such as a soft hyphen or the mark that begins a file."""

CONTRACTED = {"can't": "cannot", "won't": "will not"}
"""Contractions whose first word changes, and their full words."""
CONTRACTED_ENDINGS = {"n't": "not", "'m": "am", "'re": "are", "'ll": "will", "'ve": "have"}
"""Those of other contractions; not "'s", which "the rose's leaves" has, too."""

_ROBOT_NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*")
_WORD = re.compile(r"[a-z]+")


def plain_letters(text: str) -> str:
    """The text with Latin letters in their plain form: Łódź is Lodz, Straße Strasse, café cafe. Other scripts stay, and
    signs that do not show are left out."""
    decomposed = unicodedata.normalize("NFKD", text.translate(_MISTAKEN)).translate(_UNDECOMPOSED)
    return "".join(c for c in decomposed if unicodedata.category(c) not in _SILENT)


def valid_robot_name(name: str) -> str | None:
    """What is wrong with the name of a robot or person, or None. Names are shown as written, and compared without
    regard to case."""
    if not name or len(name) > MAX_NAME_LENGTH:
        return f"a name has 1 to {MAX_NAME_LENGTH} letters, {name[:40]!r} has {len(name)}; choose another"
    if not _ROBOT_NAME.fullmatch(name):
        return f"the name {name!r} is not a letter followed by letters and digits; {_instead_of_name(name)}"
    return None


def _instead_of_name(name: str) -> str:
    """Return the name as it can be spoken: José is Jose, R2-D2 is R2D2."""
    tidy = re.sub(r"[^A-Za-z0-9]", "", plain_letters(name))[:MAX_NAME_LENGTH]
    return f"write for example {tidy!r}" if _ROBOT_NAME.fullmatch(tidy) else "choose another"


def valid_team_name(name: str) -> str | None:
    """What is wrong with a team's name, or None: it is one word that can be spoken, in lower case."""
    if not _WORD.fullmatch(name) or len(name) > MAX_NAME_LENGTH:
        tidy = re.sub(r"[^a-z]", "", plain_letters(name).lower())
        hint = f"write for example {tidy!r}" if 0 < len(tidy) <= MAX_NAME_LENGTH else "choose another"
        return f"the team's name {name[:40]!r} is not one word of 1 to {MAX_NAME_LENGTH} letters a-z; {hint}"
    return None


def valid_task_name(name: str) -> str | None:
    """What is wrong with a task's name, or None: a few English words in lower case, digits written as words."""
    words = name.split(" ")
    if any(character.isdigit() for character in name):
        return f"the task name {name[:40]!r} has digits; write numbers as words (two, not 2)"
    if not all(map(_WORD.fullmatch, words)):
        tidy = _tidy_words(name)
        hint = f"write for example {tidy!r}" if valid_task_name_length(tidy) is None else _without_strange(name)
        return f"the task name {name[:40]!r} is not words of the letters a-z with one space between; {hint}"
    if (long := next((word for word in words if len(word) > MAX_WORD_LENGTH), None)) is not None:
        return (
            f"the word {long[:40]!r} has {len(long)} letters, and a word has {MAX_WORD_LENGTH} at most; choose another"
        )
    return valid_task_name_length(name)


def _without_strange(text: str) -> str:
    """What to do about the first character that is no plain letter: it may be invisible, or look like one."""
    strange = next((c for c in plain_letters(text) if not c.isascii()), None)
    if strange is None:
        return "use lower-case words"
    called = unicodedata.name(strange, f"U+{ord(strange):04X}")
    return f"it has the character {called}; write lower-case words without it"


def _tidy_words(text: str) -> str:
    """The words that can be spoken of a text, in lower case; nothing where leaving out the rest would maim a word."""
    plain = plain_letters(text).lower()
    for short, full in (CONTRACTED | CONTRACTED_ENDINGS).items():
        plain = re.sub(rf"{short}\b", f" {full}", plain)
    plain = plain.replace("'", "")
    return " ".join(re.findall(r"[a-z]+", plain))[:80] if plain.isascii() else ""


def valid_task_name_length(name: str) -> str | None:
    """What is wrong with the number of words in a task's name, or None."""
    count = len(name.split())
    if MIN_TASK_WORDS <= count <= MAX_TASK_WORDS:
        return None
    return f"a task name has {MIN_TASK_WORDS} to {MAX_TASK_WORDS} words, {name[:40]!r} has {count}; reword it"


def valid_word(word: str) -> str | None:
    """What is wrong with a word that is to have alternatives, or None."""
    if _WORD.fullmatch(word) and len(word) <= MAX_WORD_LENGTH:
        return None
    return f"{word[:40]!r} is not one lower-case word of the letters a-z; write it as in the task's name"


def valid_alternative(phrase: str) -> str | None:
    """What is wrong with a phrase that counts as a word, or None."""
    words = phrase.split(" ")
    if all(_WORD.fullmatch(word) and len(word) <= MAX_WORD_LENGTH for word in words):
        if len(words) <= MAX_ALTERNATIVE_WORDS:
            return None
        return f"an alternative has 1 to {MAX_ALTERNATIVE_WORDS} words, {phrase[:40]!r} has {len(words)}; shorten it"
    tidy = _tidy_words(phrase)
    hint = f"write for example {tidy!r}" if tidy else "leave it out"
    return f"the alternative {phrase[:40]!r} is not words of the letters a-z with one space between; {hint}"


def repeated_names(names: tuple[str, ...]) -> str | None:
    """What is wrong with a list of robots' names as a whole, or None: no name may occur twice, whatever its case."""
    firsts: dict[str, str] = {}
    for name in names:
        firsts.setdefault(name.casefold(), name)
    again = [(before, name) for name in names if (before := firsts[name.casefold()]) is not name]
    faults = [f"the names {before!r} and {name!r} are the same aloud; keep one" for before, name in again]
    return "; ".join(dict.fromkeys(faults)) or None


def valid_robot_names(names: tuple[str, ...]) -> str | None:
    """What is wrong with each of a list of robots' names, otherwise with the list, or None."""
    return every_fault(names, valid_robot_name) or repeated_names(names)


def every_fault(names: Iterable[str], check: NameCheck) -> str | None:
    """What is wrong with each of the names, in one line, or None."""
    return "; ".join(filter(None, map(check, dict.fromkeys(names)))) or None
