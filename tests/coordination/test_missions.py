"""Whole missions by the state machine alone, over a channel of words."""

import pytest

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import Outage, WordMission
from hil_fakes.word_plans import any_plan
from hvcpd.coordination import choosing
from hvcpd.coordination.knowledge import Current
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

pytestmark = pytest.mark.slow

NAMES = ("Rob", "Bot", "Max", "Zoe", "Ada", "Kim")


@pytest.mark.parametrize("n_robots", [1, 2, 3, 6])
@pytest.mark.parametrize("seed", range(5))
def test_volunteers_water_every_plant_exactly_once(n_robots: int, seed: int) -> None:
    mission = Mission(NAMES[:n_robots], plants(6), seed=seed)
    assert mission.run().agreed
    assert mission.exactly_once, mission.written()
    owners = [{n: o for n, (_, o) in saved.items()} for saved in mission.saved.values()]
    assert all(view == mission.by for view in owners), "every robot's own copy names who truly did it"


def test_a_robot_alone_stops_asking_whether_others_are_there() -> None:
    mission = Mission(("Rob", "Bot"), plants(6), seed=1, late={"Bot": 1e6}, limit_s=600.0)
    mission.run()
    assert mission.exactly_once
    words = [m.own_words(u.statement) for _, _, u in mission.said]
    assert len(words) <= 5 + 2 * 12, "its first claims take the place of greetings, later ones are said twice"
    assert sum(isinstance(s, m.Claim) for s in words) >= 5


def test_a_team_of_one_waits_for_nobody() -> None:
    """It said its first claim five times, and stood for 77 s before it set off."""
    mission = Mission(("Rob",), plants(6), seed=1)
    mission.run()
    assert mission.exactly_once
    first_s = min(at_s for at_s, _, _ in mission.done)
    claims = [at_s for at_s, _, u in mission.said if isinstance(m.own_words(u.statement), m.Claim) and at_s < first_s]
    assert len(claims) == 2
    assert claims[-1] < 20.0


def test_robots_that_may_be_there_are_asked_five_times_once() -> None:
    """Back from an outage, Bot greeted three times and claimed twice, unheard, and did what was done (seed 722749)."""
    mission = Mission(("Rob", "Bot"), plants(3), seed=1, late={"Bot": 1000.0})
    mission.saved["Rob"] = {1: ("open", None)}
    mission.switch_on("Rob")  # it remembers an earlier life, and greets
    mission.air.run_until(600.0)
    claims = [u for _, _, u in mission.said if isinstance(u.statement, m.Claim)]
    reports = [u.statement for _, _, u in mission.said if isinstance(u.statement, m.Completed)]
    assert sum(u.statement is None for _, _, u in mission.said) == 3
    assert len(claims) == 5
    assert sum(each.next is not None for each in reports) == 2 * mission.plan.timing.claims_alone


def test_who_was_not_heard_for_long_is_asked_as_often_as_others_once() -> None:
    """Robots that rest say nothing for hours; a claim said only twice was lost to them, or the objection to it."""
    mission = Mission(("Rob", "Bot"), plants(2), seed=1)
    mission.run()
    rob, now = mission.robots["Rob"].knowledge, mission.air.now + 1.1 * mission.plan.timing.absent_s
    assert not rob.peers.present(now)
    rob.current.asked_since_s = now
    assert choosing.claims_max(rob) == mission.plan.timing.claims_max
    rob.peers.nobody_answered(now)
    assert choosing.claims_max(rob) == mission.plan.timing.claims_alone


@pytest.mark.parametrize(("voices", "times"), [(0, 6), (1, 7), (4, 10), (20, 18)])
def test_a_claim_is_said_until_nobody_was_heard_for_six_times(voices: int, times: int) -> None:
    """Rob understood none of six objections, and did what was done (seed 800661 of the missions over days); it said its
    claim eighteen times after Bot had vanished."""
    mission = Mission(("Rob", "Bot"), plants(2), seed=1)
    mission.air.run_until(20.0)
    rob = mission.robots["Rob"]
    mission.fail(Outage("Bot", 20.0, None))
    rob.knowledge.state = State.READY
    rob.knowledge.current = Current()
    rob.knowledge.reconsider(20.0)
    mission.said.clear()
    hear_voices(mission, voices)
    assert len(mission.said) == times


def hear_voices(mission: Mission, voices: int) -> None:
    """Until Rob sets off; somebody whom it does not understand speaks after each of so many claims."""
    rob, heard = mission.robots["Rob"], 0
    while rob.state is not State.GOING:
        mission.air.run_until(mission.air.now + 0.25)
        mission.air.refresh()
        said = len(mission.said)
        if heard < min(said, voices) and rob.state is State.PROPOSED:
            heard = said
            rob.channel(True, mission.air.now)
            rob.channel(False, mission.air.now + 0.1)


@pytest.mark.parametrize(("voices", "times"), [(0, 5), (1, 6), (3, 8)])
def test_who_has_not_understood_anybody_says_its_claim_more_often_where_there_are_voices(
    voices: int, times: int
) -> None:
    """Rob understood none of the first objections, and did what Max did (a loss of 49 %)."""
    mission = Mission(("Rob", "Bot"), plants(2), seed=1, late={"Bot": 9000.0})
    hear_voices(mission, voices)
    assert len(mission.said) == times


