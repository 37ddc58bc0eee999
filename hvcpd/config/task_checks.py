"""Checks across the tasks of a repository: numbers, names and order."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from graphlib import CycleError, TopologicalSorter

from hvcpd.config.document import KeyPath
from hvcpd.config.loading import Parts, describe
from hvcpd.config.names import valid_alternative, valid_word

SoundsAlike = Callable[[str, str], bool]
"""Whether two names are too near in sound to be told apart by ear."""


def check_after(parts: Parts, numbers: Mapping[int, KeyPath]) -> None:
    """Check that each `after` names an existing task, and that there is no cycle."""
    after: dict[int, tuple[int, ...]] = {}
    for number, path in numbers.items():
        at: KeyPath = (*path[:-1], "after")
        after[number] = parts.get(at, tuple[int, ...]) or ()
        for other in set(after[number]) - numbers.keys():
            parts.fault(at, f"task {number} comes after task {other}, which does not exist; leave {other} out")
    try:
        TopologicalSorter(after).prepare()
    except CycleError as error:
        circle: list[int] = error.args[1][-2::-1]  # each after the next, and the last after the first
        first = circle.index(min(circle))
        way = " after ".join(f"task {each}" for each in (*circle[first:], *circle[: first + 1]))
        parts.fault((*numbers[circle[first]][:-1], "after"), f"{way}: none of them can begin; leave one of them out")


def check_alternatives(parts: Parts) -> None:
    """Check that each alternative consists of spoken words, and stands for one word only."""
    given = parts.plain(("alternatives",))
    if not isinstance(given, dict):
        return
    taken: dict[str, tuple[str, KeyPath]] = {}
    for word, phrases in given.items():
        at: KeyPath = ("alternatives", word)
        if (wrong := valid_word(word)) is not None:
            parts.fault(at, wrong)
        if not isinstance(phrases, list) or not phrases:
            parts.fault(at, f"expected a list of phrases, found {describe(phrases)}; write it as [in the go]")
            continue
        for index, phrase in enumerate(phrases):
            path: KeyPath = (*at, index)
            wrong = valid_alternative(phrase) if isinstance(phrase, str) else f"{describe(phrase)} is not a phrase"
            if wrong is None and phrase in taken:
                other, first = taken[phrase]
                wrong = f"{phrase!r} already counts as {other!r} ({parts.where(first, path)}); leave one of them out"
            if wrong is not None:
                parts.fault(path, wrong)
            else:
                taken[phrase] = (word, path)


def check_names(parts: Parts, names: list[tuple[str, KeyPath]], sounds_alike: SoundsAlike | None) -> None:
    """Check that no two names are the same or sound alike."""
    for later, (name, path) in enumerate(names):
        for other, other_path in names[:later]:
            line = parts.where(other_path, path)
            if name == other:
                parts.fault(path, f"the task name {name!r} is taken in {line} already; choose another")
                break
            if sounds_alike is not None and sounds_alike(other, name):
                parts.fault(path, f"the task name {name!r} sounds like {other!r} in {line}; reword one of them")
                break
