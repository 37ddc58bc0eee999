"""Due tasks and their outcome: done, late, not done, or done more than once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from hvcpd.config.tasks import TaskDefinition
from hvcpd.coordination.schedule import SKEW_S

JUST_DUE_S = 1800.0
"""What became due so shortly before the end may still be done: it is not lost."""

Completion = tuple[float, int, str]
"""What was carried out: when (s since 1970), which task, and by whom."""


@dataclass(frozen=True)
class Occurrence:
    """A task, and a time at which it was due, s since 1970; `deeds` are when and by whom it was carried out for it."""

    number: int
    name: str
    due_s: float
    late_s: float | None
    """From when on it is late, s since 1970; None: it cannot be."""
    ended: bool
    """Whether its time is over: the next one has come, or it was due for long."""
    deeds: tuple[tuple[float, str], ...]
    robots: int = 1
    """Number of those who carry it out together."""

    @property
    def became(self) -> str:
        """Outcome."""
        if len(self.deeds) < self.robots:
            return "not done" if self.ended else "to be done"
        if len(self.deeds) > self.robots:
            return "done more than once"
        return "done late" if self.late_s is not None and self.deeds[-1][0] > self.late_s else "done"


def occurrences(
    tasks: Iterable[TaskDefinition], deeds: Sequence[Completion], begin_s: float, end_s: float
) -> tuple[Occurrence, ...]:
    """All that became due from `begin_s` to `end_s` (s since 1970), in the order of time.

    What is done once and for ever was due at the beginning. What is done SKEW_S before it is due counts for that time,
    since clocks differ, unless it was still to be done for the time before.
    """
    found = []
    for task in tasks:
        acts = sorted((at_s, by) for at_s, number, by in deeds if number == task.number)
        for due_s, next_s in _times(task, begin_s, end_s):
            over_s = next_s if next_s is not None else max(end_s, due_s)
            acts = [act for act in acts if act[0] >= due_s - SKEW_S]
            until_s = over_s if next_s is None else over_s - SKEW_S
            n, most = (sum(at_s < limit_s for at_s, _ in acts) for limit_s in (until_s, over_s))
            n = max(n, min(most, task.robots))
            late_s = due_s + task.deadline_s if task.deadline_s is not None else None
            ended = min(over_s, end_s) - due_s >= JUST_DUE_S or (next_s is not None and next_s <= end_s)
            found.append(Occurrence(task.number, task.name, due_s, late_s, ended, tuple(acts[:n]), task.robots))
            acts = acts[n:]
    return tuple(sorted(found, key=lambda each: (each.due_s, each.number)))


def _times(task: TaskDefinition, begin_s: float, end_s: float) -> list[tuple[float, float | None]]:
    """When a task was due, and when it is next; what is done on demand never is."""
    if task.on_demand:
        return []
    if task.every is None:
        return [(begin_s, None)]
    times = []
    due_s = task.every.next(begin_s - 1.0)
    while due_s is not None and due_s < end_s:
        next_s = task.every.next(due_s)
        times.append((due_s, next_s))
        due_s = next_s
    return times
