"""A "stop" that is meant for many is said at once by each who hears it, and once more for who missed it."""

from itertools import pairwise

import pytest

from hil_fakes.word_channel import Conditions
from hvcpd.config.tasks import Place
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

STOP = m.Utterance("Anna", m.ToAll(), None, m.Stop())


def row(n: int, apart_m: float = 80.0, seed: int = 4, earshot_m: float = 100.0, **plan: object) -> Mission:
    """Robots that stand in a row, each of whom hears and knows its neighbours only, and waits for orders."""
    names = tuple("Rob Max Zoe Kim Ada Leo Bot Ted Ann Sam Eva Joe".split()[:n])
    mission = Mission(names, plants(3), ("Anna",), seed=seed, coordinator="Nobody", earshot_m=earshot_m, **plan)
    for k, name in enumerate(names):
        mission.bodies[name].place = Place(apart_m * k, 0.0)

    def meet() -> None:
        for a, b in pairwise(names):
            for name, other in ((a, b), (b, a)):
                mission.robots[name].heard(m.Utterance(other, m.ToTeam("plant")), mission.air.now)

    mission.at(60.0, meet)
    mission.air.run_until(90.0)
    return mission


def call(mission: Mission, utterance: m.Utterance = STOP, name: str = "Rob") -> float:
    """Only one robot hears it."""
    began_s = mission.air.now
    mission.robots[name].heard(utterance, began_s)
    mission.go_on(began_s + 10.0 * len(mission.robots))
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
    assert sorted(stops(mission, began_s)) == sorted([*mission.robots] * 2), "each says it twice"


@pytest.mark.parametrize("earshot_m", [9.0, 13.0])
@pytest.mark.parametrize("name", ["Rob", "Kim"])
def test_six_robots_over_thirty_metres_stand_within_three_and_a_half_seconds(name: str, earshot_m: float) -> None:
    """A voice carries to the next neighbour or the second; the call comes at an end of the row, or within it."""
    mission = row(6, apart_m=6.0, earshot_m=earshot_m)
    began_s = call(mission, m.Utterance(None, statement=m.Stop()), name=name)
    assert standing(mission) == set(mission.robots)
    assert max(mission.halted_s[name] for name in mission.robots) <= began_s + 3.5, (
        "five times from one to the next, where only one heard the call"
    )


def test_where_all_hear_each_other_they_say_it_twice_together_and_not_again() -> None:
    mission = row(3, apart_m=1.0)
    mission.hear(mission.air.now, "All stop", speaker="Anna")
    began_s = mission.air.now + 0.1
    mission.air.run_until(began_s + 40.0)
    assert standing(mission) == set(mission.robots)
    said = [at_s for at_s, _, u in mission.said if at_s >= began_s and isinstance(u.statement, m.Stop)]
    assert len(said) == 6
    assert max(said[:3]) - min(said[:3]) < 0.1
    assert max(said[3:]) - min(said[3:]) < 0.1


def test_who_hears_it_in_mid_sentence_breaks_off_to_say_it() -> None:
    mission = row(2)
    question = m.Utterance("Rob", m.ToAll(), None, m.WhoHere())
    assert mission.robots["Rob"].say(question, mission.air.now) is None
    mission.air.refresh()
    mission.run_until(lambda: mission.air.speaking)
    assert mission.said[-1][1:] == ("Rob", question)
    began_s = call(mission)
    spoke_s = [at_s for at_s, who, u in mission.said if who == "Rob" and isinstance(u.statement, m.Stop)]
    assert spoke_s[0] == pytest.approx(began_s, abs=0.1)


@pytest.mark.parametrize("seed", range(6))
def test_a_stop_for_all_that_the_owner_has_it_say_waits_for_nobody(seed: int) -> None:
    """It waited for its turn in the team's talk: in 1 of 10 cases for half a minute."""
    mission = Mission(("Rob", "Bot", "Max"), plants(6), seed=seed)
    mission.air.run_until(40.0 + 1.7 * seed)
    rob, now = mission.robots["Rob"], mission.air.now
    rob.stop(now)
    while rob.say(m.Utterance("Rob", m.ToAll(), None, m.WhoHere()), now) is None:
        pass
    assert rob.say(m.Utterance(None, None, None, m.Stop()), now) is None
    mission.go_on(now + 1.5)
    assert standing(mission) == set(mission.robots)


