"""Who asks how far a robot is gets an answer by which both can measure it."""

from __future__ import annotations

import pytest

from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

QUESTION = "Hi Rob, I am Anna, how far are you"


def idle(seed: int = 1) -> Mission:
    """Rob does nothing of its own accord."""
    return Mission(("Rob",), plants(1), ("Anna",), seed=seed, coordinator="Nobody")


def test_a_robot_that_stands_answers_at_once_and_tells_the_interval_when_it_has_measured_it() -> None:
    mission = idle()
    mission.hear(40.0, QUESTION)
    rob = mission.robots["Rob"]
    for at_s, ticks in ((50.0, 607), (60.0, None)):
        mission.air.run_until(at_s)
        rob.timed("Anna", ticks, mission.air.now)
        mission.go_on(at_s + 10.0)
    assert mission.written(40.0, without=("Anna",)) == [
        "Hi Anna, I am Rob, I will measure it",
        "Hi Anna, I am Rob, I measure zero six zero seven",
        "Hi Anna, I am Rob, I cannot measure it",
    ]


def test_a_robot_that_drives_does_not_measure() -> None:
    mission = Mission(("Rob",), plants(3), ("Anna",), seed=1)
    mission.until("Rob", State.GOING, 0.25, 100.0)
    mission.hear(began_s := mission.air.now + 0.5, QUESTION)
    mission.air.run_until(began_s + 8.0)
    assert "Hi Anna, I am Rob, I cannot measure it" in mission.written(began_s, without=("Anna",))


@pytest.mark.parametrize("text", ["Hi Bot, I am Anna, how far are you", "Hi all, I am Anna, how far are you"])
def test_a_question_to_others_or_to_many_is_not_answered(text: str) -> None:
    mission = Mission(("Rob", "Bot"), plants(1), ("Anna",), seed=1, coordinator="Nobody")
    mission.hear(60.0, text)
    mission.air.run_until(80.0)
    assert not [u for _, _, u in mission.said if isinstance(u.statement, m.Measuring) and u.speaker == "Rob"]


def test_the_owner_may_have_it_asked_but_may_not_have_intervals_said() -> None:
    rob = idle().robots["Rob"]
    to = m.ToRobot("Bot")
    assert rob.say(m.Utterance("Rob", to, None, m.HowFarAway()), 20.0) is None
    assert rob.say(m.Utterance("Rob", to, None, m.Measured(1, 2)), 20.0) is not None
