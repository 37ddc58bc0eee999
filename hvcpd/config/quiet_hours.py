"""Quiet hours: a part of each day, by the computer's local time, in which robots say less and more softly."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from datetime import datetime

from hvcpd.config.loading import between, checked

_HOURS = re.compile(r"([01]?\d|2[0-3]):([0-5]\d) ?[-–] ?([01]?\d|2[0-3]|24(?=:00)):([0-5]\d)")
CLOCK_SET_S = 1_704_067_200.0
"""1 January 2024, s since 1970. A clock that shows an earlier time was never set: it began at 1970, or at the date of
the system's image."""


def _minutes(hours: str) -> tuple[int, int] | None:
    found = _HOURS.fullmatch(hours.strip())
    if found is None:
        return None
    begin_h, begin_min, end_h, end_min = map(int, found.groups())
    return 60 * begin_h + begin_min, 60 * end_h + end_min


def valid_hours(hours: str | None) -> str | None:
    """What is wrong with the hours, or None."""
    if hours is None:
        return None
    minutes = _minutes(hours)
    if minutes is None:
        return f"{hours[:40]!r} is not a part of the day; write for example '22:00-07:00'"
    return "the hours begin and end at the same time; leave them out for none" if minutes[0] == minutes[1] else None


@dataclass(frozen=True)
class QuietSettings:
    """The hours, such as "22:00-07:00", and the level of speech in them relative to the usual one."""

    hours: str | None = field(default=None, metadata=checked(valid_hours))
    level_db: float = field(default=-10.0, metadata=between(-30, 0))

    def holds_at(self, wall_s: float) -> bool:
        """Whether this time, s since 1970, lies in the quiet hours; never if the clock was not set."""
        minutes = _minutes(self.hours) if self.hours is not None else None
        if minutes is None or wall_s < CLOCK_SET_S:
            return False
        at, (begin, end) = datetime.fromtimestamp(wall_s), minutes
        minute = 60 * at.hour + at.minute
        return begin <= minute < end if begin < end else minute >= begin or minute < end
