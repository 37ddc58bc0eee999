"""Speech that is not understood is asked for again; a name used by two is nobody's."""

import pytest

from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.repair import ASK_AGAIN, UNCLEAR_MAX
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants


def _ordered() -> tuple[Mission, Coordination]:
    """Rob has read an order of Anna's back and listens."""
    mission = Mission(("Rob",), plants(3), ("Anna",), seed=5, coordinator="Nobody")
    mission.hear(40.0, "Hi Rob, I am Anna, complete task one")
    robot = mission.robots["Rob"]
    mission.air.run_until(40.0)
    mission.run_until(lambda: robot.state is State.READ_BACK)
    return mission, robot


def test_say_again_twice_then_slowly_then_it_is_given_up() -> None:
    mission, robot = _ordered()
    said: list[str] = []
    for _ in range(5):
        robot.garbled(False, mission.air.now)
        mission.air.refresh()
        began_s = mission.air.now
        mission.air.run_until(began_s + 3.2)
        said += [t for t in mission.written(began_s - 0.01) if "again" in t or "understand" in t]
    assert said == [
        "Hi Anna, I am Rob, say again",
        "Hi Anna, I am Rob, say again",
        "Hi Anna, I am Rob, say again slowly",
        "Hi Anna, I am Rob, I did not understand",
    ]


def test_who_is_understood_is_not_asked_again() -> None:
    mission, robot = _ordered()
    robot.garbled(False, mission.air.now)
    assert robot.knowledge.floor.wants(ASK_AGAIN)
    robot.heard(m.Utterance("Anna", m.ToRobot("Rob"), None, m.WhatDoing()), mission.air.now + 0.1)
    assert not robot.knowledge.floor.wants(ASK_AGAIN)


def test_a_person_has_the_last_sentence_said_again_and_more_slowly() -> None:
    mission, _ = _ordered()
    mission.slowly.clear()
    began_s = mission.air.now
    mission.hear(began_s + 0.2, "Hi Rob, I am Anna, say again")
    mission.air.run_until(began_s + 7.5)
    mission.hear(mission.air.now, "Hi Rob, I am Anna, say again slowly")
    mission.air.run_until(mission.air.now + 8.0)
    assert mission.written(began_s, without=("Anna",))[:2] == ["Hi Anna, I am Rob, I will complete task one"] * 2
    assert mission.slowly["Rob"][:2] == [False, True]


@pytest.mark.parametrize("asked_after_s", [0.2, 3.0])
def test_who_says_its_sentence_again_waits_for_the_answer_as_long_as_ever(asked_after_s: float) -> None:
    mission, _ = _ordered()
    began_s = mission.air.now
    mission.hear(began_s + asked_after_s, "Hi Rob, I am Anna, say again")
    mission.air.run_until(began_s + 30.0)
    again_s, next_s, last_s = [at_s for at_s, speaker, _ in mission.said if speaker == "Rob" and at_s > began_s][:3]
    assert next_s - again_s >= last_s - next_s


@pytest.mark.parametrize(
    ("texts", "is_held", "answer"),
    [
        (("Rob, complete task one", "Rob, negative"), False, "Hi Anna, I am Rob, I am free"),
        (("Rob, turn left",), False, "Hi Anna, I am Rob, I am free"),
        (("Rob, turn left",), True, "Hi all, I am Rob, I will turn left"),
    ],
)
def test_what_is_no_longer_so_is_not_said_again(texts: tuple[str, ...], is_held: bool, answer: str) -> None:
    """Rob said once more that it will, after "negative", or when it had done so."""
    mission = Mission(("Rob",), plants(1), ("Anna",), seed=5, coordinator="Nobody")
    mission.air.run_until(60.0)
    mission.holds_motion = is_held
    for text in (*texts, "Hi Rob, I am Anna, say again"):
        asked_s = mission.air.now
        mission.hear(asked_s, text, "Anna")
        mission.air.run_until(asked_s + 7.5)
    assert mission.written(asked_s, without=("Anna",)) == [answer]


@pytest.mark.parametrize(
    ("text", "before", "after"),
    [
        ("complete task one", "Hi Anna, I am Rob, I am busy", "Hi Anna, I am Rob, I am free"),
        ("report", *(f"Hi Anna, I am Rob, member of team plant, report, I am {doing}" for doing in ("busy", "free"))),
    ],
)
def test_who_was_busy_says_so_again_only_until_it_is_free(text: str, before: str, after: str) -> None:
    """Rob said once more that it was busy, long after it had turned."""
    mission = Mission(("Rob",), plants(1), ("Anna",), seed=5, coordinator="Nobody")
    mission.air.run_until(60.0)
    mission.holds_motion = True

    def answers(words: str) -> list[str]:
        asked_s = mission.air.now
        mission.hear(asked_s, f"Hi Rob, I am Anna, {words}")
        mission.air.run_until(asked_s + 9.0)
        return mission.written(asked_s, without=("Anna",))

    answers("turn left")
    assert [answers(words) for words in (text, "say again")] == [[before]] * 2
    mission.robots["Rob"].performed(mission.air.now)
    assert answers("say again") == [after]


