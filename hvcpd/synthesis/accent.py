"""British pronunciations (Standard Southern British) by rule from American ones and the spelling.

The rules and the names of the sets of words are those of J. C. Wells, *Accents of English* (1982), vol. 1, ch. 2 and 3.
Where American English has merged what British English keeps apart (LOT and PALM, "carry" and "caring"), the spelling
tells. Words are rendered one by one, without what follows them, so there is no linking R: "four oranges" has none.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from hvcpd.synthesis.allophones import is_flapped
from hvcpd.synthesis.dictionary import Pronunciation
from hvcpd.synthesis.phones import UNFLAPPED, is_vowel, stress_of

_WORDS = {
    "banana": "B AH0 N AA1 N AH0", "because": "B IH0 K AA1 Z", "been": "B IY1 N", "buoy": "B OY1",
    "clara": "K L AA1 R AH0",
    "clerk": "K L AA1 R K", "depot": "D EH1 P OW0", "either": "AY1 DH ER0", "figure": "F IH1 G ER0",
    "from": "F R AA1 M", "garage": "G AE1 R AA2 ZH", "herb": "HH ER1 B", "laboratory": "L AH0 B AA1 R AH0 T R IY0",
    "leisure": "L EH1 ZH ER0", "lever": "L IY1 V ER0", "neither": "N AY1 DH ER0", "pasta": "P AE1 S T AH0",
    "privacy": "P R IH1 V AH0 S IY0", "process": "P R OW1 S EH2 S", "resume": "R IH0 Z Y UW1 M",
    "resumed": "R IH0 Z Y UW1 M D", "resuming": "R IH0 Z Y UW1 M IH0 NG", "route": "R UW1 T",
    "schedule": "SH EH1 JH UW2 L", "shone": "SH AA1 N",
    "squirrel": "S K W IH1 R AH0 L", "syrup": "S IH1 R AH0 P", "tara": "T AA1 R AH0", "thorough": "TH AH1 R AH0",
    "tomato": "T AH0 M AA1 T OW0", "vase": "V AA1 Z", "vehicle": "V IY1 AH0 K AH0 L",
    "vitamin": "V IH1 T AH0 M IH0 N", "what": "W AA1 T", "without": "W IH0 DH AW1 T", "z": "Z EH1 D",
    "zebra": "Z EH1 B R AH0",
}  # fmt: skip
WORDS = {word: tuple(phones.split()) for word, phones in _WORDS.items()}
"""Words that differ by no rule, as they are before the rules."""

_BATH = re.compile(
    r"(?:air|broad|eye|fore|foot|hour|out|over|photo|tele|under|space)?"
    r"(?:advanc|advantage|after|answer|ask|aunt|bask|basket|bath|blast|branch|brass|calf|calv|can't|cask|cast|castle"
    r"|chanc|chant|clasp|class|command|contrast|craft|daft|danc|demand|disaster|draft|draught|enhanc|exampl|fast|fasten"
    r"|flask|francis|gasp|ghastly|giraff|glanc|glass|graft|grant|graph|grasp|grass|half|halv|lanc|last|laugh|laughter"
    r"|mask|mast|master|nasty|pass|past|pastor|path|plant|plaster|raft|rasp|raspberr|rather|sampl|shaft|slant|staff|task"
    r"|tranc|vantage|vast)"
    r"(?:'s|e|s|es|d|ed|y|ies|ly|ing|ings|er|ers|r|ball|house|land|mate|noon|port|room|rooms|ward|wards|way|word|words)?"
)
"""Words with the vowel of "palm" where American English has that of "trap"; "classic" and "passenger" are none."""

_LOT_BEFORE_R = re.compile(
    r".*(?:orr|oracle|orange|origin|ority|foreign|forest|flor[ei]|flori|[bd]ori|dorothy|moral|coral|histor|author|majorit|quarr|warr(?:an|en|io))"
)
"""Spellings in which an O before R and a vowel is that of "lot"; in others, as in "story", that of "north"."""

_TRAP_BEFORE_R = re.compile(
    r".*(?:arr|arab|baron|caram|carol|caravan|charact|charit|clarit|gary|guaran|harol|karen|mari[go]|para|paris|sharon)"
)
_STRUT_BEFORE_R = re.compile(r".*(?:courag|curr[ae]|flourish|hurr|nourish|turr|worr)")
_LOT_AU = re.compile(r"(?:aust|because|cauli|laure[ln]|saus).*")
_YOD_AFTER = frozenset("T D N".split())
_BREAKING = frozenset("AY AW OY EY".split())
"""Diphthongs after which an R is left as a schwa: "fire"."""


def british(word: str, phones: Sequence[str]) -> Pronunciation:
    """The British pronunciation of a word in lower case, from its American one in ARPAbet with stress digits."""
    phones = _weak_endings(word, list(phones))
    spelled = _vowel_letters(word, sum(map(is_vowel, phones)))
    out: list[str] = []
    vowels = 0
    for number, phone in enumerate(phones):
        after = phones[number + 1] if number + 1 < len(phones) else ""
        if is_vowel(phone):
            out += _vowel(word, spelled[vowels], phones, number)
            vowels += 1
        elif phone != "R" or (after and is_vowel(after)) or not out or not is_vowel(out[-1]):
            out.append(phone)
        elif phones[number - 1].rstrip("012") in _BREAKING:
            out.append("AH0")
    if _BATH.fullmatch(word):
        out = _with_broad_a(out)
    return tuple(UNFLAPPED.get(phone, phone) if is_flapped(out, k) else phone for k, phone in enumerate(out))


def _vowel_letters(word: str, vowels: int) -> list[str]:
    """The letters of each vowel, with the W before them if there is one; all of the word's where they don't tell."""
    found = re.findall("(?:wh?)?[aeiouy]+", word.replace("qu", "qw"))
    if len(found) == vowels + 1 and found[-1].endswith("e"):
        found.pop()
    return found if len(found) == vowels else [word] * vowels


def _weak_endings(word: str, phones: list[str]) -> list[str]:
    """Endings whose vowel is weak in British English ("library", "inventory") or strong ("mobile")."""
    end = len(phones) - (phones[-1:] == ["Z"])
    if phones[end - 2 : end] == ["R", "IY0"] and phones[end - 3] in ("EH2", "AO2"):
        return [*phones[: end - 3], "AH0", *phones[end - 2 :]]
    if word.endswith("ile") and phones[-2:] == ["AH0", "L"]:
        return [*phones[:-2], "AY2", "L"]
    return phones


def _with_broad_a(phones: list[str]) -> list[str]:
    """The phones with the vowel of "palm" in place of the most stressed one of "trap"."""
    found = [k for k, phone in enumerate(phones) if phone.startswith("AE")]
    if not found:
        return phones
    at = min(found, key=lambda k: (stress_of(phones[k]) or 3, -k))
    return [*phones[:at], "AA" + phones[at][-1], *phones[at + 1 :]]


def _vowel(word: str, letters: str, phones: Sequence[str], number: int) -> tuple[str, ...]:
    """A vowel as British English has it, with a Y before it in "new", and an R after it where its own is sounded."""
    base, stress = phones[number][:-1], phones[number][-1]
    before = phones[number - 1] if number else ""
    after = phones[number + 1] if number + 1 < len(phones) else ""
    linked = number + 2 < len(phones) and is_vowel(phones[number + 2])
    if base == "ER":
        sounded = ("R",) if after and is_vowel(after) else ()
        if stress == "0":
            return ("AH0", *sounded)
        return ("AH" + stress if sounded and _STRUT_BEFORE_R.match(word) else "AX:" + stress, *sounded)
    if after == "R":
        return (_before_r(word, letters, base, linked) + stress,)
    if base == "UW" and before in _YOD_AFTER and "o" not in letters:
        return "Y", "UW" + stress
    if base == "AH" and stress == "0" and _is_weak_i(letters, phones[number + 1 :]):
        return ("IH0",)
    return (_plain(word, letters, base, before, after) + stress,)


def _is_weak_i(letters: str, after: Sequence[str]) -> bool:
    """Whether an unstressed vowel is that of "rabbit", "basket" and "package", a schwa in American English."""
    if letters in ("i", "y"):
        return True
    ending = [phone for phone in after if phone != "S"]
    return (letters == "e" and ending in (["T"], ["D"], ["Z"])) or (letters == "a" and after[:1] == ["JH"])


def _plain(word: str, letters: str, base: str, before: str, after: str) -> str:
    """A vowel that no R follows."""
    if base == "OW":
        return "AXW"
    if base == "AA":
        palm = "a" in letters and "o" not in letters and not letters.startswith("w") and not _LOT_AU.fullmatch(word)
        return "AA" if palm else "OH"
    if base == "AO":
        lot = letters == "o" or _LOT_AU.fullmatch(word) or (before == "W" and after in ("SH", "N"))
        return "OH" if lot else "AO:"
    return base


def _before_r(word: str, letters: str, base: str, linked: bool) -> str:
    """A vowel before R, which is sounded if it is `linked`, before another vowel of the word."""
    if base in ("AO", "OW"):
        return "OH" if linked and (_LOT_BEFORE_R.match(word) or _LOT_AU.fullmatch(word)) else "AO:"
    if base == "AA":
        return "OH" if linked and "o" in letters and "ar" not in word else "AA"
    if base == "EH":
        if linked and _TRAP_BEFORE_R.match(word):
            return "AE"
        return "EH" if linked and (letters in ("e", "we", "whe") or "err" in word) else "EH:"
    if base in ("IH", "IY"):
        return "IH" if base == "IH" and linked and letters.lstrip("wh") in ("i", "y") else "IA"
    return "AO:" if base == "UH" and not linked else base
