"""The transition table itself."""

from hvcpd.coordination.states import DEPARTING, State, Trigger
from hvcpd.coordination.table import TRANSITIONS


def test_every_state_is_reached_and_left_and_every_trigger_used() -> None:
    assert {to for to, _ in TRANSITIONS.values()} | {State.WAKING} == set(State)
    assert {state for state, _ in TRANSITIONS} == set(State)
    assert {trigger for _, trigger in TRANSITIONS} == set(Trigger)


def test_stop_is_possible_in_every_state_and_only_resume_or_leaving_ends_it() -> None:
    for state in State:
        if state is not State.STOPPED:
            assert TRANSITIONS[state, Trigger.STOP][0] is (state if state in DEPARTING else State.STOPPED)
    assert [t for s, t in TRANSITIONS if s is State.STOPPED] == [Trigger.RESUME, Trigger.LEAVE]


def test_no_task_is_begun_without_a_confirmation_or_the_end_of_all_repetitions() -> None:
    into_work = {t for (s, t), (to, _) in TRANSITIONS.items() if to is State.GOING}
    assert into_work == {Trigger.CONFIRMED, Trigger.GAVE_UP}
    into_acting = {t for (s, t), (to, _) in TRANSITIONS.items() if to is State.ACTING}
    assert into_acting == {Trigger.CONFIRMED, Trigger.GAVE_UP, Trigger.ARRIVED_SURE}
