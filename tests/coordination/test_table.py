"""The transition table itself."""

from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.table import TRANSITIONS, State, Trigger


def test_every_effect_is_a_method() -> None:
    for _, effect in TRANSITIONS.values():
        assert callable(getattr(Coordination, effect))


def test_every_state_is_reached_and_left_and_every_trigger_used() -> None:
    assert {to for to, _ in TRANSITIONS.values()} | {State.WAKING} == set(State)
    assert {state for state, _ in TRANSITIONS} == set(State)
    assert {trigger for _, trigger in TRANSITIONS} == set(Trigger)


def test_stop_is_possible_in_every_state_and_only_resume_ends_it() -> None:
    for state in State:
        if state is not State.STOPPED:
            assert TRANSITIONS[state, Trigger.STOP][0] is State.STOPPED
    assert [t for s, t in TRANSITIONS if s is State.STOPPED] == [Trigger.RESUME]