@pytest.mark.parametrize(("to", "released", "times"), [(None, False, 2), (None, True, 1), (m.ToRobot("Max"), False, 1)])
def test_a_stop_that_the_owner_has_it_say_is_said_again(to: m.Addressee | None, released: bool, times: int) -> None:
    """Said once, it was a part of the sentence that the robot had broken off for 21 of 24 other robots."""
    mission = row(1)
    rob, now = mission.robots["Rob"], mission.air.now
    if to is None:
        rob.stop(now)
    assert rob.say(m.Utterance(None, to, None, m.Stop()), now) is None
    mission.go_on(now + 0.8)
    if released:
        rob.resume(mission.air.now)
    mission.go_on(now + 10.0)
    assert stops(mission, now) == ["Rob"] * times


@pytest.mark.parametrize("seed", range(4))
def test_a_stop_for_another_robot_does_not_wait_for_the_end_of_the_robots_own_sentence(seed: int) -> None:
    """Between 2 and 6 s, in which the other one drove on."""
    mission = Mission(("Rob", "Bot", "Max"), plants(6), seed=seed)
    rob = mission.robots["Rob"]
    mission.air.run_until(20.0)
    mission.run_until(lambda: rob.knowledge.floor.speaking is not None, 0.05)
    now = mission.air.now
    assert rob.say(m.Utterance(None, m.ToRobot("Bot"), None, m.Stop()), now) is None
    mission.go_on(now + 1.2)
    assert standing(mission) == {"Bot"}
    mission.hear(now + 30.0, "Bot resume")
    mission.run()
    assert mission.exactly_once


def test_a_motion_whose_read_back_is_broken_off_for_a_stop_waits_for_its_confirmation() -> None:
    mission = row(2)
    rob = mission.robots["Rob"]
    mission.hear(mission.air.now, "Hi Rob, I am Anna, turn left")
    mission.run_until(lambda: rob.state is State.READING_BACK and rob.knowledge.floor.speaking is not None, 0.05)
    rob.say(m.Utterance(None, m.ToRobot("Max"), None, m.Stop()), mission.air.now)
    mission.go_on(mission.air.now + 1.0)
    assert mission.performed == []
    mission.hear(mission.air.now + 6.0, "Hi Rob, I am Anna, confirmed")
    mission.air.run_until(mission.air.now + 12.0)
    assert len(mission.performed) == 1


@pytest.mark.parametrize("leaves", [False, True])
def test_a_stop_for_another_robot_is_said_although_the_robot_is_stopped_or_leaves_before(leaves: bool) -> None:
    """It was forgotten with all else that the robot was still to say."""
    mission = row(2)
    rob, now = mission.robots["Rob"], mission.air.now
    assert rob.say(m.Utterance(None, m.ToRobot("Max"), None, m.Stop()), now) is None
    rob.leave(now) if leaves else rob.stop(now)
    mission.go_on(now + 20.0)
    assert stops(mission, now) == ["Rob"]
    assert "Max" in standing(mission)


@pytest.mark.parametrize("asked", [False, True])
def test_who_is_stopped_does_not_repeat_the_claim_that_it_said_before(asked: bool) -> None:
    """Others took it for at work on a task, and did not do it."""
    mission = Mission(("Rob", "Bot"), plants(4), seed=3)
    rob = mission.robots["Rob"]
    mission.until("Rob", State.PROPOSED, 0.05)
    now = mission.air.now
    rob.stop(now)
    mission.go_on(now + 0.3)
    if asked:
        rob.heard(m.Utterance("Bot", m.ToRobot("Rob"), None, m.SayAgain()), mission.air.now)
    else:
        rob.garbled(True, mission.air.now)
    mission.go_on(now + 30.0)
    assert not [u for at_s, who, u in mission.said if at_s > now and who == "Rob" and isinstance(u.statement, m.Claim)]


@pytest.mark.parametrize("before_s", [0.0, 50.0])
def test_who_stands_for_a_minute_says_once_how_to_release_it(before_s: float) -> None:
    mission = row(1)
    began_s = call(mission)
    mission.air.run_until(began_s + before_s)
    if before_s:
        mission.robots["Rob"].resume(mission.air.now)
    mission.go_on(began_s + 300.0)
    told = [at_s - began_s for at_s, _, u in mission.said if u.statement == m.Stopped(waits=True)]
    assert told == ([] if before_s else [pytest.approx(60.0, abs=3.0)])


