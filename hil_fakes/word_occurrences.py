"""The occurrences of recurring tasks in a mission at the level of words, and how often each was carried out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from hvcpd.config.tasks import TaskDefinition
from hvcpd.coordination.schedule import SKEW_S

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
    when, which task, by whom. The last one of each task counts for nothing: it may still be under way.

    An act within SKEW_S before the next one is due counts for that, unless nobody has done the earlier one."""
    counts: dict[tuple[int, float], int] = {}
    for task in tasks:
        acts_s = sorted(begin_s + at_s for at_s, number, _ in done if number == task.number)
        due_s = task.every.last(begin_s) if task.every is not None else None
        acts_s = [at_s for at_s in acts_s if due_s is not None and at_s >= due_s - SKEW_S]
        while task.every is not None and due_s is not None:
            following_s = task.every.next(due_s)
            if following_s is None or following_s > begin_s + length_s:
                break
            early_s = following_s - SKEW_S
            n = sum(at_s < early_s for at_s in acts_s) or min(sum(at_s < following_s for at_s in acts_s), task.robots)
            counts[task.number, due_s] = times(task, n)
            acts_s, due_s = acts_s[n:], following_s
    return counts
