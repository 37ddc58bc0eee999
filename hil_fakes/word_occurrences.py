"""The occurrences of recurring tasks in a mission at the level of words, and how often each was carried out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from hvcpd.config.tasks import TaskDefinition
from hvcpd.reporting.occurrences import occurrences

BEGIN_S = 1_700_000_000.0
"""When missions begin, s since 1970, where robots have clocks."""


def times(task: TaskDefinition, acts: int) -> int:
    """How often a task was carried out, given the acts of single robots; an incomplete occurrence does not count."""
    return max(acts - task.robots + 1, 0)


def counted(
    tasks: Iterable[TaskDefinition],
    done: Sequence[tuple[float, int, str]],
    length_s: float,
    begin_s: float = BEGIN_S,
) -> dict[tuple[int, float], int]:
    """How often each occurrence (task, s since 1970) was carried out before the next one was due; `done` are the acts:
    when, which task, by whom. The last one of each task counts for nothing: it may still be under way."""
    deeds = [(begin_s + at_s, number, by) for at_s, number, by in done]
    counts: dict[tuple[int, float], int] = {}
    for task in tasks:
        due_s = task.every.last(begin_s) if task.every is not None else None
        found = occurrences([task], deeds, due_s, begin_s + length_s) if due_s is not None else ()
        counts |= {(task.number, each.due_s): times(task, len(each.deeds)) for each in found[:-1]}
    return counts
