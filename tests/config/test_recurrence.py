"""When a task is due again, and what is no rule."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from datetime import datetime
from functools import partial
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.config.recurrence import LEAST_S, Recurrence, valid_recurrence

RULES = ("10 min", "6 h", "1d", "2 w", "FREQ=DAILY;BYHOUR=8", "RRULE:FREQ=WEEKLY;BYDAY=MO,TH", "FREQ=HOURLY;INTERVAL=5")


@given(st.sampled_from(RULES), st.floats(1.71e9, 1.9e9))
def test_the_last_and_the_next_time_lie_around_any_moment(text: str, wall_s: float) -> None:
    every = Recurrence(text)
    last_s, next_s = every.last(wall_s), every.next(wall_s)
    assert last_s is not None
    assert next_s is not None
    assert last_s <= wall_s < next_s
    assert every.last(next_s) == next_s
    assert every.next(last_s) == next_s
    assert next_s - last_s >= LEAST_S
    assert every.number(next_s) == every.number(next_s - 1.0) + 1 == every.number(last_s) + 1


def test_a_rule_is_of_local_time() -> None:
    every = Recurrence("FREQ=DAILY;BYHOUR=8,18")
    noon = datetime(2026, 5, 4, 12, 0)
    assert every.last(noon.timestamp()) == datetime(2026, 5, 4, 8, 0).timestamp()
    assert every.next(noon.timestamp()) == datetime(2026, 5, 4, 18, 0).timestamp()
    assert every.shortest_s == 10 * 3600.0


def test_a_rule_without_an_hour_is_due_at_midnight_and_keeps_its_minute() -> None:
    noon = datetime(2026, 5, 4, 12, 0)
    for text, due in (("FREQ=DAILY", datetime(2026, 5, 4)), ("FREQ=DAILY;BYMINUTE=30", datetime(2026, 5, 4, 0, 30))):
        assert Recurrence(text).last(noon.timestamp()) == due.timestamp()


def test_intervals_are_counted_from_midnight() -> None:
    times = [Recurrence("6 h").next(1.76e9 + 3600.0 * k) for k in range(24)]
    assert {(later or 0.0) - (earlier or 0.0) for earlier, later in pairwise(times)} == {0.0, 21600.0}


@pytest.mark.parametrize(
    "text",
    ["5 min", "0 h", "6", "h", "every day", "FREQ=MINUTELY;INTERVAL=30", "FREQ=DAILY;BYHOUR=25", "FREQ=DALY",
     "FREQ=HOURLY;BYMINUTE=0,5", "DTSTART:20200101T000000", "FREQ=DAILY;BYHOUR=x"],
)  # fmt: skip
def test_what_is_no_rule_is_told_with_examples(text: str) -> None:
    told = valid_recurrence(text)
    assert told is not None
    assert "write for example `6 h`" in told
    assert told.count("at most once in 10 min") == 1


def test_only_who_has_a_rule_loads_what_reads_rules() -> None:
    code = "import sys; from hvcpd.config.tasks import Recurrence; Recurrence({!r}); print('dateutil' in sys.modules)"
    loaded = [
        subprocess.run([sys.executable, "-c", code.format(text)], capture_output=True, text=True, check=True).stdout
        for text in ("6 h", "FREQ=DAILY;BYHOUR=8")
    ]
    assert loaded == ["False\n", "True\n"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("FREQ=YEARLY;BYMONTH=2;BYMONTHDAY=30", "it is never due"),
        ("FREQ=HOURLY;BYMONTH=2;BYMONTHDAY=30", "it is never due"),
        ("FREQ=DAILY;COUNT=3", "COUNT would count from 2024; give UNTIL instead"),
        ("FREQ=DAILY;UNTIL=20300101T000000Z", "UNTIL is in local time; leave out its Z"),
        ("FREQ=DAILY;UNTIL=2030", "UNTIL is a day such as 20301231"),
        ("6 hours", "neither an interval nor a rule with FREQ="),
        ("FREQ=DAILY; BYHOUR=8", "a rule is NAME=VALUE;NAME=VALUE, without spaces"),
        ("FREQ=DAILY;", "a rule is NAME=VALUE;NAME=VALUE, without spaces"),
        ("FREQ=HOURLY;BYHOUR=25", "BYHOUR is from 0 to 23"),
        ("FREQ=DAILY;INTERVAL=-1", "INTERVAL is from 1 to 9999"),
        ("FREQ=MONTHLY;BYMONTHDAY=0", "BYMONTHDAY is from -31 to 31, not 0"),
        ("FREQ=MONTHLY;BYDAY=9MO", "BYDAY is from -5 to 5, not 0"),
        ("FREQ=YEARLY;BYMONTH=11;BYDAY=50MO", "BYDAY is from -5 to 5, not 0"),
        ("FREQ=YEARLY;BYDAY=60MO", "BYDAY is from -53 to 53, not 0"),
        ("FREQ=WEEKLY;BYDAY=1MO", "BYDAY has numbers only in a month or a year"),
        ("FREQ=DAILY;BYEASTER=9999999", "a number in it is too large"),
    ],
)
def test_a_rule_that_would_not_be_due_as_meant_is_refused(text: str, reason: str) -> None:
    assert f"({reason})" in (valid_recurrence(text) or "")


@pytest.mark.parametrize(
    ("text", "due"),
    [
        ("FREQ=MONTHLY;BYDAY=2TU", datetime(2026, 5, 12)),
        ("FREQ=YEARLY;BYDAY=-1SU", datetime(2026, 12, 27)),
        ("FREQ=MONTHLY;BYMONTHDAY=-1;BYHOUR=0,23", datetime(2026, 5, 31)),
    ],
)
def test_a_rule_counts_days_in_a_month_or_a_year(text: str, due: datetime) -> None:
    assert Recurrence(text).next(datetime(2026, 5, 4, 12).timestamp()) == due.timestamp()


def test_a_rule_may_be_in_small_letters() -> None:
    noon_s = datetime(2026, 5, 4, 12).timestamp()
    assert Recurrence("freq=daily;byhour=8").next(noon_s) == datetime(2026, 5, 5, 8).timestamp()


@pytest.mark.parametrize("until", ["20260504T060000", "20260504"])
def test_a_rule_with_an_end_is_due_until_then(until: str) -> None:
    every = Recurrence(f"FREQ=DAILY;UNTIL={until};BYHOUR=6")
    assert every.next(datetime(2026, 5, 3, 7).timestamp()) == datetime(2026, 5, 4, 6).timestamp()
    assert every.next(datetime(2026, 5, 4, 7).timestamp()) is None


def calls(function: Callable[[], object]) -> int:
    """How many functions and generators run for it, a measure of time that is always the same."""
    count = 0

    def counted(_: object, event: str, __: object) -> None:
        nonlocal count
        count += event == "call"

    sys.setprofile(counted)
    try:
        function()
    finally:
        sys.setprofile(None)
    return count


def test_the_times_of_a_rule_are_sought_once() -> None:
    """A robot asks for them while it drives and listens; a rule for each ten minutes held it up for seconds."""
    every, noon_s = Recurrence("FREQ=HOURLY;BYMINUTE=0,30"), datetime(2026, 5, 4, 12).timestamp()
    every.last(noon_s)
    for later_s in (0.0, 86400.0):
        for ask in (every.last, every.next, every.number):
            assert calls(partial(ask, noon_s + later_s)) < 500, "not for each of 41,000"


@pytest.mark.parametrize(
    "rule", ["FREQ=DAILY;BYHOUR=2;BYMINUTE=30", "FREQ=HOURLY;BYMINUTE=0,30", "FREQ=DAILY;BYHOUR=8"]
)
@pytest.mark.parametrize(
    ("zone", "month", "day"),
    [
        ("Europe/Berlin", 3, 31),
        ("Europe/Berlin", 10, 27),
        ("America/New_York", 3, 10),
        ("America/New_York", 11, 3),
        ("Australia/Lord_Howe", 4, 7),
        ("Australia/Lord_Howe", 10, 6),
    ],
)
def test_clocks_that_are_put_forward_or_back_make_nothing_due_twice(
    rule: str, zone: str, month: int, day: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next time was one that had passed, and what was done at half past two was opened for it once more."""
    monkeypatch.setenv("TZ", zone)
    time.tzset()
    every = Recurrence(rule)
    midnight_s, before_s = datetime(2024, month, day).timestamp(), 0.0
    for wall_s in range(int(midnight_s), int(midnight_s) + 6 * 3600, 600):
        last_s, next_s = every.last(wall_s), every.next(wall_s)
        assert last_s is not None
        assert next_s is not None
        assert before_s <= last_s <= wall_s < next_s
        before_s = last_s
    monkeypatch.undo()
    time.tzset()
