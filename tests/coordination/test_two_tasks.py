"""Where the air is scarce a robot claims two tasks in a sentence, does them one after the other, and reports both."""

import random
from dataclasses import replace

import pytest

from hvcpd.coordination import choosing
from hvcpd.coordination.actions import Role, Speech
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.entry import DONE, OPEN
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, next_sentence, plants

NAMES = ("Rob", "Bot", "Max", "Zoe")
NEAR = tuple(replace(task, place=None) for task in plants(8))
"""Each takes less time than a round of turns."""
ONE, TWO, THREE, FOUR = map(m.TaskByNumber, (1, 2, 3, 4))


def rob(tasks: int = 8, **role: object) -> Coordination:
    """A robot of a team of two that has introduced itself and is free."""
    robot = Coordination(
        Role("Rob", "plant", roster=NAMES[:2], nearest_first=True, **role),  # type: ignore[arg-type]
        NEAR[:tasks],
        random.Random(1),
    )
    robot.knowledge.state = State.READY
    robot.knowledge.arm(0.0, 0.0)
    return robot


def hear(robot: Coordination, statement: m.Statement, now: float, to: m.Addressee | None = None) -> None:
    robot.heard(m.Utterance("Bot", to or m.ToRobot("Rob"), None, statement), now)


def next_said(robot: Coordination, now: float = 0.0) -> tuple[m.Statement | None, float]:
    said, now = next_sentence(robot, now)
    return said.statement, now


def claimed_two() -> tuple[Coordination, float]:
    """A robot that has just claimed its two nearest tasks."""
    robot = rob()
    said, now = next_said(robot)
    assert said == m.Claim(ONE, TWO)
    return robot, now


@pytest.mark.parametrize("seed", range(4))
def test_a_team_that_waits_for_the_air_claims_and_reports_two_at_once(seed: int) -> None:
    mission = Mission(NAMES, NEAR, seed=seed, nearest_first=True)
    mission.run()
    said = [m.own_words(u.statement) for _, _, u in mission.said]
    assert mission.exactly_once
    assert any(isinstance(s, m.Claim) and s.also for s in said), mission.written()
    assert any(isinstance(s, m.Completed) and s.also for s in said), mission.written()
    assert len(said) < 3 * len(NEAR)


def test_where_the_way_is_longer_than_a_round_of_turns_each_task_is_claimed_for_itself() -> None:
    mission = Mission(NAMES[:2], plants(6), seed=1, nearest_first=True)
    mission.run()
    claimed: set[tuple[str, m.TaskRef]] = set()
    for _, speaker, u in mission.said:
        words = m.own_words(u.statement)
        claim = words if isinstance(words, m.Claim) else words.claim if isinstance(words, m.Completed) else None
        if claim is not None and claim.also is not None:
            assert (speaker, claim.task) in claimed, "the second was claimed on the way to the first"
        claimed |= {(speaker, task) for task in (claim.tasks if claim is not None else ())}


def test_one_task_is_left_for_each_robot_that_has_none() -> None:
    robot = rob(tasks=2)
    assert choosing.tasks_to_claim(robot.knowledge, 0.0) == (1,)
    hear(robot, m.Claim(TWO), 0.0, m.ToTeam("plant"))
    hear(robot, m.Completed(TWO), 30.0, m.ToAll())
    robot.knowledge.board.complete(2, "Bot")
    assert choosing.tasks_to_claim(robot.knowledge, 30.0) == (1,)


def test_a_team_that_encrypts_names_one_task_at_a_time() -> None:
    robot = rob(speech=Speech(sealed=True, encrypted=True))
    assert choosing.tasks_to_claim(robot.knowledge, 0.0) == (1,)


def test_both_must_be_confirmed() -> None:
    robot, now = claimed_two()
    hear(robot, m.Confirmed(ONE), now)
    assert robot.state is State.PROPOSED
    hear(robot, m.Confirmed(ONE, also=TWO), now + 0.1)
    assert robot.state is State.GOING


def test_if_one_of_the_two_is_done_the_other_is_claimed_again() -> None:
    robot, now = claimed_two()
    hear(robot, m.Completed(TWO), now, m.ToAll())
    assert not robot.knowledge.floor.wants("again Bot"), "an objection is asked about in turn"
    asked, now = next_said(robot, now)
    said, _ = next_said(robot, now)
    assert (asked, said) == (m.SayAgain(), m.Claim(ONE))


def test_if_the_first_is_done_the_second_is_claimed_again() -> None:
    robot, now = claimed_two()
    hear(robot, m.Completed(ONE), now, m.ToAll())
    asked, now = next_said(robot, now)
    said, _ = next_said(robot, now)
    assert asked == m.SayAgain()
    assert isinstance(said, m.Claim)
    assert said.task == TWO