@pytest.mark.parametrize("n", [2, 3, 6])
def test_robots_that_one_call_has_stopped_say_so_in_turn_and_each_once(n: int) -> None:
    """All began at one moment, and repeated what had collided: of six robots each said it two to five times."""
    mission = Mission(tuple("Rob Bot Max Zoe Ada Leo".split()[:n]), plants(8), ("Anna",), seed=5)
    mission.hear(60.0, "Stop", speaker="Anna")
    mission.air.run_until(260.0)
    told = [(who, u.statement) for at_s, who, u in mission.said if at_s > 60.0 and isinstance(u.statement, m.Stopped)]
    expected = [(name, m.Stopped(waits=waits)) for name in mission.robots for waits in (False, True)]
    assert sorted(told, key=str) == sorted(expected, key=str)


def test_a_call_to_one_robot_is_not_passed_on() -> None:
    mission = row(3)
    began_s = call(mission, m.Utterance(None, m.ToRobot("Rob"), None, m.Stop()))
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
    mission.go_on(began_s + 30.0)
    assert stops(mission, began_s) == []
    assert standing(mission) == set()


@pytest.mark.parametrize("resume_s", [11.0, 12.0])
def test_who_is_released_before_its_turn_no_longer_says_that_it_has_stopped(resume_s: float) -> None:
    """It said so after "resume", and the others took it for stopped: they let go of what it had claimed since."""
    mission = Mission(("Rob", "Bot"), plants(4), seed=1)
    mission.hear(10.0, "Bot stop", speaker="Anna")
    mission.hear(resume_s, "Bot resume", speaker="Anna")
    mission.air.run_until(60.0)
    assert not any(isinstance(u.statement, m.Stopped) for _, _, u in mission.said)


@pytest.mark.parametrize("asked", [False, True])
@pytest.mark.parametrize("after_s", [2.0, 8.0])
def test_who_was_stopped_and_is_released_repeats_nothing_of_that(after_s: float, asked: bool) -> None:
    """Something that was not understood over "stop", or "say again", had a robot say "stop" or "I have stopped" seconds
    later, and the others stopped again."""
    mission = row(1)
    rob, began_s = mission.robots["Rob"], mission.air.now
    rob.heard(STOP, began_s)
    mission.go_on(began_s + after_s)
    if not asked:
        rob.garbled(True, mission.air.now)
    rob.resume(mission.air.now)
    if asked:
        rob.heard(m.Utterance("Anna", m.ToRobot("Rob"), None, m.SayAgain()), mission.air.now)
    mission.go_on(began_s + 30.0)
    assert stops(mission, began_s) == ["Rob"] * 2
    stood = [at_s for at_s, _, u in mission.said if isinstance(u.statement, m.Stopped)]
    assert len(stood) == (after_s > 2.4)


@pytest.mark.parametrize("asked", [False, True])
def test_a_resume_for_its_owner_is_not_said_again_after_a_stop(asked: bool) -> None:
    """Something that was not understood over "all resume", or "say again", had a robot say it again, which released the
    robot that had been stopped since."""
    mission = row(3, apart_m=1.0)
    rob, began_s = mission.robots["Rob"], mission.air.now
    assert rob.say(m.Utterance(None, m.ToAll(), None, m.Resume()), began_s) is None
    mission.go_on(began_s + 4.0)
    if not asked:
        rob.garbled(True, mission.air.now)
    mission.hear(mission.air.now, "Max stop", speaker="Anna")
    mission.go_on(mission.air.now + 4.0)
    if asked:
        rob.heard(m.Utterance("Anna", m.ToRobot("Rob"), None, m.SayAgain()), mission.air.now)
    mission.go_on(mission.air.now + 30.0)
    assert [who for _, who, u in mission.said if isinstance(u.statement, m.Resume)] == ["Rob"]
    assert standing(mission) == {"Max"}


def test_a_stop_that_something_was_said_over_is_not_said_a_third_time() -> None:
    """By then another robot may be released, which it stopped again."""
    mission = row(1)
    rob, began_s = mission.robots["Rob"], mission.air.now
    rob.heard(STOP, began_s)
    mission.go_on(began_s + 2.0)
    rob.garbled(True, mission.air.now)
    mission.go_on(began_s + 30.0)
    assert stops(mission, began_s) == ["Rob"] * 2


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("apart_m", [1.0, 80.0])
def test_twelve_robots_that_miss_much_are_silent_again_soon(apart_m: float, seed: int) -> None:
    mission = row(12, apart_m, seed, conditions=Conditions(loss=0.3))
    began_s = call(mission)
    told = [who for at_s, who, _ in mission.said if at_s >= began_s]
    assert set(stops(mission, began_s)) <= standing(mission)
    assert len(told) <= 72, "each says stop twice, that it has stopped, how it is released, and what collided again"
    began_s = mission.air.now
    mission.air.run_until(began_s + 300.0)
    assert stops(mission, began_s) == []
