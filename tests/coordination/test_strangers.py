"""Robots that were told no name but their own."""

import math

import pytest

from hil_fakes.word_channel import Conditions
from hvcpd.coordination.repair import RESPELL_S
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

pytestmark = pytest.mark.slow

NAMES = ("Rob", "Bot", "Max", "Zoe", "Ada", "Kim")


@pytest.mark.parametrize("n_robots", [2, 3, 6])
@pytest.mark.parametrize("seed", range(3))
def test_each_spells_its_name_once_and_all_know_each_other(n_robots: int, seed: int) -> None:
    names = NAMES[:n_robots]
    mission = Mission(names, plants(6), seed=seed, strangers=True)
    assert mission.run().agreed
    assert mission.exactly_once, mission.written()
    if n_robots < 6:  # of six two spelled at once, and met only later those who missed it
        assert all(known == set(names) for known in mission.known.values())
    spelled = [who for _, who, u in mission.said if isinstance(u.statement, m.Spelled)]
    assert set(spelled) == set(names)
    if n_robots == 2:
        assert mission.written()[:2] in (
            ["Hi all, I spell, bravo oscar tango", "Hi team plant, I spell, romeo oscar bravo"],
            ["Hi all, I spell, romeo oscar bravo", "Hi team plant, I spell, bravo oscar tango"],
        )


@pytest.mark.parametrize("seed", range(20))
def test_a_fifth_of_the_sentences_lost_leaves_nobody_unknown_for_long(seed: int) -> None:
    mission = Mission(NAMES[:3], plants(7), seed=seed, strangers=True, conditions=Conditions(0.2))
    result = mission.run()
    assert not math.isinf(result.ended_s)
    assert all(known == set(NAMES[:3]) for known in mission.known.values())
    assert mission.exactly_once, mission.written()


def test_names_are_known_after_a_restart() -> None:
    mission = Mission(NAMES[:2], plants(2), seed=1, strangers=True)
    mission.air.run_until(40.0)
    known = mission.known["Rob"]
    mission.leave("Rob")
    mission.air.run_until(60.0)
    mission.switch_on("Rob")
    mission.run()
    assert known == {"Rob", "Bot"}
    assert mission.exactly_once


def test_those_who_were_told_all_names_never_spell() -> None:
    mission = Mission(NAMES[:3], plants(5), seed=1, conditions=Conditions(0.3))
    mission.run()
    assert not [u for _, _, u in mission.said if isinstance(u.statement, m.Spelled)]


def _two_who_have_met() -> Mission:
    mission = Mission(("Rob", "Bot"), plants(1), seed=3, strangers=True, coordinator="Nobody")
    mission.air.run_until(40.0)
    assert all(robot.state is State.READY for robot in mission.robots.values())
    return mission


def test_who_hears_time_and_again_what_it_cannot_understand_asks_for_names() -> None:
    mission = _two_who_have_met()
    since = mission.air.now

    def garble() -> None:
        mission.robots["Rob"].garbled(False, mission.air.now)
        mission.air.refresh()

    for after_s in (0.0, 5.0, 10.0):
        mission.air.at(since + 1.0 + after_s, garble)
    mission.air.run_until(since + 40.0)  # garbled speech makes everybody back off for long
    assert mission.written(since)[0] == "Hi team plant, I spell, romeo oscar bravo, spell your name"
    assert set(mission.written(since)[1:]) == {"Hi team plant, I spell, bravo oscar tango"}, "Rob never said its name"


def test_who_is_known_to_the_asker_does_not_spell() -> None:
    mission = _two_who_have_met()
    bot, since = mission.robots["Bot"], mission.air.now
    bot.heard(m.Utterance("Rob", m.ToRobot("Bot"), None, m.Free()), since)
    bot.heard(m.Utterance("Rob", m.ToTeam("plant"), None, m.Spelled("rob", ask=True)), since + RESPELL_S)
    mission.go_on(since + 10.0)
    assert mission.written(since, without=("Rob",)) == []
