"""The next task is claimed while the robot is on its way to one, and nobody stands and waits for a confirmation."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import WordMission, WordPlan
from hil_fakes.word_plans import NAMES
from hvcpd.config.tasks import GoTo, Place, TaskDefinition, Wait
from hvcpd.coordination.actions import Talk
from hvcpd.coordination.states import AT_WORK, State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission

WORK_S = 30.0


def rows(n: int, work_s: float = WORK_S) -> tuple[TaskDefinition, ...]:
    """Two rows of tasks, 8 m apart."""
    places = [Place(-4.0 if i % 2 else 4.0, float(i // 2)) for i in range(n)]
    return tuple(TaskDefinition(i, f"job {i}", p, (GoTo(p), Wait(work_s))) for i, p in enumerate(places, 1))


def standing_s(mission: WordMission, step_s: float = 0.25) -> float:
    """Run a mission; the time for which robots stood although tasks were open, after each had its first."""
    stood_s, began = 0.0, set()
    while not all(robot.board.all_done for robot in mission.robots.values()):
        mission.air.run_until(mission.air.now + step_s)
        for name, robot in mission.robots.items():
            began |= {name} if robot.state in AT_WORK else set()
            stands = robot.state not in AT_WORK and bool(robot.board.open_for(name))
            stood_s += step_s * (stands and name in began)
        assert mission.air.now < 3000.0
    return stood_s


def two(**plan: object) -> Mission:
    return Mission(("Bot", "Rob"), rows(8), nearest_first=True, seed=1, **plan)


def test_nobody_stands_for_long_where_the_air_is_free() -> None:
    mission = two()
    usual_s = standing_s(mission)
    assert mission.exactly_once
    pausing = two(talks=dict.fromkeys(("Bot", "Rob"), Talk.TERSE))  # it claims two tasks at once, and then pauses
    assert usual_s < 0.5 * standing_s(pausing)
    assert usual_s < 15.0


def claimed_ahead(**plan: object) -> tuple[Mission, int, int]:
    """A mission in which Bot, on its way to one task, has just claimed another one; the two."""
    mission = two(**plan)
    bot = mission.robots["Bot"].knowledge
    mission.run_until(lambda: bot.current.ahead is not None and not mission.air.speaking, 0.05, 100.0)
    first, second = bot.my_tasks()
    return mission, first, second


def test_who_was_confirmed_goes_on_without_a_pause() -> None:
    mission, first, second = claimed_ahead()
    bot = mission.robots["Bot"]
    mission.air.run_until(mission.air.now + 8.0)
    assert bot.knowledge.current.ahead_sure
    mission.run_until(lambda: bot.task != first, 0.05)
    assert (bot.state, bot.task) == (State.GOING, second)


def test_an_unconfirmed_claim_is_not_acted_on() -> None:
    mission, first, _ = claimed_ahead()
    mission.air.misses = lambda listener, _: listener == "Bot"
    bot = mission.robots["Bot"]
    mission.run_until(lambda: bot.task != first, 0.25)
    assert not bot.knowledge.current.ahead_sure
    assert bot.state is State.REPORTING
    mission.air.misses = lambda _listener, _utterance: False
    mission.run()
    assert mission.exactly_once


def test_it_is_claimed_again_on_the_way_as_often_as_an_order() -> None:
    mission, first, second = claimed_ahead()
    mission.air.misses = lambda listener, _: listener == "Bot"
    mission.run_until(lambda: mission.robots["Bot"].task != first, 0.25)
    both = m.TaskByNumber(first), m.TaskByNumber(second)
    words = [m.own_words(u.statement) for _, speaker, u in mission.said if speaker == "Bot"]
    assert 2 <= sum(isinstance(s, m.Claim) and s.tasks == both for s in words) <= 3


@pytest.mark.parametrize("said", [m.Negative(), "complete"])
def test_an_objection_to_the_second_leaves_the_first(said: object) -> None:
    mission, first, second = claimed_ahead()
    objection = m.Completed(m.TaskByNumber(second)) if said == "complete" else m.Negative()
    to = m.ToAll() if said == "complete" else m.ToRobot("Bot")
    bot = mission.robots["Bot"]
    bot.heard(m.Utterance("Rob", to, None, objection), mission.air.now)
    assert bot.knowledge.my_tasks() == (first,)
    assert bot.state in AT_WORK
    assert bot.knowledge.board.owner_of_claim(second) != "Bot"


def test_who_is_at_work_on_the_second_keeps_it() -> None:
    mission, first, second = claimed_ahead()
    bot = mission.robots["Bot"]
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.Working(m.TaskByNumber(second))), mission.air.now)
    assert bot.knowledge.my_tasks() == (first,)
    assert bot.knowledge.board.owner_of_claim(second) == "Rob"


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("loss", [0.0, 0.25])
def test_each_is_done_once_where_sentences_are_lost(seed: int, loss: float) -> None:
    plan = WordPlan(NAMES[:3], rows(14), seed, Conditions(loss, 0.005, 0.05), nearest_first=bool(seed % 2))
    mission = WordMission(plan)
    result = mission.run()
    assert (result.lost, result.duplicates) == (0, 0)
    assert result.agreed


def test_a_robot_alone_and_a_team_that_encrypts_claim_nothing_ahead() -> None:
    alone = Mission(("Rob",), rows(3), nearest_first=True, seed=1)
    alone.run()
    words = [m.own_words(u.statement) for _, _, u in alone.said]
    assert not any(isinstance(s, m.Claim) and s.also is not None for s in words)
    mission = two()
    for robot in mission.robots.values():
        role = replace(robot.role, speech=replace(robot.role.speech, encrypted=True))
        robot.reconfigure(0.0, role)
    mission.run()
    words = [m.own_words(u.statement) for _, _, u in mission.said]
    assert not any(isinstance(s, m.Claim) and s.also is not None for s in words)
