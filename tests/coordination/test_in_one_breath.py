"""A confirmation and the confirmer's own claim or report in one sentence; the first claim as an introduction."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.coordination.actions import Role
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from tests.coordination.mission import Mission, next_sentence, plants

NAMES = ("Rob", "Bot", "Max", "Zoe", "Ada", "Kim")
BOOK = Phrasebook(Vocabulary(NAMES, ("plant",), numbers=tuple(range(1, 13))))
TASKS = st.integers(1, 12).map(m.TaskByNumber)
SECOND = st.none() | TASKS
REPORTS = st.builds(m.Completed, TASKS, also=SECOND) | st.builds(m.Completed, TASKS, TASKS, also=SECOND, then=SECOND)
OWN = st.builds(m.Claim, TASKS, SECOND) | REPORTS


@given(st.builds(m.Confirmed, TASKS, st.booleans(), SECOND), OWN)
def test_it_is_understood_as_it_was_said(confirmed: m.Confirmed, own: m.Claim | m.Completed) -> None:
    said = m.Utterance("Rob", m.ToRobot("Bot"), None, m.ConfirmedAnd(confirmed, own))
    assert BOOK.parse(BOOK.render(said)) == said
    to_bot, to_all = m.parts(said)
    assert (to_bot.addressee, to_bot.statement) == (m.ToRobot("Bot"), confirmed)
    assert (to_all.addressee, to_all.statement) == (m.ToAll(), own)


def test_in_a_team_each_claim_confirms_the_one_before() -> None:
    mission = Mission(NAMES, plants(8), seed=3)
    mission.run()
    assert mission.exactly_once
    said = [u.statement for _, _, u in mission.said]
    alone = sum(isinstance(s, m.Claim) for s in said)
    with_confirmation = sum(isinstance(s, m.ConfirmedAnd) for s in said)
    assert with_confirmation > 2 * alone, mission.written()


@pytest.mark.parametrize("seed", range(5))
def test_of_robots_that_know_each_others_names_only_one_greets(seed: int) -> None:
    mission = Mission(NAMES[:4], plants(8), seed=seed)
    mission.run()
    first = [u for _, _, u in mission.said][:6]
    collided = mission.air.collisions  # two that are switched on together may greet at once
    assert sum(u.statement is None for u in first) <= 1 + collided, mission.written()
    assert mission.exactly_once


def test_whoever_finds_no_task_says_its_name_all_the_same() -> None:
    mission = Mission(NAMES[:4], plants(2), seed=1)
    mission.run()
    mission.air.run_until(120.0)
    assert {who for _, who, _ in mission.said} == set(NAMES[:4])


def test_robots_that_do_not_know_each_others_names_greet_one_by_one() -> None:
    mission = Mission(NAMES[:3], plants(3), seed=2, strangers=True)
    mission.run()
    greeted = {who for _, who, u in mission.said if isinstance(u.statement, m.Spelled)}
    assert greeted == set(NAMES[:3])
    assert mission.exactly_once


@pytest.mark.parametrize("seed", range(3))
def test_whoever_was_left_alone_does_not_call_for_long(seed: int) -> None:
    """Somebody was heard since the claim, but has left: nobody is there to answer."""
    mission = Mission(NAMES[:2], plants(3), seed=seed)
    mission.run_until(lambda: mission.robots["Rob"].task is not None, 0.5)
    mission.leave("Rob")
    mission.run()
    told_s = next(at_s for at_s, _, u in mission.said if isinstance(u.statement, m.Leaving))
    claims = [u.statement for at_s, _, u in mission.said if at_s > told_s and isinstance(u.statement, m.Claim)]
    assert all(claims.count(claim) <= 3 for claim in claims), mission.written()


def test_whoever_greeted_and_hears_a_claim_confirms_it_with_its_own() -> None:
    """It waits for no more answers: the claim was one."""
    bot = Coordination(Role("Bot", "plant", roster=("Rob", "Bot")), plants(3), random.Random(1))
    bot.knowledge.state = State.MEETING
    bot.knowledge.arm(10.0, 100.0)
    bot.heard(m.Utterance("Rob", m.ToTeam("plant"), None, m.Claim(m.TaskByNumber(3))), 10.0)
    both = next_sentence(bot)[0].statement
    assert isinstance(both, m.ConfirmedAnd)
    assert both.confirmed == m.Confirmed(m.TaskByNumber(3))
