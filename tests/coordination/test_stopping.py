"""A "stop" that is meant for many is said once more by robots that others may hear, and no more than that."""

from itertools import pairwise

import pytest

from hil_fakes.word_channel import Conditions
from hvcpd.config.tasks import Place
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

STOP = m.Utterance("Anna", m.ToAll(), None, m.Stop())


def row(n: int, apart_m: float = 80.0, seed: int = 4, **plan: object) -> Mission:
    """Robots that stand in a row, each of whom hears and knows its neighbours only, and waits for orders."""
    names = tuple("Rob Max Zoe Kim Ada Leo Bot Ted Ann Sam Eva Joe".split()[:n])
    mission = Mission(names, plants(3), ("Anna",), seed=seed, coordinator="Nobody", earshot_m=100.0, **plan)
    for k, name in enumerate(names):
        mission.bodies[name].place = Place(apart_m * k, 0.0)

    def meet() -> None:
        for a, b in pairwise(names):
            for name, other in ((a, b), (b, a)):
                mission.robots[name].heard(m.Utterance(other, m.ToTeam("plant")), mission.air.now)

    mission.at(60.0, meet)
    mission.air.run_until(90.0)
    return mission


def call(mission: Mission, utterance: m.Utterance = STOP, confidence: float = 1.0, name: str = "Rob") -> float:
    """Only one robot hears it."""
    began_s = mission.air.now
    mission.robots[name].heard(utterance, began_s, confidence)
    mission.air.refresh()
    mission.air.run_until(began_s + 10.0 * len(mission.robots))
    return began_s


def stops(mission: Mission, since_s: float) -> list[str]:
    return [who for at_s, who, u in mission.said if at_s >= since_s and isinstance(u.statement, m.Stop)]


def standing(mission: Mission) -> set[str]:
    return {name for name, robot in mission.robots.items() if robot.state is State.STOPPED}


@pytest.mark.parametrize("n", [2, 3, 12])
def test_stop_goes_along_a_row_in_which_each_hears_its_neighbours_only(n: int) -> None:
    mission = row(n)
    began_s = call(mission)
    assert standing(mission) == set(mission.robots)
    said = stops(mission, began_s)
    assert sorted(said) == sorted(set(said)), "each says it once at most"
    assert mission.plan.names[-1] not in said, "the last one has nobody whom it did not hear halt"


def test_where_all_hear_each_other_nobody_says_it_again() -> None:
    mission = row(3, apart_m=1.0)
    mission.hear(mission.air.now, "All stop", speaker="Anna")
    began_s = mission.air.now + 0.1
    mission.air.run_until(began_s + 40.0)
    assert standing(mission) == set(mission.robots)
    assert stops(mission, began_s) == []


def test_a_word_that_was_only_spotted_and_a_call_to_one_robot_are_not_passed_on() -> None:
    for utterance, confidence in (
        (m.Utterance(None, statement=m.Stop()), 0.0),
        (m.Utterance(None, m.ToRobot("Rob"), None, m.Stop()), 1.0),
    ):
        mission = row(3)
        began_s = call(mission, utterance, confidence)
        assert standing(mission) == {"Rob"}
        assert stops(mission, began_s) == []


def test_what_is_for_a_team_is_passed_on_to_that_team() -> None:
    mission = row(3)
    began_s = call(mission, m.Utterance("Anna", m.ToTeam("plant"), None, m.Stop()))
    assert standing(mission) == set(mission.robots)
    assert {u.addressee for at_s, _, u in mission.said if at_s >= began_s and isinstance(u.statement, m.Stop)} == {
        m.ToTeam("plant")
    }


def test_who_is_released_meanwhile_does_not_say_it_any_more() -> None:
    mission = row(2)
    rob, began_s = mission.robots["Rob"], mission.air.now
    rob.heard(STOP, began_s)
    rob.heard(m.Utterance("Anna", m.ToAll(), None, m.Resume()), began_s + 0.1)
    mission.air.refresh()
    mission.air.run_until(began_s + 30.0)
    assert stops(mission, began_s) == []
    assert standing(mission) == set()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("apart_m", [1.0, 80.0])
def test_twelve_robots_that_miss_much_are_silent_again_soon(apart_m: float, seed: int) -> None:
    mission = row(12, apart_m, seed, conditions=Conditions(loss=0.3))
    began_s = call(mission)
    told = [who for at_s, who, _ in mission.said if at_s >= began_s]
    assert set(stops(mission, began_s)) <= standing(mission)
    assert len(told) <= 36, "each says that it has stopped, and stop, and what collided again"
    began_s = mission.air.now
    mission.air.run_until(began_s + 300.0)
    assert stops(mission, began_s) == []
