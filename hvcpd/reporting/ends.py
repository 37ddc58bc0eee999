"""The ends of tasks that robots report. A report is repeated until somebody confirms it, and counts once."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator

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
    """Who has reported the end of which task since claiming it. A task is whatever its reader knows it by."""

    def __init__(self) -> None:
        self._last_s: dict[tuple[str, Ended, Hashable], float] = {}

    def claimed(self, robot: str, task: Hashable) -> None:
        """What is claimed once more is done, or given up, once more."""
        for ended in (m.Completed, m.Failed):
            self._last_s.pop((robot, ended, task), None)

    def is_new(self, robot: str, ended: Ended, task: Hashable, at_s: float) -> bool:
        """Whether a report of that end is no repetition; it is noted."""
        before_s = self._last_s.get((robot, ended, task), -math.inf)
        self._last_s[robot, ended, task] = at_s
        return at_s - before_s >= SAME_REPORT_S

    def is_done(self, task: Hashable, at_s: float) -> bool:
        """Whether anybody has just reported it as done."""
        done = (last_s for (_, *end), last_s in self._last_s.items() if end == [m.Completed, task])
        return any(at_s - last_s < SAME_REPORT_S for last_s in done)
