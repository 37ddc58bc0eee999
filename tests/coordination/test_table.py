"""The transition table itself."""

from dataclasses import replace

from hvcpd.coordination import composing
from hvcpd.coordination.states import DEPARTING, State, Trigger
from hvcpd.coordination.table import TRANSITIONS
from tests.coordination.mission import Mission, plants


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
    assert into_work == {Trigger.CONFIRMED, Trigger.GAVE_UP, Trigger.PERFORMED_FIRST}
    assert {s for s, t in TRANSITIONS if t is Trigger.PERFORMED_FIRST} == {State.ACTING}  # both were confirmed
    into_acting = {t for (s, t), (to, _) in TRANSITIONS.items() if to is State.ACTING}
    assert into_acting == {Trigger.CONFIRMED, Trigger.GAVE_UP, Trigger.ARRIVED_SURE}


def test_composing_a_sentence_changes_nothing_that_a_robot_knows() -> None:
    mission = Mission(("Rob", "Bot", "Max"), plants(4), coordinator="Max", seed=3)
    sentences = (composing.claim, composing.report, composing.order, composing.read_back, composing.greeting)
    composed = 0
    while not all(robot.board.all_done for robot in mission.robots.values()):
        mission.air.run_until(mission.air.now + 1.0)
        for robot in mission.robots.values():
            me = robot.knowledge
            before = repr((me.state, me.current, me.report, me.board.entries(), me.peers.all(), me.waiting, me.repair))
            composed += sum(compose(me) is not None for compose in sentences)
            composed += composing.left(me, "Ada") is not None
            now = repr((me.state, me.current, me.report, me.board.entries(), me.peers.all(), me.waiting, me.repair))
            assert now == before
    assert composed > 100


def test_a_claim_in_the_same_breath_as_a_report_goes_by_the_table() -> None:
    mission = Mission(("Rob", "Bot"), tuple(replace(task, place=None) for task in plants(5)), seed=1)
    states: list[State] = []
    while not all(robot.board.all_done for robot in mission.robots.values()):
        mission.air.run_until(mission.air.now + 0.05)
        robots = mission.robots.values()
        states += [r.state for r in robots if r.task is not None and r.knowledge.report.task is not None]
    assert State.CLAIMING in states, "two tasks in one sentence"
    assert State.REPORTING not in states, "no state claims but CLAIMING and those after it"
