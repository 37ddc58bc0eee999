"""The task board as one robot knows it: changed only by what it does and what it hears."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from hvcpd.config.tasks import TaskDefinition
from hvcpd.language.messages import TaskByName, TaskRef

OPEN, CLAIMED, DONE = "open", "claimed", "done"


@dataclass(frozen=True)
class Entry:
    """One task's state. `lease_end_s` is when a claim lapses; `failed_by` are those who gave the task up."""

    definition: TaskDefinition
    state: str = OPEN
    owner: str | None = None
    lease_end_s: float = 0.0
    failed_by: frozenset[str] = frozenset()


class Board:
    """All tasks by number. `changed` collects the numbers of entries that changed since it was last emptied."""

    def __init__(
        self, tasks: Iterable[TaskDefinition], remembered: Mapping[int, tuple[str, str | None]], lease_end_s: float
    ) -> None:
        self._entries: dict[int, Entry] = {}
        for task in tasks:
            state, owner = remembered.get(task.number, (OPEN, None))
            self._entries[task.number] = Entry(task, state, owner, lease_end_s)
        self._numbers = {" ".join(e.definition.name.lower().split()): n for n, e in self._entries.items()}
        self.changed: list[int] = []

    def __getitem__(self, number: int) -> Entry:
        return self._entries[number]

    def find(self, ref: TaskRef) -> Entry | None:
        """The entry that a spoken reference means; None if this robot has no such task."""
        number = self._numbers.get(ref.name) if isinstance(ref, TaskByName) else ref.number
        return self._entries.get(number) if number is not None else None

    def entries(self) -> tuple[Entry, ...]:
        return tuple(self._entries.values())

    @property
    def all_done(self) -> bool:
        return all(entry.state == DONE for entry in self._entries.values())

    def free_for(self, robot: str, now: float) -> tuple[TaskDefinition, ...]:
        """The tasks that a robot may claim: open or with a lapsed lease, and not given up by it before."""
        return tuple(
            entry.definition
            for entry in self._entries.values()
            if robot not in entry.failed_by
            and (entry.state == OPEN or (entry.state == CLAIMED and now >= entry.lease_end_s))
        )

    def next_lapse(self, now: float) -> float | None:
        """When the next claim lapses, if nobody renews it."""
        ends = [e.lease_end_s for e in self._entries.values() if e.state == CLAIMED and e.lease_end_s > now]
        return min(ends, default=None)

    def claim(self, number: int, owner: str, lease_end_s: float) -> None:
        if self._entries[number].state != DONE:
            self._set(number, state=CLAIMED, owner=owner, lease_end_s=lease_end_s)

    def release(self, number: int) -> None:
        if self._entries[number].state == CLAIMED:
            self._set(number, state=OPEN, owner=None)

    def complete(self, number: int, owner: str) -> None:
        """Done is final, and the first who did it keeps it."""
        if self._entries[number].state != DONE:
            self._set(number, state=DONE, owner=owner)

    def give_up(self, number: int, owner: str) -> None:
        """Free for others again; never again for its owner."""
        entry = self._entries[number]
        if entry.state != DONE:
            self._set(number, state=OPEN, owner=None, failed_by=entry.failed_by | {owner})

    def _set(self, number: int, **changes: object) -> None:
        before = self._entries[number]
        after = replace(before, **changes)  # type: ignore[arg-type]
        self._entries[number] = after
        if (before.state, before.owner) != (after.state, after.owner):
            self.changed.append(number)
