"""When a task is due again: "6 h", or a rule of iCalendar (RFC 5545, RRULE) in local time, "FREQ=DAILY;BYHOUR=8".

All robots that read the same text come to the same times, whenever they were switched on.
"""

from __future__ import annotations

import re
from array import array
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dateutil.rrule import rrule

BEGIN = datetime(2024, 1, 1)
"""A Monday, from which intervals of weeks, days and hours are counted."""
SHIFT = timedelta(hours=2)
"""More than local time is put forward or back; what is then due at a time that comes twice is due at the first."""
LEAST_S = 600.0
"""A team needs some minutes to share its tasks out, to do them, and to hear of it."""
GAPS = 60
"""Number of occurrences among which the shortest interval is sought."""

_UNITS = {"min": 60.0, "h": 3600.0, "d": 86400.0, "w": 604800.0}
_INTERVAL = re.compile(r"([0-9]{1,4}) ?(min|h|d|w)")
_PART = re.compile(r"(?:^|;)([A-Z]+)=([^;]*)")
_FORM = re.compile(r"[A-Z]+=[^;=\s]+(?:;[A-Z]+=[^;=\s]+)*")
_NUMBER = re.compile(r"[+-]?[0-9]+")
_BOUNDS = {
    "INTERVAL": (1, 9999),
    "BYMONTH": (1, 12),
    "BYWEEKNO": (-53, 53),
    "BYYEARDAY": (-366, 366),
    "BYMONTHDAY": (-31, 31),
    "BYHOUR": (0, 23),
    "BYMINUTE": (0, 59),
    "BYSECOND": (0, 59),
    "BYSETPOS": (-366, 366),
}
"""Of the numbers of each part (RFC 5545, 3.3.10); what also counts from the end is never 0. With others dateutil leaves
the part out, seeks for many seconds, or fails with an error of its own."""
_END_FORM = re.compile(r"[0-9]{8}(T[0-9]{6})?")
_LAST_DAY = re.compile(r"(UNTIL=[0-9]{8})(?![0-9T])")
"""A day as an end, which belongs to the rule (RFC 5545, 3.3.10); dateutil ends it at that day's midnight."""
_END = "20640101T000000"
"""No time is sought after it, 40 years after BEGIN: a rule that is never due would be sought up to the year 9999, for
seconds."""
FREQUENCIES = ("HOURLY", "DAILY", "WEEKLY", "MONTHLY", "YEARLY")
"""Of rules that can be used; what is given no hour is due at that of BEGIN, midnight."""


