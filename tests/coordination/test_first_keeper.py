"""Who takes itself for the first keeper of a place that only one robot fits in, and who a place was given to."""

from __future__ import annotations

import pytest

from hvcpd.coordination import right_of_way
from hvcpd.coordination.actions import Say
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.corridor import NAMES, WEST, Corridor, across, heard


@pytest.mark.parametrize("asked", [False, True])
def test_the_first_keeper_does_not_go_in_unasked_once_another_robot_has_asked(asked: bool) -> None:
    """Bot had heard Rob ask, and not that it gave the place on; it drove in after one request that the robot inside had
    missed (seed 760207)."""
    bot = Corridor(NAMES, (), starts=(WEST,) * 3).robots["Bot"]
    for name in ("Max", "Rob"):
        bot.heard(m.Utterance(name, m.ToAll(), None, m.Free()), 5.0)
    if asked:
        bot.heard(m.Utterance("Rob", m.ToAll(), None, m.PlaceWanted("corridor")), 20.0)
    p = bot.knowledge.places[0]
    p.wanted_s = 60.0
    p.was_asked(None, 60.0, 63.0)
    bot.tick(65.0)
    assert p.using is not asked


@pytest.mark.parametrize(("answer", "passages"), [(m.PlaceTaken("corridor"), 0), (m.NotUnderstood(), 1)])
def test_who_takes_itself_for_the_first_keeper_waits_if_a_voice_that_it_did_not_understand_has_answered(
    answer: m.Statement, passages: int
) -> None:
    """Rob answered that it was in there, and missed the next request; both met (seed 8065). But whenever another one
    spoke of other things, Bot waited for half a minute, in vain (seed 10412)."""
    mission = Corridor(("Bot", "Rob"), (across(1),), starts=(WEST, WEST), unable={"Rob": frozenset({1})})
    mission.air.misses = lambda _listener, u: isinstance(u.statement, m.PlaceWanted | m.PlaceTaken)
    mission.robots["Bot"].knowledge.places[0].since_s = -100.0
    mission.run_until(lambda: any(isinstance(u.statement, m.PlaceWanted) for _, _, u in mission.said), 0.25)
    mission.tell(mission.said[-1][0] + 3.7, "Rob", m.Utterance("Rob", m.ToRobot("Bot"), None, answer))
    mission.air.run_until(mission.air.now + 20.0)
    assert mission.traffic.passages == passages


def gives(mission: Corridor, name: str, now: float) -> list[str]:
    """The robots to which it says now that the place is theirs."""
    mission.robots[name].tick(now)
    said = [action.utterance for action in mission.robots[name].actions(now) if isinstance(action, Say)]
    return [
        u.addressee.name for u in said if isinstance(u.statement, m.PlaceGiven) and isinstance(u.addressee, m.ToRobot)
    ]


def test_who_takes_itself_for_the_first_keeper_lets_others_in_first() -> None:
    """Two robots that had missed each other's words drove in together, both "the keeper" (seeds 7707 and 7983)."""
    bot = (mission := Corridor(NAMES, (), starts=(WEST,) * 3)).robots["Bot"]
    p = bot.knowledge.places[0]
    p.since_s, p.wanted_s = -100.0, 40.0
    bot.peers.heard("Rob", 45.0)
    heard(mission, "Bot", "Rob", m.PlaceWanted("corridor"), 50.0)
    assert (p.keeper, p.using) == ("Rob", False)
    assert p.ask_s > 50.0, "it asks again"


def test_who_was_given_the_place_is_told_so_by_whoever_has_heard_it() -> None:
    """Its last keeper missed the requests of the robot that had not heard it (seeds 9081 and 9199)."""
    mission = Corridor(NAMES, (), starts=(WEST,) * 3)
    mission.robots["Max"].knowledge.state = State.READY
    heard(mission, "Max", "Bot", m.PlaceGiven("corridor"), 50.0, to="Rob")
    heard(mission, "Max", "Rob", m.PlaceWanted("corridor"), 60.0)
    assert gives(mission, "Max", 62.0) == ["Rob"]
    assert mission.robots["Max"].knowledge.places[0].lease_end_s == 60.0 + right_of_way.LEASE_S, "it enters only now"