@pytest.mark.parametrize(
    ("said", "again"),
    [
        ("completing task one", False),
        ("task one complete, I will complete task two", False),
        ("confirmed two, I will complete task one", False),
        ("task one complete", True),
    ],
)
def test_nor_is_what_another_voice_has_drowned(said: str, again: bool) -> None:
    """Rob, which had finished, said once more that it was completing the task."""
    mission = Mission(("Rob", "Bot"), plants(2), ("Anna",), seed=5, coordinator="Nobody")
    mission.air.run_until(60.0)
    rob = mission.robots["Rob"]
    to = "Bot" if said.startswith("confirmed") else "all"
    rob.knowledge.repair.last_said = mission.book.parse_text(f"Hi {to}, I am Rob, {said}")
    rob.garbled(True, 60.0)
    mission.go_on(70.0)
    assert (f"Hi {to}, I am Rob, {said}" in mission.written(60.0)) is again


def test_noise_out_of_the_blue_is_not_answered() -> None:
    mission = Mission(("Rob",), plants(1), seed=5, coordinator="Nobody")
    mission.air.run_until(60.0)
    mission.robots["Rob"].garbled(False, 60.0)
    mission.go_on(90.0)
    assert mission.written(60.0) == []


@pytest.mark.parametrize(("said", "again"), [(m.Free(), True), (m.PlaceWanted("bridge"), False)])
def test_what_was_talked_over_is_said_again_unless_it_is_asked_again_anyway(said: m.Statement, again: bool) -> None:
    mission = Mission(("Rob",), plants(1), seed=5, coordinator="Nobody")
    mission.air.run_until(60.0)
    rob = mission.robots["Rob"]
    rob.knowledge.repair.last_said = m.Utterance("Rob", m.ToAll(), None, said)
    rob.garbled(True, 60.0)
    assert rob.knowledge.floor.wants("again") is again


def test_who_says_its_name_and_is_not_understood_is_told_so() -> None:
    mission = Mission(("Rob",), plants(1), ("Anna",), seed=5, coordinator="Nobody")
    mission.air.run_until(60.0)
    for at_s in (60.0, 68.0, 76.0, 84.0):
        mission.robots["Rob"].garbled(False, at_s, addressed=True)
        mission.go_on(at_s + 8.0)
    assert mission.written(60.0) == ["Hi all, I am Rob, I did not understand"] * UNCLEAR_MAX
    mission.hear(150.0, "Hi Rob, I am Anna, what are you doing")  # said again before Rob can speak, and understood
    mission.air.run_until(150.5)
    mission.robots["Rob"].garbled(False, 150.5, addressed=True)
    mission.go_on(165.0)
    assert mission.written(150.0, without=("Anna",)) == ["Hi Anna, I am Rob, I am free"]


def test_two_robots_of_one_name_notice_say_so_and_do_nothing_under_it() -> None:
    mission = Mission(("Rob", "Bot"), plants(4), ("Anna",), seed=2)
    mission.air.run_until(20.0)
    for _ in range(3):
        mission.run_until(lambda: not mission.air.speaking)
        mission.speak("the other Rob", m.Utterance("Rob", m.ToAll(), None, m.Working(m.TaskByNumber(1))))
        mission.air.run_until(mission.air.now + 10.0)
    mission.air.run_until(75.0)
    assert "Hi all, I am Rob, my name is taken" in mission.written()
    for at_s in (80.0, 90.0, 100.0):
        mission.hear(at_s, "Hi Rob, I am Anna, complete task four")
    mission.air.run_until(113.0)
    said = [text for text in mission.written(60.0, without=("the other Rob",)) if "I am Rob" in text]
    assert "Hi Anna, I am Rob, my name is taken" in said
    assert not any("I will complete" in text for text in said)
    assert mission.robots["Rob"].task is None


def test_one_misheard_name_is_no_conflict() -> None:
    mission = Mission(("Rob", "Bot"), plants(2), seed=2)
    mission.tell(40.0, "somebody", m.Utterance("Rob", m.ToAll(), None, m.Free()))
    mission.run()
    assert mission.exactly_once
    assert not any("taken" in t for t in mission.written())


def test_who_asks_to_say_again_waits_for_that_before_it_repeats_itself() -> None:
    """Half a second after "say again" it would talk over who answers."""
    mission, robot = _ordered()
    began_s = mission.air.now
    robot.garbled(False, began_s)
    mission.go_on(began_s + 20.0)
    (asked_s, _, asked), (repeated_s, _, _), *_ = [each for each in mission.said if each[0] >= began_s]
    assert asked.statement == m.SayAgain()
    assert repeated_s - asked_s > 7.0
