"""Tasks for two robots in a team that follows orders, and what else two and a third may agree on."""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import replace

import pytest

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import WordPlan
from hvcpd.config.tasks import TaskDefinition
from hvcpd.coordination.actions import Role, Say
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.knowledge import Current, Report
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, Watched, next_sentence, plants

NAMES = ("Rob", "Bot", "Max")


def pairs(n: int, n_pairs: int) -> tuple[TaskDefinition, ...]:
    """So many tasks, the last of them for two robots."""
    return tuple(replace(task, robots=1 + (task.number > n - n_pairs)) for task in plants(n))


@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(4))
def test_who_gives_orders_sends_two_to_one_task_until_all_are_done(seed: int, loss: float) -> None:
    """Each waited alone at another task, gave it up, and was never sent there again."""
    plan = WordPlan((*NAMES, "Zoe"), pairs(6, 4), seed, Conditions(loss), coordinator="Zoe")
    mission = Watched(plan)
    result = mission.run()
    assert (result.lost, result.duplicates, result.agreed) == (0, 0, True)
    mission.check_each_begins_with_others()


@pytest.mark.parametrize("seed", range(1, 5))
def test_a_read_back_that_the_person_never_confirms_ends_although_a_robot_joins(seed: int) -> None:
    """Each of the other robot's confirmations began the count of repetitions again: they repeated both for ever."""
    mission = Mission(("Rob", "Bot"), pairs(2, 1), ("Anna",), seed=seed)
    mission.hear(4.0 + seed, "Hi Bot, I am Anna, complete task two")
    result = mission.run()
    assert (result.lost, result.duplicates, result.agreed) == (0, 0, True)
    assert Counter(mission.written())["Hi Anna, I am Bot, I will complete task two"] <= 4


def ordered(state: State, *team: str) -> Coordination:
    """Kim, whom Max has ordered to do a task for two, which these robots have."""
    kim = Coordination(Role("Kim", "plant", roster=("Kim", "Lou", "Max", "Rob")), pairs(2, 1), random.Random(1))
    for name in team:
        kim.board.claim(2, name, 250.0)
    kim.knowledge.state, kim.knowledge.current.task, kim.knowledge.current.partner = state, 2, "Max"
    return kim


def test_a_confirmation_of_the_order_that_comes_late_does_not_begin_the_task() -> None:
    kim = ordered(State.ANNOUNCING, "Kim")
    kim.heard(m.Utterance("Max", m.ToRobot("Kim"), None, m.Confirmed()), 10.0)
    assert kim.state is State.ANNOUNCING


def test_who_waits_at_the_place_leaves_it_to_another_that_its_partner_begins_with() -> None:
    """It began alone when both had reported: to it the report was its partner's."""
    kim = ordered(State.CHECKING, "Rob", "Kim")
    lou = m.Utterance("Lou", m.ToAll(), None, m.Working(m.TaskByNumber(2)))
    with_lou = m.Utterance("Rob", m.ToRobot("Lou"), None, m.Confirmed(m.TaskByNumber(2)))
    kim.heard(with_lou, 10.0)
    assert kim.state is State.CHECKING, "the name may be misheard: Lou has not said that it is there"
    kim.heard(lou, 20.0)
    kim.heard(with_lou, 30.0)
    assert kim.state is State.READY

    kim = ordered(State.CHECKING, "Rob", "Kim")
    kim.heard(m.Utterance("Lou", m.ToRobot("Rob"), None, m.Confirmed(m.TaskByNumber(2))), 20.0)
    assert kim.state is State.CHECKING
    kim.heard(with_lou, 30.0)
    assert kim.state is State.READY, "Lou and Rob have told each other; all three did it"

    kim = ordered(State.CHECKING, "Rob", "Kim")
    kim.knowledge.current.agreed = frozenset({"Rob"})
    kim.heard(lou, 20.0)
    kim.heard(with_lou, 30.0)
    assert kim.state is State.CHECKING, "Rob has told it that it begins with it"


def test_who_gives_orders_does_not_take_the_task_itself_that_it_has_just_ordered() -> None:
    """Then the task had room for only one more, and that one was never sent."""
    zoe = Coordination(Role("Zoe", "plant", coordinator=True, volunteer=False), pairs(2, 1), random.Random(1))
    zoe.knowledge.state, zoe.knowledge.current.task, zoe.knowledge.current.partner = State.ORDERED, 2, "Max"
    zoe.heard(m.Utterance("Kim", m.ToTeam("plant"), None, m.Claim(m.TaskByNumber(2))), 10.0)
    assert zoe.board[2].team == {"Kim"}


def test_a_failure_is_confirmed_without_the_number_which_would_mean_to_do_it_together() -> None:
    """Whoever had missed the failure took the two for a pair, and was too busy to be sent there."""
    failed = m.Failed(m.TaskByNumber(2))
    kim = ordered(State.READY, "Max")
    kim.heard(m.Utterance("Max", m.ToAll(), None, failed), 10.0)
    assert next_sentence(kim)[0] == m.Utterance("Kim", m.ToRobot("Max"), None, m.Confirmed())

    kim = ordered(State.REPORTED)
    kim.knowledge.current = Current()
    kim.knowledge.report = Report((2,), failed=True, said=True)
    kim.heard(m.Utterance("Max", m.ToRobot("Kim"), None, m.Confirmed()), 40.0)
    assert kim.state is State.READY