def test_a_place_that_was_just_given_is_asked_of_the_robot_that_may_not_know_it_by_name() -> None:
    """Zoe knew that Bot had the place, and Bot did not; both waited for 90 s (seed 7006)."""
    mission = Corridor(NAMES, (), starts=(WEST,) * 3)
    max_ = mission.robots["Max"]
    p = max_.knowledge.places[0]
    max_.knowledge.state, p.wanted_s, p.held = State.RETURNING, 40.0, True
    heard(mission, "Max", "Rob", m.PlaceGiven("corridor"), 50.0, to="Bot")
    said = []
    for now in range(51, 60):
        max_.tick(float(now))
        said += [action.utterance for action in max_.actions(float(now)) if isinstance(action, Say)]
    assert said == [m.Utterance("Max", m.ToRobot("Bot"), None, m.PlaceWanted("corridor"))]
    bot = mission.robots["Bot"].knowledge.places[0]
    bot.wanted_s = 40.0
    heard(mission, "Bot", "Max", m.PlaceWanted("corridor"), 60.0, to="Bot")
    assert bot.using


def test_a_robot_that_has_given_a_place_on_does_not_enter_when_it_is_asked_for_it_by_name() -> None:
    """Max had missed that Bot gave it the place, and asked Bot; Bot, which wanted it again, drove in, and so did Max
    when another one told it."""
    mission = Corridor(NAMES, (), starts=(WEST,) * 3)
    p = mission.robots["Bot"].knowledge.places[0]
    p.keep("Bot", 0.0)
    heard(mission, "Bot", "Max", m.PlaceWanted("corridor"), 50.0, to="Bot")
    assert gives(mission, "Bot", 51.0) == ["Max"]
    mission.robots["Bot"].spoken(53.0)
    p.wanted_s = 55.0
    heard(mission, "Bot", "Max", m.PlaceWanted("corridor"), 60.0, to="Bot")
    assert not p.using
    assert gives(mission, "Bot", 61.0) == ["Max"]


def test_that_a_place_was_given_is_not_repeated_for_another_one_that_asks() -> None:
    """It had been used by then; the robot that asked waited, and thought that it was in use (seeds 9064 and 9075)."""
    mission = Corridor(NAMES, (), starts=(WEST,) * 3)
    bot = mission.robots["Bot"]
    bot.knowledge.places[0].keep("Bot", 0.0)
    heard(mission, "Bot", "Max", m.PlaceWanted("corridor"), 50.0)
    assert gives(mission, "Bot", 51.0) == ["Max"]
    bot.spoken(53.0)
    heard(mission, "Bot", "Rob", m.PlaceWanted("corridor"), 70.0)
    assert not gives(mission, "Bot", 72.0)


def test_a_request_that_was_said_together_with_another_sentence_was_not_answered_with_silence() -> None:
    """Two robots asked at the same moment, for 3.5 s; neither understood the other one, and both drove in."""
    bot = Corridor(("Bot", "Rob"), (across(1),), starts=(WEST, WEST)).robots["Bot"]
    p = bot.knowledge.places[0]
    p.keep("Bot", 0.0)
    bot.knowledge.state, bot.knowledge.timer_s, p.wanted_s, p.ask_s = State.GOING, 999.0, 40.0, 50.0
    now = 50.0
    while bot.knowledge.floor.speaking is None:
        bot.tick(now)
        now += 0.01
    bot.channel(True, now + 0.1)
    bot.channel(False, now + 3.4)
    bot.spoken(now + 3.5)
    bot.tick(now + 5.1)
    assert not p.using
    assert bot.knowledge.floor.wants(p.topic), "it asks again"
    assert p.answered_s < now, "that was no answer"


def test_a_robot_that_is_not_there_is_not_the_first_keeper_once_all_have_spoken() -> None:
    """Others asked six times each, for one of the team was switched off (seeds 9214 and 9250)."""
    bot = (mission := Corridor(("Ada", *NAMES), (), starts=(WEST,) * 4)).robots["Bot"]
    p = bot.knowledge.places[0]
    p.since_s = 0.0
    for now in (65.0, 75.0):
        for name in ("Max", "Rob"):
            bot.knowledge.acquaintance.introduced = True
            heard(mission, "Bot", name, m.Confirmed(m.TaskByNumber(1)), now, to="Max" if name == "Rob" else "Rob")
    heard(mission, "Bot", "Rob", m.PlaceWanted("corridor"), 80.0)
    assert p.keeper == "Rob", "it was given the place"
