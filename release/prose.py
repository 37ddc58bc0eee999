"""Keeps pages and code in plain English: `python -m release.prose`, a part of `make lint`.

It looks for phrases that read translated, for terms that have another name in docs/glossary.md, for comments that
continue the one above, and for pages whose sentences are long on average. docs/reference has the commands' help and
the settings' comments, so they are checked, too.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
INSTEAD = {
    "all the same": "anyway, still, or nothing",
    "in the midst of": "in the middle of, during",
    "amid": "in, during",
    "anew": "again, from scratch",
    r"as ever\b": "as always",
    "beforehand": "in advance",
    "ever more rarely": "less and less often",
    "for want of": "because there is no",
    r"mend(?:s|ed|ing)?": "fix",
    "not at hand": "missing, or: we had no",
    "over a restart": "after a restart; survives a restart",
    r"by who (?!is )": "by people who, by a robot that",
    r"from who (?!is )": "from people who, from a robot that",
    r"some (?=\d)": "about",
    "so that who": "so that a robot that, so that people who",
    "stand over": "override",
    "stands over": "overrides",
    "thrice": "three times",
    r"to who (?!is )": "to people who, to a robot that",
    "befall": "happen to, or name the fault",
    "beyond measure": "very",
    "by so much": "by this much",
    "every so much": "how often",
    r"for who (?!in )": "for people who, for a robot that",
    "however near it is": "even at close range",
    "in the place of": "instead of",
    "is had": "has, with its owner as the subject",
    "takes it that": "assumes that",
    "within so long": "within this time",
    "in so far as": "as far as",
    "so much water": "this much, a limited amount",
    "is of use": "is useful, helps",
    "by oneself": "yourself",
    "the one of its name": "the voice that belongs to its name",
    "work place": "workplace, or leave it out",
    "recogniz": "recognis-, as elsewhere",
    "whitelist": "allow list",
    "sanity check": "check",
    "please note": "nothing: say it",
    "in order to": "to",
    "utilise": "use",
    "utilize": "use",
    "voice assistant": "robot",
    "bots": "robots",
}
"""A phrase in lower case, as a regular expression, and what to write instead."""
FREE_RELATIVE = re.compile(
    r"^(?![|#])(?:.*[.;:] |- |\*\*)?(Who|who) (?:has|hears|does|knows|missed|misses|says|gives|follows|stays|lost|"
    r"is|was|cannot|wants|needs|begins|speaks|waits|answers|leaves|drives|claims|confirms|objects)\b(?!.*\?)"
)
"""A sentence of a page whose subject has no noun: "Who hears it halts". Tables, headings and questions may have one."""
INSTEAD_IN_CODE = {
    r'^ *"""So (many|much|long) ': "what the number is: number of, most, least, longest",
    r'^ *"""\.\.\.': "a docstring that stands alone",
    r"^ *# \.\.\. ": "a comment that stands alone",
}
"""As INSTEAD, regular expressions for lines of Python."""
CODE = ("hvcpd", "hil_fakes", "benchmarks", "release", "examples")
"""Folders whose Python is checked by INSTEAD, too; this file has all that is wrong."""
MOST_WORDS = 30.0
"""A sentence, on average over a page: beyond it readers lose the thread."""
_NO_PROSE = re.compile(r"^```[\s\S]*?^```|^ {4}.*$|^\|.*$|^#.*$|<!--.*?-->|\]\([^)]*\)", re.M)
_END = re.compile(r"[.!?](?=[\s)”\"]|$)|\n\n|\n[-*] |\n\d+\. ")


def pages() -> list[Path]:
    """README and its like, and all of docs/; the changelog is history."""
    return sorted(path for path in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")) if path.name != "CHANGELOG.md")


def sources() -> list[Path]:
    """All Python files of CODE but this one."""
    return sorted(path for folder in CODE for path in (ROOT / folder).rglob("*.py") if path != Path(__file__))


def code_faults(text: str) -> Iterator[tuple[int, str]]:
    """As `faults`, of a Python file."""
    for number, line in enumerate(text.splitlines(), 1):
        for phrase, instead in INSTEAD.items():
            if " " in phrase and _found(phrase, line):  # a single word may be a name
                yield number, f"“{_plain(phrase)}”: write {instead}"
        for pattern, instead in INSTEAD_IN_CODE.items():
            if re.search(pattern, line):
                yield number, f"“{line.strip()[:20]}…”: write {instead}"


def _plain(phrase: str) -> str:
    return phrase.split("(?")[0].strip()


def _found(phrase: str, line: str) -> bool:
    start = re.match(r"[a-z]*", phrase)
    assert start is not None
    return start[0] in line.lower() and re.search(rf"\b{phrase}", line, re.I) is not None


def faults(text: str) -> Iterator[tuple[int, str]]:
    """Line numbers and what is wrong there; line 1 for the page as a whole."""
    for number, line in enumerate(text.splitlines(), 1):
        for phrase, instead in INSTEAD.items():
            if _found(phrase, line):
                yield number, f"“{_plain(phrase)}”: write {instead}"
        if found := FREE_RELATIVE.search(line):
            yield number, f"“{found[1]} …” as a subject: write “a robot that …”, “people who …”"
    if (mean := words_a_sentence(text)) > MOST_WORDS:
        yield 1, f"sentences have {mean:.0f} words on average; at most {MOST_WORDS:.0f} can be read with ease"


def words_a_sentence(text: str) -> float:
    """Mean over the prose of a page; tables, code and headings do not count. 0 for a page without prose."""
    counts = [len(part.split()) for part in _END.split(_NO_PROSE.sub(" ", text))]
    sentences = [count for count in counts if count > 1]
    return sum(sentences) / len(sentences) if sentences else 0.0


def main() -> int:
    """Print all faults; 1 if there are any."""
    checked = [(path, faults) for path in pages()] + [(path, code_faults) for path in sources()]
    found = [
        f"{path.relative_to(ROOT)}:{number}: {what}"
        for path, check in checked
        for number, what in check(path.read_text(encoding="utf-8"))
    ]
    sys.stdout.writelines(f"{line}\n" for line in found)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