@dataclass(frozen=True)
class Recurrence:
    """A recurrence rule. Times are seconds since 1970. Raises ValueError for an invalid or too frequent rule."""

    text: str

    def __post_init__(self) -> None:
        if self.shortest_s < LEAST_S:
            raise ValueError("too often")

    def last(self, wall_s: float) -> float | None:
        """The latest time at or before `wall_s` at which it was due; None if it never was."""
        if self._interval_s is not None:
            return wall_s // self._interval_s * self._interval_s
        return next((due_s for due_s in reversed(self._near(wall_s)) if due_s <= wall_s), None)

    def next(self, wall_s: float) -> float | None:
        """The first time after `wall_s` at which it will be due; None if it never will."""
        if self._interval_s is not None:
            return (wall_s // self._interval_s + 1.0) * self._interval_s
        return next((due_s for due_s in self._near(wall_s) if due_s > wall_s), None)

    def number(self, wall_s: float) -> int:
        """How many times it was due until then, since BEGIN or, if it is an interval, since 1970."""
        if self._interval_s is not None:
            return int(wall_s // self._interval_s)
        return self._count(datetime.fromtimestamp(wall_s))

    @cached_property
    def shortest_s(self) -> float:
        """The shortest time between two occurrences."""
        if self._interval_s is not None:
            return self._interval_s
        times = list(self._rule.xafter(BEGIN, count=GAPS, inc=True))
        if not times:
            raise ValueError("it is never due")
        gaps = ((later - earlier).total_seconds() for earlier, later in pairwise(times))
        return min(gaps, default=timedelta(days=1).total_seconds())

    def _near(self, wall_s: float) -> list[float]:
        """When it is due from surely before `wall_s` until surely after it, s since 1970."""
        local = datetime.fromtimestamp(wall_s)
        end = self._count(local + SHIFT) + 1
        begin = max(self._count(local - SHIFT) - 1, 0)
        return [(BEGIN + timedelta(seconds=after_s)).timestamp() for after_s in self._found_s[begin:end]]

    def _count(self, local: datetime) -> int:
        """How many times it was due since BEGIN until then. A rule finds its times one after the other, and those of
        an hourly one are 9,000 a year, so each is sought once; the first one later than `local` is found, too."""
        local_s = (local - BEGIN).total_seconds()
        if not self._found_s or self._found_s[-1] <= local_s:
            for due in self._coming:
                self._found_s.append((due - BEGIN).total_seconds())
                if self._found_s[-1] > local_s:
                    break
        return bisect_right(self._found_s, local_s)

    @cached_property
    def _found_s(self) -> array[float]:
        """The times that were sought so far, s of local time since BEGIN."""
        return array("d")

    @cached_property
    def _coming(self) -> Iterator[datetime]:
        return iter(self._rule)

    @cached_property
    def _interval_s(self) -> float | None:
        return interval_s(self.text)

    @cached_property
    def _rule(self) -> rrule:
        from dateutil.rrule import rrule, rrulestr  # most teams have no rule

        text = self.text.upper().removeprefix("RRULE:")
        parts = dict(_PART.findall(text))
        if not parts.get("FREQ"):
            raise ValueError("neither an interval nor a rule with FREQ=")
        if not _FORM.fullmatch(text):
            raise ValueError("a rule is NAME=VALUE;NAME=VALUE, without spaces")
        _check_end(parts)
        _check_numbers(parts)
        text = _LAST_DAY.sub(r"\1T235959", text)
        rule = rrulestr(text if "UNTIL" in parts else f"{text};UNTIL={_END}", dtstart=BEGIN)
        if not isinstance(rule, rrule) or parts["FREQ"] not in FREQUENCIES:
            raise ValueError("one rule, hourly or rarer")
        return rule


def _check_end(parts: Mapping[str, str]) -> None:
    """Raise ValueError for an end of a rule that would not be where its author means it to be."""
    if "COUNT" in parts:
        raise ValueError(f"COUNT would count from {BEGIN.year}; give UNTIL instead")
    until = parts.get("UNTIL", _END)
    if until.endswith("Z"):
        raise ValueError("UNTIL is in local time; leave out its Z")
    if not _END_FORM.fullmatch(until):  # dateutil would complete it with today's day
        raise ValueError("UNTIL is a day such as 20301231")


def _check_numbers(parts: Mapping[str, str]) -> None:
    """Raise ValueError for a number that its part cannot have."""
    if parts["FREQ"] in ("MONTHLY", "YEARLY"):
        n_days = 5 if parts["FREQ"] == "MONTHLY" or "BYMONTH" in parts else 53
    elif _NUMBER.search(parts.get("BYDAY", "")):  # dateutil takes the first Monday of a day or week for every Monday
        raise ValueError("BYDAY has numbers only in a month or a year")
    else:
        n_days = 0
    for name, (least, most) in {**_BOUNDS, "BYDAY": (-n_days, n_days)}.items():
        numbers = map(int, _NUMBER.findall(parts.get(name, "")))
        if any(not least <= number <= most or number == 0 > least for number in numbers):
            raise ValueError(f"{name} is from {least} to {most}{', not 0' if least < 0 else ''}")


def interval_s(text: str) -> float | None:
    """The length of an interval as it is written, such as "30 min", in s; None if it is none."""
    found = _INTERVAL.fullmatch(text)
    return int(found[1]) * _UNITS[found[2]] if found else None


def valid_recurrence(text: str) -> str | None:
    """What is wrong with a rule, or None."""
    if not text:
        return None
    try:
        Recurrence(text)
    except (ValueError, LookupError, TypeError, OverflowError) as error:
        reason = str(error)[:60] if isinstance(error, ValueError) else "a number in it is too large"
        remedy = f"write for example `6 h`, `1 d` or `FREQ=DAILY;BYHOUR=8`, at most once in {LEAST_S / 60.0:g} min"
        return f"{text[:60]!r} is not a rule for when a task is due ({reason}); {remedy}"
    return None
