"""The ends of tasks that robots report. A report is repeated until somebody confirms it, and counts once."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from hvcpd.language import messages as m

Ended = type[m.Completed] | type[m.Failed]
"""How a task ended."""

SAME_REPORT_S = 600.0
"""What is reported later than this after its last report has ended again."""


def told(utterance: m.Utterance, speaker: str) -> Iterator[tuple[str, m.Statement]]:
    """What a sentence tells, and of whom: the speaker, whoever it speaks for, or whose report it confirms."""
    for part in m.parts(utterance):
        who, statement = speaker, part.statement
        match part:
            case m.Utterance(addressee=m.ToRobot(doer), statement=m.Confirmed(complete=True)):
                who = doer
            case m.Utterance(statement=m.Relayed(doer, statement)):
                if isinstance(statement, m.Confirmed):
                    continue  # whose report that was is not passed on
                who = doer
        if statement is not None:
            yield who, statement
        if isinstance(statement, m.Completed) and statement.claim is not None:
            yield who, statement.claim


class ReportedEnds:
    """Who has reported the end of which task since claiming it. `names`: of the tasks, by their numbers."""

    def __init__(self, names: Mapping[int, str]) -> None:
        self._numbers = {name: number for number, name in names.items()}
        self._last_s: dict[tuple[str, Ended, int | None], float] = {}

    def number(self, ref: m.TaskRef) -> int | None:
        """The task's number; None for a name of no task."""
        return ref.number if isinstance(ref, m.TaskByNumber) else self._numbers.get(ref.name)

    def new(self, robot: str, statement: m.Statement, at_s: float) -> list[tuple[Ended, int]]:
        """The ends of tasks that a statement of a robot, or of what `told` tells of it, reports for the first time."""
        match statement:
            case m.Claim():  # what is claimed once more is done, or given up, once more
                for ref in statement.tasks:
                    for ended in (m.Completed, m.Failed):
                        self._last_s.pop((robot, ended, self.number(ref)), None)
                return []
            case m.Completed():
                reported: list[tuple[Ended, int]] = [(m.Completed, ref.number) for ref in statement.tasks]
            case m.Confirmed(complete=True):  # the report may not have been heard; if one was, it may be another's
                heard_of = [ref.number for ref in statement.tasks]
                reported = [(m.Completed, number) for number in heard_of if not self._is_done(number, at_s)]
            case m.Failed(ref):
                reported = [(m.Failed, ref.number)]
            case _:
                return []
        return [(ended, number) for ended, number in reported if self._is_new(robot, ended, number, at_s)]

    def _is_new(self, robot: str, ended: Ended, task: int, at_s: float) -> bool:
        """Whether a report of that end is no repetition; it is noted."""
        before_s = self._last_s.get((robot, ended, task), -math.inf)
        self._last_s[robot, ended, task] = at_s
        return at_s - before_s >= SAME_REPORT_S

    def _is_done(self, task: int, at_s: float) -> bool:
        """Whether anybody has just reported it as done."""
        done = (last_s for (_, *end), last_s in self._last_s.items() if end == [m.Completed, task])
        return any(at_s - last_s < SAME_REPORT_S for last_s in done)
