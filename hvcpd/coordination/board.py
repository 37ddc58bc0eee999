"""The task board as one robot knows it: changed only by what it does and what it hears."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from copy import copy

from hvcpd.config.tasks import TaskDefinition
from hvcpd.coordination.entry import CLAIMED, DONE, OPEN, Entry, new_entry, spoken_name
from hvcpd.language.messages import TaskByName, TaskRef


class Board:
    """All tasks by number. `changed` collects the numbers of entries that changed since it was last emptied."""

    def __init__(
        self, tasks: Iterable[TaskDefinition], remembered: Mapping[int, tuple[str, str | None]], lease_end_s: float
    ) -> None:
        self._entries: dict[int, Entry] = {}
        for task in tasks:
            self._entries[task.number] = new = new_entry(task)
            new.state, new.owner = remembered.get(task.number, (new.state, None))
            new.was_open = task.number in remembered and new.state == OPEN
            new.done_by, new.lease_end_s = new.owner if new.state == DONE else None, lease_end_s
            new.skipped = new.skipped and new.state == DONE and new.owner is None
        self.changed: list[int] = []

    def __getitem__(self, number: int) -> Entry:
        return self._entries[number]

    def owner_of_claim(self, number: int) -> str | None:
        """The robot that has the task; None if nobody has, or it is done."""
        return self[number].owner if self[number].state == CLAIMED else None

    def find(self, ref: TaskRef) -> Entry | None:
        """The entry that a spoken reference means; None if this robot has no such task."""
        if not isinstance(ref, TaskByName):
            entry = self._entries.get(ref.number)
            return entry if entry is not None and not entry.gone else None
        return next((entry for entry in self.entries() if spoken_name(entry.definition) == ref.name), None)

    def known(self, refs: Iterable[TaskRef]) -> list[Entry]:
        """The entries that spoken references mean, without tasks that this robot does not have."""
        return [entry for ref in refs if (entry := self.find(ref)) is not None]

    def entries(self) -> tuple[Entry, ...]:
        return tuple(entry for entry in self._entries.values() if not entry.gone)

    @property
    def recurs(self) -> bool:
        """Whether any task is due again after it is done."""
        return any(entry.definition.every is not None for entry in self._entries.values())

    @property
    def shares(self) -> bool:
        """Whether any task takes several robots."""
        return any(entry.is_shared for entry in self._entries.values())

    @property
    def all_done(self) -> bool:
        """Every task is known to be done; hearsay is not enough."""
        return all(entry.known_done for entry in self._entries.values())

    def hearsay(self) -> tuple[int, ...]:
        """The numbers of the tasks that may be done: heard once, concluded, or missing from another robot's list."""
        return tuple(number for number, entry in self._entries.items() if entry.state == DONE and entry.hearsay)

    def not_done(self) -> tuple[int, ...]:
        """The numbers of all tasks that are open or claimed."""
        return tuple(number for number, entry in self._entries.items() if entry.state != DONE)

    def free_for(self, robot: str, now: float, unable: frozenset[int] = frozenset()) -> tuple[TaskDefinition, ...]:
        """The tasks that a robot may claim: its own claims, or else open ones, or else those with a lapsed lease; none
        that it gave up or is `unable` to do.

        No task can begin before its predecessors. A task that already belongs to the robot, as after a restart, comes
        first; one whose lease has lapsed comes last, because its owner may have done it and only wait for a turn to say
        so.
        """
        able = [e for number, e in self._entries.items() if robot not in e.failed_by and number not in unable]
        live = [e for e in able if e.state != DONE and self.can_begin(e)]
        own = tuple(e.definition for e in live if robot in e.team)
        if own:
            return own
        never_claimed = tuple(e.definition for e in live if e.state == OPEN or e.has_room)
        return never_claimed or tuple(e.definition for e in live if now >= e.lease_end_s)

    def open_for(self, robot: str, unable: frozenset[int] = frozenset()) -> tuple[TaskDefinition, ...]:
        """The tasks that nobody has claimed, and that a robot may claim."""
        able = (e for e in self.entries() if robot not in e.failed_by and e.number not in unable)
        return tuple(e.definition for e in able if e.state == OPEN and self.can_begin(e))

    def can_begin(self, entry: Entry) -> bool:
        """Whether all predecessors of a task are done."""
        return all(n not in self._entries or self[n].state == DONE for n in entry.definition.after)

    def redefine(self, tasks: Iterable[TaskDefinition]) -> None:
        """Use other places, actions and times for the tasks; their numbers and names stay."""
        for task in tasks:
            entry = self._entries[task.number]
            before, entry.definition = entry.definition, task
            if before.on_demand and not task.on_demand and entry.skipped and not entry.is_changed:
                self._set(task.number, OPEN, None)  # nobody has asked for it, and nobody need do so any more
                entry.change, entry.is_due = 0, True
            elif task.on_demand and not before.on_demand and not entry.is_changed:
                self.await_demand(task.number)
            if before.every != task.every:
                entry.change, entry.is_changed = 0, False  # its occurrences have other numbers

    def await_demand(self, number: int) -> None:
        """Nobody has asked for a task that is done only on demand: unless a robot has it, it is left out."""
        entry = self._entries[number]
        if entry.state == OPEN:
            self._set(number, DONE, None)
            entry.change, entry.skipped = 1, True  # as for those that have known it so from the first

    def replace(self, tasks: Iterable[TaskDefinition]) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Use these tasks, and no others. Returns the numbers of those that are gone or have become other tasks, and of
        those that are new.

        A task is the same if its name is: one that was done stays so under another number."""
        new = {task.number: task for task in tasks}
        gone = tuple(e.number for e in self.entries() if _is_another(e.definition, new))
        done = {spoken_name(self[n].definition): copy(self[n]) for n in gone if self[n].state == DONE}
        for number in gone:
            if not self[number].known_done:
                self._set(number, DONE, None)
            self._entries[number].gone = True
        added = tuple(number for number in new if number not in self._entries or self[number].gone)
        for number in added:
            self._entries[number] = done.get(spoken_name(new[number])) or new_entry(new[number])
            self[number].is_due = True  # others that do not know it yet leave it out of their lists
            self.changed.append(number)
        self.redefine(new.values())
        return gone, added

    def claim(self, number: int, owner: str | None, lease_end_s: float, firm: bool = True) -> None:
        """A robot (None: an unknown one) has the task, or shares it with its owner. A task known to be done stays done,
        and a claim known to be firm keeps its longer lease."""
        entry = self._entries[number]
        if entry.known_done or owner in entry.parts:
            return
        if entry.is_shared and owner is not None and entry.team and owner != entry.owner:
            if entry.has_room or owner in entry.helpers:
                entry.helpers[owner] = max(lease_end_s, entry.helpers.get(owner, lease_end_s))
            return
        if entry.state == CLAIMED and entry.owner == owner and entry.firm and not firm:
            lease_end_s, firm = max(lease_end_s, entry.lease_end_s), True
        self._set(number, CLAIMED, owner)
        entry.lease_end_s, entry.firm = lease_end_s, firm

    def restore(self, before: Entry) -> None:
        """Revert a claim that was denied: state, owner and lease as before. A task that was done is now done by hearsay
        only, because the robot that claimed it did not know of it."""
        entry = self._entries[before.number]
        if entry.state == CLAIMED:
            self._set(before.number, before.state, before.owner, hearsay=before.state == DONE)
            entry.lease_end_s = before.lease_end_s

    def release(self, number: int) -> None:
        if self[number].state == CLAIMED:
            self._set(number, OPEN, None)

    def pair(self, number: int, one: str, other: str, lease_end_s: float) -> None:
        """These two are known to do the task together, whichever other robots have claimed it."""
        entry = self._entries[number]
        known = entry.team & {one, other}
        if not known:
            self._set(number, OPEN, None)
        elif entry.owner not in known:
            self._set(number, CLAIMED, min(known))
        for name in (one, other):
            self.claim(number, name, lease_end_s)

    def withdraw(self, number: int, name: str) -> None:
        """A robot does not do the task after all; without its owner it is open."""
        entry = self._entries[number]
        if entry.owner == name:
            self.release(number)
        entry.helpers.pop(name, None)

    def expire(self, now: float, own: Collection[int]) -> None:
        """Of shared tasks, except this robot's `own`: drop the robots that nobody has named until their claims lapsed.
        One of those that are left counts as the owner; without any the task is open."""
        for number, entry in self._entries.items():
            if not entry.is_shared or entry.state != CLAIMED or number in own:
                continue
            team = entry.helpers | {entry.owner: entry.lease_end_s}
            left = {name: end_s for name, end_s in team.items() if name is not None and now < end_s}
            if not left and now >= entry.lease_end_s:
                entry.parts_before |= entry.parts
                self.release(number)
            elif left and len(left) < len(team):
                self._share(number, left, entry.lease_end_s)

    def _share(self, number: int, leases: Mapping[str, float], lease_end_s: float) -> None:
        """These robots, or one that is not known until `lease_end_s`, have a task for several robots from now on."""
        entry = self._entries[number]
        owner = entry.owner if entry.owner in leases else min(leases, default=None)
        self._set(number, CLAIMED, owner)
        entry.helpers = {name: end_s for name, end_s in leases.items() if name != owner}
        entry.lease_end_s, entry.firm = lease_end_s if owner is None else leases[owner], True

    def complete_part(self, number: int, name: str, lease_end_s: float) -> bool:
        """A robot has done its part of the task. Returns whether that was the last part; until then the others keep
        it."""
        entry = self._entries[number]
        parts = entry.parts | {name}
        if len(parts) >= entry.definition.robots:
            self.complete(number, name)
            return True
        self._share(number, dict.fromkeys(entry.team - parts, lease_end_s), lease_end_s)
        entry.parts = parts
        return False

    def complete(self, number: int, owner: str | None, hearsay: bool = False, said_by: str | None = None) -> None:
        """A task known to be done stays done; the first robot that did it stays its owner. One that was left out is no
        longer: the robot that did it had missed that."""
        entry = self._entries[number]
        if entry.skipped and owner is not None:
            self._set(number, DONE, owner)
            entry.skipped = False
        elif not entry.known_done:
            self._set(number, DONE, owner or entry.owner, hearsay)
            entry.said_by = said_by if hearsay else None
            entry.times_said = int(hearsay)

    def change(self, number: int, count: int, skip: bool) -> None:
        """The `count`-th change of the task: it is to be left out, or to be done."""
        entry = self._entries[number]
        if skip:
            self._set(number, DONE, None)
        entry.change, entry.is_changed, entry.skipped = count, True, skip
        self.changed.append(number)

    def reopen(self, number: int) -> None:
        """A report about this task was wrong."""
        self._set(number, OPEN, None)
        self._entries[number].parts_before = frozenset()

    def give_up(self, number: int, owner: str) -> None:
        """The task is free for others again, unless one of them has it by now, but never again for its owner."""
        entry = self._entries[number]
        entry.failed_by |= {owner}
        has_another = entry.state == CLAIMED and entry.owner not in (None, owner)
        if not entry.known_done and not has_another:
            self._set(number, OPEN, None)

    def forgive(self, owner: str, numbers: Iterable[int]) -> None:
        """Let a robot retry tasks that it gave up: the reason is gone."""
        for number in numbers:
            self._entries[number].failed_by -= {owner}

    def _set(self, number: int, state: str, owner: str | None, hearsay: bool = False) -> None:
        entry = self._entries[number]
        if (entry.state, entry.owner) != (state, owner):
            entry.times_heard, entry.helpers = 0, {}
        if state != CLAIMED:
            entry.parts = frozenset()
        if state == DONE:
            entry.parts_before = frozenset()
        if (entry.state, entry.owner, entry.hearsay) != (state, owner, hearsay):
            self.changed.append(number)
        entry.state, entry.owner, entry.hearsay, entry.firm = state, owner, hearsay, False
        entry.said_by = entry.distance_m = None
        entry.skipped = entry.skipped and state == DONE


def _is_another(task: TaskDefinition, new: Mapping[int, TaskDefinition]) -> bool:
    return task.number not in new or spoken_name(new[task.number]) != spoken_name(task)