def test_a_confirmation_heard_again_on_the_way_takes_no_report_back() -> None:
    """The first task's report waits for the second's: it would be lost, and its task done twice once the lease ends."""
    robot, now = claimed_two()
    hear(robot, m.Confirmed(ONE, also=TWO), now)
    for _ in "to the first", "at the first":
        robot.performed(now + 10.0)
    assert (robot.state, robot.task) == (State.GOING, 2)
    hear(robot, m.Confirmed(ONE, also=TWO), now + 11.0)
    for _ in "to the second", "at the second":
        robot.performed(now + 20.0)
    said, _ = next_said(robot, now + 20.0)
    assert isinstance(said, m.Completed)
    assert said.tasks == (ONE, TWO)


def test_who_fails_at_the_second_tells_that_the_first_is_done() -> None:
    robot, now = claimed_two()
    hear(robot, m.Confirmed(ONE, also=TWO), now)
    for _ in "to the first", "at the first":
        robot.performed(now + 10.0)
    robot.perform_failed(now + 12.0)
    first, now = next_said(robot, now + 12.0)
    second, _ = next_said(robot, now)
    assert {first, second} == {m.Completed(ONE), m.Failed(TWO)}


def test_who_fails_at_the_first_claims_the_second_again_as_soon_as_that_is_confirmed() -> None:
    robot, now = claimed_two()
    hear(robot, m.Confirmed(ONE, also=TWO), now)
    robot.performed(now + 5.0)
    robot.perform_failed(now + 10.0)
    said, now = next_said(robot, now + 10.0)
    assert said == m.Failed(ONE)
    hear(robot, m.Confirmed(ONE), now + 1.0)
    said, _ = next_said(robot, now + 1.0)
    assert said == m.Claim(TWO)


def test_who_failed_before_and_is_stopped_between_two_tasks_tells_that_the_first_is_done() -> None:
    """Told that it failed, the others would do it again."""
    robot, now = claimed_two()
    hear(robot, m.Confirmed(ONE, also=TWO), now)
    for failed, claimed in ((ONE, m.Claim(TWO)), (TWO, m.Claim(THREE, FOUR))):
        robot.perform_failed(now)
        said, now = next_said(robot, now)
        assert said == m.Failed(failed)
        hear(robot, m.Confirmed(failed), now)
        said, now = next_said(robot, now)
        assert said == claimed
        hear(robot, m.Confirmed(claimed.task, also=claimed.also), now)
    for _ in "to the first", "at the first":
        robot.performed(now + 10.0)
    assert robot.task == FOUR.number
    hear(robot, m.Stop(), now := now + 10.0)
    told = []
    for _ in range(3):
        said, now = next_said(robot, now)
        told.append(said)
    assert m.Completed(THREE) in told
    assert m.Failed(THREE) not in told


def test_who_is_stopped_before_it_has_told_why_it_failed_tells_it_then() -> None:
    robot, now = claimed_two()
    hear(robot, m.Confirmed(ONE, also=TWO), now)
    robot.performed(now + 5.0)
    robot.perform_failed(now + 10.0, "the tank is empty")
    hear(robot, m.Stop(), now + 10.1)
    said = []
    while (robot.next_deadline()) < now + 40.0:
        statement, now = next_said(robot, now + 10.1)
        said.append(statement)
    assert m.Failed(ONE, "the tank is empty") in said
    assert robot.state is State.STOPPED


@pytest.mark.parametrize("leaves", [False, True])
@pytest.mark.parametrize("resumes", [False, True])
def test_who_is_stopped_or_switched_off_before_it_could_tell_what_it_has_done_tells_it_all(
    resumes: bool, leaves: bool
) -> None:
    robot, now = claimed_two()
    hear(robot, m.Confirmed(ONE, also=TWO), now)
    for _ in "to the first", "at the first", "to the second", "at the second":
        robot.performed(now + 5.0)
    hear(robot, m.Stop(), now + 5.1)
    if resumes:
        hear(robot, m.Resume(), now + 6.0)
    if leaves:
        robot.leave(now + 7.0)
    else:
        hear(robot, m.Stop(), now + 7.0)
    said, now = [], now + 7.0
    while robot.next_deadline() < now + 10.0:
        statement, now = next_said(robot, now)
        said.append(statement)
    assert {m.Completed(ONE), m.Completed(TWO)} <= set(said)
    assert not leaves or said[-1] == m.Leaving()


def test_a_stop_gives_both_tasks_back() -> None:
    robot, now = claimed_two()
    hear(robot, m.Confirmed(ONE, also=TWO), now)
    hear(robot, m.Stop(), now + 5.0)
    assert robot.state is State.STOPPED
    assert [robot.board.owner_of_claim(number) for number in (1, 2)] == [None, None]