@pytest.mark.parametrize("n_robots", [2, 4])
@pytest.mark.parametrize("seed", range(5))
def test_a_coordinator_orders_and_is_obeyed(n_robots: int, seed: int) -> None:
    mission = Mission(NAMES[:n_robots], plants(5), seed=seed, coordinator="Bot")
    mission.run()
    assert mission.exactly_once, mission.written()
    assert "Bot" not in mission.by.values()


def _is_greeting(text: str) -> bool:
    return "member" in text or (text.startswith("Hi team plant, I am") and text.count(",") == 1)


def test_an_order_is_read_back_confirmed_carried_out_and_reported() -> None:
    mission = Mission(("Rob", "Bot"), plants(1), seed=3, coordinator="Bot")
    mission.run()
    assert [text for text in mission.written() if not _is_greeting(text)] == [
        "Hi Rob, I am Bot, water the green rose",
        "Hi Bot, I am Rob, I will water the green rose",
        "Hi Rob, I am Bot, confirmed",
        "Hi Bot, I am Rob, task one complete",
        "Hi Rob, I am Bot, confirmed",
    ]


def test_a_claim_is_confirmed_and_the_next_one_made_with_the_report() -> None:
    mission = Mission(("Rob", "Bot"), plants(3), seed=4)
    mission.run()
    text = "\n".join(t for t in mission.written() if not _is_greeting(t))
    assert "I will complete task" in text.splitlines()[0]
    assert "confirmed " in text.splitlines()[1]
    assert " complete, I will complete task " in text


@pytest.mark.parametrize("mode", [None, "Bot"])
def test_without_air_nothing_is_coordinated(mode: str | None) -> None:
    mission = Mission(("Rob", "Bot"), plants(3), seed=1, conditions=Conditions(loss=1.0), coordinator=mode, limit_s=600)
    mission.run()
    for robot in mission.robots.values():
        assert robot.peers.all() == ()
        assert all(entry.owner in (None, robot.role.name) for entry in robot.board.entries())
    assert not mission.exactly_once


@pytest.mark.parametrize("loss", [0.1, 0.3])
@pytest.mark.parametrize("seed", range(5))
def test_lost_sentences_lose_no_task_and_repeat_none(seed: int, loss: float) -> None:
    mission = Mission(NAMES[:3], plants(5), seed=seed, conditions=Conditions(loss, mishearing=0.005))
    mission.run()
    assert mission.exactly_once, mission.written()


@pytest.mark.parametrize("seed", range(5))
def test_in_coordinating_mode_no_task_is_lost_with_a_fifth_of_the_sentences(seed: int) -> None:
    mission = Mission(NAMES[:3], plants(5), seed=seed, conditions=Conditions(0.2), coordinator="Bot")
    assert mission.run().lost == 0


@pytest.mark.parametrize("back_s", [None, 30.0])
@pytest.mark.parametrize("at_s", [10.0, 40.0, 70.0])
def test_a_robot_that_runs_flat_loses_no_task(at_s: float, back_s: float | None) -> None:
    mission = Mission(NAMES[:3], plants(6), seed=7, outages=(Outage("Bot", at_s, back_s),))
    result = mission.run()
    assert result.lost == 0
    assert result.agreed
    assert result.duplicates == 0 or result.off_in_mid_task


@pytest.mark.parametrize("seed", range(4))
def test_a_late_robot_asks_and_takes_part(seed: int) -> None:
    mission = Mission(NAMES[:3], plants(8), seed=seed, late={"Max": 60.0})
    mission.run()
    assert mission.exactly_once, mission.written()
    assert "Max" in mission.by.values()


def test_an_order_for_somebody_else_is_not_obeyed() -> None:
    mission = Mission(("Rob", "Max"), plants(2), ("Bot",), seed=5, coordinator="Nobody")
    mission.hear(40.0, "Hi Max, I am Bot, complete task one")
    mission.air.run_until(70.0)
    assert mission.written(40.0, without=("Bot",)) == ["Hi Bot, I am Max, I will complete task one"] * 3
    assert mission.robots["Rob"].state is State.READY


def test_a_done_task_is_said_to_be_done_when_somebody_claims_it() -> None:
    mission = Mission(("Rob", "Bot"), plants(1), ("Eva",), seed=1)
    mission.run()
    at_s = mission.air.now + 1.0
    mission.hear(at_s, "Hi all, I am Eva, I will complete task one")
    mission.air.run_until(at_s + 15.0)
    assert mission.written(at_s) == [f"Hi all, I am {mission.by[1]}, task one complete"]


def test_nobody_obeys_its_own_echo() -> None:
    mission = Mission(("Rob",), plants(2), ("Bot",), seed=5, coordinator="Nobody")
    mission.tell(60.0, "Bot", m.Utterance("Rob", m.ToRobot("Rob"), None, m.Order(m.TaskByNumber(1))))
    mission.air.run_until(80.0)
    assert mission.robots["Rob"].state is State.READY
    assert mission.written(60.0, without=("Bot",)) == []


@pytest.mark.parametrize("seed", [30000, 30026, 30031, 30068, 30136, 30168])
def test_missions_drawn_from_everything_end(seed: int) -> None:
    """A robot that could do none of what it believed to be left never learned that all was done."""
    mission = WordMission(any_plan(seed))
    result = mission.run()
    assert (result.lost, result.agreed) == (0, True)
    assert result.duplicates == 0 or result.off_in_mid_task
