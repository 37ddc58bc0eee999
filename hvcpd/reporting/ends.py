"""The ends of tasks that robots report. A report is repeated until somebody confirms it, and counts once."""

from __future__ import annotations

import math
from collections.abc import Hashable

from hvcpd.language import messages as m

Ended = type[m.Completed] | type[m.Failed]
"""How a task ended."""


class ReportedEnds:
    """Who has reported the end of which task since claiming it. A task is whatever its reader knows it by."""

    def __init__(self, repeated_for_s: float = math.inf) -> None:
        """`repeated_for_s`: what is reported later than this, without a claim before, has ended again."""
        self._repeated_for_s = repeated_for_s
        self._last_s: dict[tuple[str, Ended, Hashable], float] = {}

    def claimed(self, robot: str, task: Hashable) -> None:
        """What is claimed once more is done, or given up, once more."""
        for ended in (m.Completed, m.Failed):
            self._last_s.pop((robot, ended, task), None)

    def is_new(self, robot: str, ended: Ended, task: Hashable, at_s: float = 0.0) -> bool:
        """Whether a report of that end is no repetition; it is noted."""
        before_s = self._last_s.get((robot, ended, task), -math.inf)
        self._last_s[robot, ended, task] = at_s
        return at_s - before_s >= self._repeated_for_s

    def is_done(self, task: Hashable, at_s: float) -> bool:
        """Whether anybody has just reported it as done."""
        done = (last_s for (_, *end), last_s in self._last_s.items() if end == [m.Completed, task])
        return any(at_s - last_s < self._repeated_for_s for last_s in done)