def test_the_second_task_is_defended_on_the_way_to_the_first() -> None:
    robot, now = claimed_two()
    hear(robot, m.Confirmed(ONE, also=TWO), now)
    robot.heard(m.Utterance("Zoe", m.ToTeam("plant"), None, m.Claim(TWO)), now + 2.0)
    said, _ = next_said(robot, now + 2.0)
    assert said == m.Claim(TWO)
    assert robot.knowledge.my_tasks() == (1, 2)


def test_the_second_task_goes_to_who_is_at_work_on_it() -> None:
    robot, now = claimed_two()
    hear(robot, m.Confirmed(ONE, also=TWO), now)
    robot.heard(m.Utterance("Zoe", m.ToAll(), None, m.Working(TWO)), now + 2.0)
    assert robot.knowledge.my_tasks() == (1,)
    for _ in "to the first", "at the first":
        robot.performed(now + 10.0)
    assert robot.state is State.REPORTING


@pytest.mark.parametrize(
    "said",
    [m.Completed(ONE, also=TWO), m.Completed(TWO, also=ONE), m.Confirmed(ONE, complete=True, also=TWO)],
)
def test_a_report_of_two_tells_nothing_of_the_one_that_is_to_be_done_again(said: m.Completed | m.Confirmed) -> None:
    """Only its first task was looked at: the second was taken for done, or the whole report was lost."""
    robot = rob(volunteer=False)
    hear(robot, m.Change(TWO, count=1), 10.0, m.ToAll())
    robot.heard(m.Utterance("Zoe", m.ToAll(), None, m.Claim(ONE)), 20.0)
    to, speaker = (m.ToRobot("Zoe"), "Bot") if isinstance(said, m.Confirmed) else (m.ToAll(), "Zoe")
    robot.heard(m.Utterance(speaker, to, None, said), 50.0)
    assert [robot.board[number].state for number in (1, 2)] == [DONE, OPEN]
    assert next_said(robot, 50.0)[0] == m.Change(TWO, count=1)


def test_that_a_task_is_complete_is_not_confirmed_once_it_is_to_be_done_again() -> None:
    """Whoever pressed "again" just as a robot had reported heard "confirmed one complete" after it."""
    robot = rob(volunteer=False)
    hear(robot, m.Claim(ONE), 10.0, m.ToAll())
    hear(robot, m.Completed(ONE), 20.0, m.ToAll())
    assert robot.knowledge.floor.wants("confirm Bot")
    assert robot.change(1, False, 20.5) is None
    assert next_said(robot, 20.5)[0] == m.Change(ONE, count=1)


@pytest.mark.parametrize(("state", "said"), [(State.CLAIMING, True), (State.REPORTING, False)])
def test_a_confirmation_of_the_report_is_none_of_what_is_still_to_be_said(state: State, said: bool) -> None:
    robot = rob()
    robot.knowledge.state, robot.knowledge.report.tasks, robot.knowledge.report.said = state, (1,), said
    hear(robot, m.Confirmed(ONE, complete=said), 10.0)
    assert robot.state is state
    assert robot.knowledge.report.tasks == (() if said else (1,))


def test_who_has_given_its_task_up_can_be_given_another() -> None:
    robot = rob(coordinator=True)
    hear(robot, m.Free(), 1.0)
    bot = robot.peers.get("Bot")
    assert bot is not None
    bot.assigned = 1
    hear(robot, m.Failed(ONE), 10.0, m.ToAll())
    assert bot.assigned is None


def test_a_list_of_what_is_left_that_another_one_has_told_all_is_not_told_again() -> None:
    robot = rob()
    robot.heard(m.Utterance(None, m.ToAll(), None, m.WhatLeft()), 10.0)
    assert robot.knowledge.floor.wants("left")
    hear(robot, m.Left(ONE, TWO, more=True), 13.0, m.ToAll())
    assert not robot.knowledge.floor.wants("left")


@pytest.mark.parametrize(("state", "tells"), [(State.READY, True), (State.MEETING, False)])
def test_a_newcomer_does_not_say_that_it_does_not_know_a_task(state: State, tells: bool) -> None:
    robot = rob(volunteer=False)
    robot.knowledge.state = state
    hear(robot, m.Claim(m.TaskByNumber(9)), 10.0, m.ToTeam("plant"))
    assert robot.knowledge.floor.wants("confirm Bot") is tells


def test_who_hears_that_two_are_done_does_not_object_for_the_second_as_well() -> None:
    robot = rob(volunteer=False)
    for ref in (ONE, TWO):
        hear(robot, m.Claim(ref), 10.0, m.ToAll())
        hear(robot, m.Completed(ref), 20.0, m.ToAll())
    robot.heard(m.Utterance("Zoe", m.ToAll(), None, m.Claim(TWO)), 100.0)
    assert robot.knowledge.floor.wants("done 2")
    hear(robot, m.Completed(ONE, also=TWO), 103.0, m.ToAll())
    assert not robot.knowledge.floor.wants("done 2")
