"""Everything said slowly, or twice in a row, for long distances."""

import pytest

from hil_fakes.word_channel import Conditions
from hvcpd.coordination.actions import SECOND_PAUSE_S, Speech
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

TWICE = Speech(times=2)
SLOWLY_TWICE = Speech(slowly=True, times=2)


def _spoken(mission: Mission) -> list[tuple[float, float, str, m.Utterance]]:
    """Every sound: start and end in seconds, speaker, sentence."""
    sounds: list[tuple[float, float, str, m.Utterance]] = []
    say = mission.air.say

    def note(speaker: str, utterance: m.Utterance, *more: float) -> object:
        sound = say(speaker, utterance, *more)
        sounds.append((sound.start_s, sound.end_s, speaker, utterance))
        return sound

    mission.air.say = note  # type: ignore[method-assign,assignment]
    return sounds


@pytest.mark.parametrize("speech", [TWICE, SLOWLY_TWICE])
@pytest.mark.parametrize("n_robots", [2, 4])
@pytest.mark.parametrize("mode", [None, "Bot"])
def test_each_sentence_is_said_twice_and_acted_on_once(speech: Speech, n_robots: int, mode: str | None) -> None:
    mission = Mission(("Rob", "Bot", "Max", "Zoe")[:n_robots], plants(4), seed=2, coordinator=mode, speech=speech)
    sounds = _spoken(mission)
    assert mission.run().agreed
    assert mission.exactly_once, mission.written()
    for name in mission.plan.names:
        own = [s for s in sounds if s[2] == name]
        for first, second in zip(own[::2], own[1::2], strict=False):
            assert first[3] == second[3]
            assert second[0] - first[1] == pytest.approx(SECOND_PAUSE_S)


def test_nobody_begins_between_the_two_sayings() -> None:
    for seed in range(8):
        mission = Mission(("Rob", "Bot", "Max"), plants(4), seed=seed, speech=TWICE)
        sounds = _spoken(mission)
        mission.run()
        first: dict[str, tuple[float, m.Utterance]] = {}
        for start_s, end_s, who, u in sounds:
            if who in first and first[who][1] == u and start_s - first[who][0] < SECOND_PAUSE_S + 0.01:
                gap = (first.pop(who)[0], start_s)
                others = [s for s in sounds if s[2] != who and gap[0] + 0.2 < s[0] < gap[1]]
                assert not others, (seed, mission.book.write(u), others)
            else:
                first[who] = (end_s, u)


@pytest.mark.slow
def test_where_half_of_all_is_lost_less_must_be_repeated_if_all_is_said_twice() -> None:
    said = {1: 0, 2: 0}
    for seed in range(6):
        for times in said:
            speech = Speech(times=times)
            mission = Mission(("Rob", "Bot", "Max"), plants(5), seed=seed, conditions=Conditions(0.5), speech=speech)
            assert mission.run().lost == 0
            said[times] += len(mission.said)
    assert said[2] < 0.8 * said[1]


def motions_when_said_twice(mission: Mission, text: str) -> list[object]:
    """What the robots then begin to do."""
    order = mission.book.parse_text(text)
    mission.tell(60.0, "Anna", order, times=2)
    mission.air.run_until(100.0)
    return [actions for _, actions in mission.performed]


def test_a_motion_that_is_said_twice_is_made_once() -> None:
    mission = Mission(("Rob",), plants(1), ("Anna",), seed=5, coordinator="Nobody", speech=TWICE)
    assert len(motions_when_said_twice(mission, "Hi Rob, I am Anna, move forward two metres")) == 1
    assert mission.written(60.0, without=("Anna",)) == ["Hi Anna, I am Rob, I will move forward two metres"]


def test_a_robot_that_says_all_once_takes_two_sayings_for_one() -> None:
    mission = Mission(("Rob",), plants(1), ("Anna",), seed=5, coordinator="Nobody")
    assert len(motions_when_said_twice(mission, "Hi Rob, I am Anna, turn around")) == 1


def _read_back(speech: Speech | None = None) -> tuple[Mission, Coordination, list[bool]]:
    """Rob has read an order of Anna's back; how slowly it speaks from then on."""
    mission = Mission(("Rob",), plants(3), ("Anna",), seed=5, coordinator="Nobody", speech=speech or Speech())
    slow = mission.slowly["Rob"]
    mission.hear(60.0, "Hi Rob, I am Anna, complete task one")
    robot = mission.robots["Rob"]
    mission.run_until(lambda: robot.state is State.READ_BACK)
    slow.clear()
    return mission, robot, slow


def test_asked_twice_to_say_it_again_a_robot_slows_down_and_is_quick_again_afterwards() -> None:
    mission, robot, slow = _read_back()
    for n in range(2):
        mission.hear(mission.air.now + 0.1, "Hi Rob, I am Anna, say again")
        while len(slow) == n or mission.air.speaking:
            mission.air.run_until(mission.air.now + 0.1)
    assert slow == [False, True]
    mission.hear(mission.air.now + 0.1, "Hi Rob, I am Anna, negative")
    mission.air.run_until(mission.air.now + 5.0)
    assert robot.state is State.READY
    mission.hear(mission.air.now, "Hi Rob, I am Anna, what are you doing")
    mission.air.run_until(mission.air.now + 6.0)
    assert slow == [False, True, False]


def test_a_robot_set_to_speak_slowly_says_all_slowly() -> None:
    mission, _, slow = _read_back(Speech(slowly=True))
    mission.hear(mission.air.now + 0.1, "Hi Rob, I am Anna, say again")
    mission.air.run_until(mission.air.now + 8.0)
    assert slow == [True] * len(slow) != []


def test_what_is_garbled_the_second_time_is_not_asked_for() -> None:
    mission, robot, _ = _read_back(TWICE)
    confirmed = mission.book.parse_text("Hi Rob, I am Anna, what are you doing")
    robot.heard(confirmed, mission.air.now)
    began_s = mission.air.now
    robot.channel(True, began_s + 0.4)
    robot.channel(False, began_s + 3.0)
    robot.garbled(False, began_s + 3.2)
    assert robot.knowledge.repair.asked == 0
    robot.channel(True, began_s + 10.0)
    robot.channel(False, began_s + 12.0)
    robot.garbled(False, began_s + 12.2)
    assert robot.knowledge.repair.asked == 1
