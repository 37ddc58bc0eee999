"""Other words for one that is mistaken for another: near in meaning, or the same word with one more before it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

from hvcpd.language.pattern import Words
from hvcpd.language.spelling import WORD_OF

SYNONYMS_PATH = Path(__file__).with_name("synonyms.txt")

BEFORE_DEEDS = (("go", "and"), ("now",), ("always",))
"""Before the first word of a task, which says what is done. They change nothing of it."""
BEFORE_THINGS = ("big", "little", "old", "new", "good", "usual")
"""Before any other word of a task. Which of them is true of the thing its owner knows."""
BEFORE_TEAMS = ("big", "super", "new")
AFTER_NAMES = ("2", "7", "9")


@cache
def _lists() -> tuple[dict[str, tuple[str, ...]], tuple[str, ...]]:
    """The words near in meaning to each word, in the file's order, and the names."""
    near: dict[str, list[str]] = {}
    names: tuple[str, ...] = ()
    for line in SYNONYMS_PATH.read_text(encoding="utf-8").splitlines():
        if line.startswith("names:"):
            names = tuple(line.removeprefix("names:").split())
        elif not line.startswith("#"):
            head, *others = line.split()
            near.setdefault(head, []).extend(others)
            for other in others:
                near.setdefault(other, []).append(head)
    return {word: tuple(dict.fromkeys(others)) for word, others in near.items()}, names


def known_names() -> tuple[str, ...]:
    """Names of people, for robots."""
    return _lists()[1]


def instead_of_deed(word: str) -> Iterator[Words]:
    """For the first word of a task's name."""
    yield from ((other,) for other in _lists()[0].get(word, ()))
    yield from ((*before, word) for before in BEFORE_DEEDS)


def instead_of_thing(word: str) -> Iterator[Words]:
    """For any other word of a task's name."""
    yield from ((other,) for other in _lists()[0].get(word, ()))
    yield from ((before, word) for before in BEFORE_THINGS)


def instead_of_team(word: str) -> Iterator[Words]:
    """For a team's name, which is one word: a letter's word in the radio alphabet, or two words in one."""
    if word in WORD_OF:
        yield (WORD_OF[word],)
    yield from ((other,) for other in _lists()[0].get(word, ()))
    yield from ((before + word,) for before in BEFORE_TEAMS)


def instead_of_name(name: str) -> Iterator[Words]:
    """For a robot's name: the same with a number after it."""
    yield from ((name + digit,) for digit in AFTER_NAMES)
