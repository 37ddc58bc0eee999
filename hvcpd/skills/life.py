"""The life of one call of a skill, whichever runner carries it out; its states are those of VDA 5050's actions. Pure.

Orders go to the client that offers the skill, and its reports come back. Reports that are late, out of turn or of
another call change nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from hvcpd.config.skills import Value


class SkillState(Enum):
    """The state of a call."""

    WAITING = "waits for whoever offers the skill"
    INITIALIZING = "is being made ready"
    RUNNING = "is under way"
    PAUSED = "is held until the robot goes on"
    FINISHED = "is done"
    FAILED = "has failed, or was cancelled"


S = SkillState
OVER = frozenset({S.FINISHED, S.FAILED})

FOLLOWING: dict[SkillState, frozenset[SkillState]] = {
    S.WAITING: frozenset({S.INITIALIZING, S.RUNNING, S.PAUSED, S.FINISHED, S.FAILED}),
    S.INITIALIZING: frozenset({S.RUNNING, S.PAUSED, S.FINISHED, S.FAILED}),
    S.RUNNING: frozenset({S.RUNNING, S.PAUSED, S.FINISHED, S.FAILED}),
    S.PAUSED: frozenset({S.RUNNING, S.FINISHED, S.FAILED}),
    S.FINISHED: frozenset(),
    S.FAILED: frozenset(),
}
"""The states that may come next. From RUNNING to RUNNING: it reports progress."""

TOO_LONG = "it took too long"
CANCELLED = "it was cancelled"
NOBODY = "nobody offers it any more"
MAX_RESULTS = 12
"""Of one call."""


@dataclass(frozen=True)
class Call:
    """A call of a skill. `number` is unique among this robot's calls; `limit_s` is its time limit."""

    number: int
    task: int
    skill: str
    arguments: tuple[tuple[str, Value], ...]
    limit_s: float


@dataclass(frozen=True)
class Begin:
    """Carry it out."""

    call: Call


@dataclass(frozen=True)
class Cancel:
    """Leave it, safe, at once."""

    number: int


@dataclass(frozen=True)
class Pause:
    """Hold it, safe, until Resume."""

    number: int


@dataclass(frozen=True)
class Resume:
    """Continue it."""

    number: int


Order = Begin | Cancel | Pause | Resume


@dataclass(frozen=True)
class Report:
    """A report about a call: `share` of 1 done, if known; a text; results by name."""

    number: int
    state: SkillState
    share: float | None = None
    text: str = ""
    results: tuple[tuple[str, Value], ...] = ()


class OngoingCall:
    """One call under way. `take` reports about it, then read `state`; `is_late` needs the time."""

    def __init__(self, call: Call, now: float) -> None:
        self.call = call
        self.state = SkillState.WAITING
        self.last = Report(call.number, self.state)
        self._until_s = now + call.limit_s

    @property
    def is_over(self) -> bool:
        """Whether the call has ended."""
        return self.state in OVER

    def is_late(self, now: float) -> bool:
        """Whether its time limit has passed at `now` (s)."""
        return now >= self._until_s

    def take(self, report: Report) -> bool:
        """Apply a report; return whether it changes anything."""
        if report.number != self.call.number or report.state not in FOLLOWING[self.state]:
            return False
        self.state, self.last = report.state, report
        return True
