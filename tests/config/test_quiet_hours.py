"""Quiet hours: which parts of the day are taken, and when they hold."""

from datetime import datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.config.quiet_hours import CLOCK_SET_S, QuietSettings, valid_hours

MINUTES = st.integers(0, 24 * 60 - 1)


def at(hour: int, minute: int = 0) -> float:
    return datetime(2026, 11, 23, hour, minute).timestamp()


@pytest.mark.parametrize("hours", ["22:00-07:00", "9:30-10:00", "0:00 - 23:59", "13:00–14:00", "22:00-24:00"])
def test_a_part_of_the_day(hours: str) -> None:
    assert valid_hours(hours) is None


@pytest.mark.parametrize(
    "hours", ["", "22-7", "24:00-07:00", "22:00-24:01", "22:00", "22:60-07:00", "10pm-7am", "07:00-7:00"]
)
def test_what_is_no_part_of_the_day_is_told_with_a_remedy(hours: str) -> None:
    assert any(remedy in (valid_hours(hours) or "") for remedy in ("write for example", "leave them out"))


def test_a_night_goes_over_midnight() -> None:
    night = QuietSettings("22:00-07:00")
    assert [night.holds_at(at(*each)) for each in ((21, 59), (22,), (0,), (6, 59), (7,), (12,))] == [
        False,
        True,
        True,
        True,
        False,
        False,
    ]


def test_a_rest_after_lunch_does_not() -> None:
    rest = QuietSettings("13:00-14:30")
    assert [rest.holds_at(at(*each)) for each in ((12, 59), (13,), (14, 29), (14, 30), (1,))] == [
        False,
        True,
        True,
        False,
        False,
    ]


def test_a_whole_day() -> None:
    assert all(QuietSettings("00:00-24:00").holds_at(at(hour, 59)) for hour in range(24))


@given(MINUTES, MINUTES, MINUTES)
def test_hours_and_the_hours_between_them_make_up_the_day(begin: int, end: int, now: int) -> None:
    def text(first: int, last: int) -> str:
        return f"{first // 60:02}:{first % 60:02}-{last // 60:02}:{last % 60:02}"

    wall_s = (datetime(2026, 1, 15) + timedelta(minutes=now)).timestamp()
    if begin != end:
        assert QuietSettings(text(begin, end)).holds_at(wall_s) != QuietSettings(text(end, begin)).holds_at(wall_s)


def test_no_hours_and_a_clock_that_was_never_set_are_not_quiet() -> None:
    assert not QuietSettings().holds_at(at(23))
    assert not QuietSettings("00:00-23:59").holds_at(CLOCK_SET_S - 86_400.0)
