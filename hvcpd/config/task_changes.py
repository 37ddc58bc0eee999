"""The tasks that commands have added to a task file or removed from it, in a file of the robot's own.

The task file itself stays as people wrote it, with its comments; the daemon's user need not be allowed to write it.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from hvcpd.config.document import Document, Place, parse, read_bytes
from hvcpd.config.loading import describe, structure

HEAD = """\
# What this robot's tasks have besides its task file, and what of that file it leaves out. Written by the commands
# `hvcpctl task add` and `hvcpctl task remove`.
"""


@dataclass(frozen=True)
class Removed:
    """A task of the task file that was removed; a later task with the same number is not affected."""

    number: int
    name: str


@dataclass(frozen=True)
class _Entries:
    removed: tuple[Removed, ...] = ()
    tasks: tuple[Any, ...] = ()


@dataclass(frozen=True)
class TaskChanges:
    """Tasks as a task file has them, each in the document that it stands in, and those of the file to be left out."""

    added: tuple[tuple[Document, int], ...] = ()
    removed: tuple[Removed, ...] = ()

    def with_added(self, task: Mapping[str, Any]) -> TaskChanges:
        """The changes with one more task, which is not validated."""
        source = f"task {task.get('number', '')}".strip()
        document = parse(_dumped({"tasks": [dict(task)]}).encode(), source)
        document.gather(Place(source))
        return replace(self, added=(*self.added, (document, 0)))

    def without(self, number: int, name: str) -> TaskChanges:
        """The changes without this task, wherever it comes from."""
        added = tuple(each for each in self.added if _identity(*each) != (number, name))
        is_files = len(added) == len(self.added)
        return replace(self, added=added, removed=(*self.removed, Removed(number, name)) if is_files else self.removed)

    def applied_to(self, document: Document) -> Document:
        """A task file's document with these changes. Tasks that the file has by now are not added a second time."""
        tasks = document.value.get("tasks") if isinstance(document.value, dict) else None
        if not isinstance(tasks, list) or not (self.added or self.removed):
            return document
        left_out = [(each.number, each.name) for each in self.removed]
        kept = [(document, n) for n in range(len(tasks)) if _identity(document, n) not in left_out]
        there = [_identity(*each) for each in kept]
        return document.with_list("tasks", [*kept, *(each for each in self.added if _identity(*each) not in there)])

    def text(self) -> bytes:
        """As the file has them."""
        removed = [vars(each) for each in self.removed]
        tasks = [document.value["tasks"][index] for document, index in self.added]
        return (HEAD + _dumped({"removed": removed, "tasks": tasks})).encode()


def read_changes(path: Path) -> TaskChanges:
    """The changes in the file `path`; none if there is no such file. Raises ConfigError with every fault of it."""
    if not os.access(path, os.F_OK):  # also where this user may not look
        return TaskChanges()
    document = parse(read_bytes(path), str(path))
    entries = structure(document, _Entries)
    return TaskChanges(tuple((document, index) for index in range(len(entries.tasks))), entries.removed)


def _identity(document: Document, index: int) -> tuple[Any, Any]:
    """A task's number and name, right or wrong."""
    task = document.value["tasks"][index]
    return (task.get("number"), task.get("name")) if isinstance(task, dict) else (None, describe(task))


def _dumped(value: object) -> str:
    return str(yaml.safe_dump(value, allow_unicode=True, sort_keys=False, width=110))
