"""What a robot has learned of its tasks since its memory was last written, in a file of the runtime folder.

That folder is not on the card, and outlives the daemon: who is killed forgets nothing. It ends with the power.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple
from pathlib import Path

from hvcpd.coordination.actions import SaveChange, SaveDue, SaveTask
from hvcpd.memory.store import YEAR_9999_S

OfTask = SaveTask | SaveDue | SaveChange


class Recent:
    """The newest record of each kind about each task, in the file `path`; it belongs to the memory of that number.

    A task is kept by its name, since the task file may have another number for it when the daemon starts again."""

    def __init__(self, path: Path, memory: int | None) -> None:
        self._path = path
        self._memory = memory
        self._records: dict[tuple[type, str], OfTask] = {}

    def left(self, names: Mapping[int, str]) -> list[OfTask]:
        """The records that an earlier daemon has left there, of the tasks of these names, under their present
        numbers."""
        now = {name: number for number, name in names.items()}
        try:
            found = json.loads(self._path.read_bytes())
            left = found["records"] if found["memory"] == self._memory else []
            records = [_record(now[name], kind, values) for name, kind, *values in left if name in now]
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return []  # other robots can tell most of it
        self._records = {(type(record), names[record.number]): record for record in records}
        return records

    def keep(self, records: Iterable[OfTask], names: Mapping[int, str]) -> None:
        """Save these records, of the tasks of these names, in place of earlier ones. Raises OSError; then none are left
        there, as they would count for newer than what is written elsewhere."""
        self._records |= {(type(record), names[record.number]): record for record in records}
        try:
            self._write()
        except OSError:
            self._path.unlink(missing_ok=True)
            raise

    def _write(self) -> None:
        lines = [[name, kind.__name__, *astuple(record)[1:]] for (kind, name), record in self._records.items()]
        partial = self._path.with_name(f"{self._path.name}.new")
        handle = os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            json.dump({"memory": self._memory, "records": lines}, file)
        partial.replace(self._path)


def _record(number: int, kind: str, values: Sequence[object]) -> OfTask:
    """Raises ValueError if these are not the values of such a record."""
    match kind, *values:
        case "SaveTask", "open" | "claimed" | "done" as state, str() | None as owner:
            return SaveTask(number, state, owner)
        case "SaveDue", int() | float() as due_s if 0 <= due_s < YEAR_9999_S:
            return SaveDue(number, due_s)
        case "SaveChange", int() as count, bool() as skipped if 0 <= count < YEAR_9999_S:  # SQLite has room for it
            return SaveChange(number, count, skipped)
    raise ValueError(kind)
