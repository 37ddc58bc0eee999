"""A call's life: whatever is told of it in whatever order, it ends once, and stays as it ended."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hvcpd.skills.life import FOLLOWING, OVER, Call, OngoingCall, Report, SkillState

CALL = Call(7, 3, "pour", (("litres", 0.5),), 20.0)

reports = st.lists(st.builds(Report, st.sampled_from([6, 7]), st.sampled_from(SkillState)), max_size=12)


@given(reports)
def test_what_is_out_of_turn_or_of_another_call_changes_nothing(told: list[Report]) -> None:
    life = OngoingCall(CALL, 0.0)
    ends = 0
    for report in told:
        before = life.state
        news = life.take(report)
        assert news == (report.number == 7 and report.state in FOLLOWING[before])
        assert life.state is (report.state if news else before)
        ends += news and life.is_over
    assert ends <= 1
    assert life.is_over == (ends == 1) == (life.state in OVER)


def test_its_time_counts_from_its_beginning() -> None:
    life = OngoingCall(CALL, 100.0)
    assert not life.is_late(119.9)
    assert life.is_late(120.0)