def test_who_waits_at_the_place_counts_the_parts_of_others() -> None:
    """When its partner reported, it began alone: it had told that one that it begins, but another one had, too."""
    kim = ordered(State.CHECKING, "Rob", "Kim")
    kim.knowledge.current.promised = frozenset({"Rob"})
    for at_s, name in ((10.0, "Lou"), (20.0, "Rob")):
        assert kim.state is State.CHECKING
        kim.heard(m.Utterance(name, m.ToAll(), None, m.Completed(m.TaskByNumber(2))), at_s)
    assert kim.state is State.READY
    assert kim.board[2].known_done


def test_a_part_that_was_reported_before_the_robot_set_out_does_not_count() -> None:
    """It had been misheard, and the robot left the task to its partner, which did it alone."""
    kim = ordered(State.READ_BACK, "Rob", "Kim")
    kim.board[2].parts_before = frozenset({"Lou"})
    kim.heard(m.Utterance("Max", m.ToRobot("Kim"), None, m.Confirmed()), 10.0)
    assert kim.state is State.GOING
    kim.knowledge.state, kim.knowledge.current.promised = State.CHECKING, frozenset({"Rob"})
    kim.heard(m.Utterance("Rob", m.ToAll(), None, m.Completed(m.TaskByNumber(2))), 40.0)
    assert kim.state is State.ACTING


def test_who_waits_at_the_place_is_told_that_the_task_is_done() -> None:
    """It did not listen there, and two did it once more."""
    kim = ordered(State.CHECKING, "Rob", "Kim")
    kim.heard(m.Utterance("Lou", m.ToRobot("Kim"), None, m.Confirmed(m.TaskByNumber(2), complete=True)), 10.0)
    assert kim.state is State.READY
    assert kim.board.hearsay() == (2,), "it may have misheard"


def test_who_did_a_part_knows_by_a_word_to_another_that_the_other_part_is_done() -> None:
    """It took it for hearsay, heard that the task was left, and did it with a third."""
    kim = ordered(State.READY, "Rob", "Kim")
    kim.knowledge.current = Current()
    kim.board.complete_part(2, "Kim", 250.0)
    kim.heard(m.Utterance("Rob", m.ToRobot("Lou"), None, m.Confirmed(m.TaskByNumber(2), complete=True)), 10.0)
    assert kim.board[2].known_done


@pytest.mark.parametrize("state", [State.ACTING, State.CHECKING])
def test_who_is_at_work_with_others_does_not_read_its_order_back(state: State) -> None:
    """To a partner that meant that it begins again or, where it waited, that it asks to begin (seed 164)."""
    kim = ordered(state, "Rob", "Kim")
    kim.knowledge.current.claimed_s = 5.0
    kim.heard(m.Utterance("Max", m.ToRobot("Kim"), None, m.Order(m.TaskByNumber(2))), 10.0)
    assert next_sentence(kim)[0] == m.Utterance("Kim", m.ToRobot("Max"), None, m.Busy())


def test_nobody_passes_on_that_another_one_did_a_part() -> None:
    """One misheard a number, and told all; then one of the two who had agreed left, and its part was never done
    (seeds 24 and 110)."""
    kim = ordered(State.READY, "Rob", "Lou")
    kim.knowledge.current = Current()
    kim.heard(m.Utterance("Max", m.ToAll(), None, m.Completed(m.TaskByNumber(2))), 10.0)
    kim.heard(m.Utterance("Rob", m.ToAll(), None, m.Working(m.TaskByNumber(2))), 60.0)
    while kim.next_deadline() < 90.0:
        kim.tick(at_s := kim.next_deadline())
        said = [action.utterance.statement for action in kim.actions(at_s) if isinstance(action, Say)]
        assert not any(isinstance(each, m.Relayed) for each in said)


def test_who_only_follows_orders_asks_at_last_what_is_left() -> None:
    """It had missed that the last task was done, and never learned it (seeds 25 and 129)."""
    role = Role("Kim", "plant", roster=("Kim", "Max"), volunteer=False)
    kim = Coordination(role, pairs(1, 1), random.Random(1))
    kim.knowledge.state, kim.knowledge.timer_s, kim.knowledge.waiting.giver = State.READY, 10.0, "Max"
    kim.board[1].failed_by = frozenset({"Max"})  # as if nobody were free to do it with Kim
    kim.heard(m.Utterance("Max", m.ToRobot("Rob"), None, m.Confirmed()), 10.0)
    assert next_sentence(kim)[0].statement == m.WhatLeft()


def test_who_knows_only_by_hearsay_that_all_is_done_asks_while_somebody_is_there() -> None:
    """It waited until it would have asked for an order: by then nobody was heard any more, and it never asked."""
    kim = ordered(State.READY, "Max", "Rob")
    kim.knowledge.current = Current()
    kim.board.complete(1, "Rob")
    kim.knowledge.timer_s = 900.0
    kim.heard(m.Utterance("Lou", m.ToRobot("Kim"), None, m.Confirmed(m.TaskByNumber(2), complete=True)), 40.0)
    assert kim.board[2].hearsay
    assert next_sentence(kim)[0] == m.Utterance("Kim", m.ToAll(), None, m.WhatLeft())
    assert kim.knowledge.floor.began_s < 100.0


def test_who_gives_orders_and_has_nobody_to_ask_whether_all_is_done_calls_for_robots() -> None:
    """It knew so only by hearsay, and slept for ever."""
    zoe = Coordination(Role("Zoe", "plant", coordinator=True, volunteer=False), plants(1), random.Random(1))
    zoe.heard(m.Utterance("Max", m.ToTeam("plant")), 10.0)
    zoe.board.complete(1, "Max", hearsay=True)
    zoe.knowledge.state, now = State.READY, 10.0 + zoe.knowledge.timing.absent_s + 1.0
    zoe.knowledge.arm(now, 0.0)
    assert next_sentence(zoe)[0] == m.Utterance("Zoe", m.ToAll(), None, m.WhoHere())
