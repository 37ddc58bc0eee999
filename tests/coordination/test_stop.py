"""Stop always wins, latches, and nothing but "resume" releases it."""

import pytest

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import Outage
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("call", ["Stop", "All stop", "Rob stop", "Team plant stop", "Hi all, I am Anna, stop"])
def test_stop_halts_and_latches_until_resume(call: str) -> None:
    mission = Mission(("Rob", "Bot"), plants(4), ("Anna",), seed=2)
    mission.hear(40.0, call)
    mission.air.run_until(140.0)
    halted = ["Rob"] if call == "Rob stop" else ["Rob", "Bot"]
    for name in halted:
        assert mission.robots[name].state is State.STOPPED
        assert mission.robots[name].task is None
        assert mission.halted_s[name] <= 40.0 + 2.0 * 7 * 0.33 + 0.5
    assert set(mission.written()) >= {f"Hi all, I am {name}, I have stopped" for name in halted}
    watered = dict(mission.watered)
    if len(halted) == 2:
        mission.air.run_until(240.0)
        assert dict(mission.watered) == watered
    mission.hear(250.0, call.replace("stop", "resume").replace("Stop", "Resume"))
    mission.run()
    assert mission.exactly_once, mission.written()


@pytest.mark.parametrize("at_s", [float(t) for t in range(2, 120, 3)])
def test_stop_is_obeyed_whenever_it_comes_even_over_another_voice(at_s: float) -> None:
    """Halts within half a second of the end of the word, whatever the robots are just doing or saying."""
    mission = Mission(("Rob", "Bot", "Max"), plants(6), ("Anna",), seed=5)
    mission.hear(at_s, "Stop", speaker="Anna")
    mission.air.run_until(at_s + 0.33 * 1.1 + 0.5)
    for name, robot in mission.robots.items():
        assert robot.state is State.STOPPED, name
        assert at_s < mission.halted_s[name] <= at_s + 0.33 * 1.1 + 0.5
    watered = dict(mission.watered)
    mission.air.run_until(at_s + 300.0)
    assert dict(mission.watered) == watered
    assert all(robot.state is State.STOPPED for robot in mission.robots.values())


def test_a_stopped_robot_starts_no_old_motion_and_refuses_orders() -> None:
    mission = Mission(("Rob",), plants(3), ("Anna",), seed=3)
    mission.hear(45.0, "Stop", speaker="Anna")
    mission.hear(60.0, "Hi Rob, I am Anna, complete task one")
    mission.hear(80.0, "Hi Rob, I am Anna, turn left")
    mission.air.run_until(100.0)
    said = mission.written(45.0, without=("Anna",))
    assert said == ["Stop", "Stop", "Hi all, I am Rob, I have stopped"] + ["Hi Anna, I am Rob, I have stopped"] * 2
    assert mission.robots["Rob"].task is None


def test_a_restart_releases_nobody() -> None:
    mission = Mission(("Rob", "Bot"), plants(4), ("Anna",), seed=6, outages=(Outage("Rob", 60.0, 20.0),))
    mission.hear(45.0, "All stop", speaker="Anna")
    mission.air.run_until(300.0)
    assert mission.robots["Rob"].state is State.STOPPED
    mission.hear(301.0, "All resume", speaker="Anna")
    mission.run()
    assert mission.exactly_once


def test_a_stop_in_the_same_talk_as_the_last_one_stops_a_robot_that_was_released_meanwhile() -> None:
    mission = Mission(("Rob",), plants(3), ("Anna",), seed=3)
    mission.air.run_until(45.0)
    rob = mission.robots["Rob"]
    rob.channel(True, 45.0)
    for at_s in (46.0, 50.0):
        rob.heard(mission.book.parse_text("Stop"), at_s)
        assert rob.state is State.STOPPED
        assert rob.resume(at_s + 1.0)


def test_an_unsure_resume_that_is_said_again_at_once_releases() -> None:
    mission = Mission(("Rob",), plants(3), ("Anna",), seed=3)
    mission.air.run_until(45.0)
    rob = mission.robots["Rob"]
    rob.stop(45.0)
    for began_s in (50.0, 51.6):
        assert rob.state is State.STOPPED
        rob.channel(True, began_s)
        rob.heard(mission.book.parse_text("Rob resume"), began_s + 0.9, confidence=0.85)
        rob.channel(False, began_s + 1.0)
    assert rob.state is not State.STOPPED


@pytest.mark.parametrize("request_", ["complete task one", "turn left"])
def test_a_refusal_that_waits_for_its_turn_is_not_said_after_resume(request_: str) -> None:
    """The robot said "I have stopped" after "resume", which the others took for another stop."""
    mission = Mission(("Rob",), plants(3), ("Anna",), seed=3)
    mission.air.run_until(45.0)
    rob = mission.robots["Rob"]
    rob.stop(45.0)
    mission.hear(60.0, f"Hi Rob, I am Anna, {request_}")
    mission.hear(63.0, "Rob resume")
    mission.air.run_until(90.0)
    assert rob.state is not State.STOPPED
    assert not [text for text in mission.written(60.0) if "stopped" in text]


@pytest.mark.parametrize("by_voice", [True, False])
def test_an_unsure_resume_from_before_a_stop_does_not_count(by_voice: bool) -> None:
    """It released the robot, at the first chance speech that sounded like "resume" within half a minute."""
    mission = Mission(("Rob",), plants(3), ("Anna",), seed=3)
    mission.air.run_until(45.0)
    rob, book = mission.robots["Rob"], mission.book
    rob.heard(book.parse_text("Resume"), 45.0, confidence=0.85)
    if by_voice:
        rob.heard(book.parse_text("Stop"), 50.0)
    else:
        rob.stop(50.0)
    rob.heard(book.parse_text("Resume"), 60.0, confidence=0.85)
    assert rob.state is State.STOPPED
    rob.heard(book.parse_text("Stop"), 65.0)
    rob.heard(book.parse_text("Resume"), 70.0, confidence=0.85)
    assert rob.state is State.STOPPED
    rob.heard(book.parse_text("Resume"), 75.0, confidence=0.85)
    assert rob.state is not State.STOPPED


@pytest.mark.parametrize("by_voice", [True, False])
@pytest.mark.parametrize("stopped", [True, False])
def test_a_stop_outdoes_a_resume_that_the_robot_is_still_to_say_for_its_owner(by_voice: bool, stopped: bool) -> None:
    """Where the robot stood already it said "resume" all the same, after the "stop", and released the others."""
    mission = Mission(("Rob", "Bot"), plants(3), ("Anna",), seed=3)
    mission.air.run_until(45.0)
    rob, book = mission.robots["Rob"], mission.book
    if stopped:
        rob.stop(45.0)
    for text in ("Hi all, I am Rob, resume", "Hi Bot, I am Rob, what is left"):
        assert rob.say(book.parse_text(text), 45.0) is None
    if by_voice:
        mission.hear(45.1, "Stop")
    else:
        rob.stop(45.0)
    mission.air.run_until(120.0)
    assert "Hi all, I am Rob, resume" not in mission.written(45.0)
    assert ("Hi Bot, I am Rob, what is left" in mission.written(45.0)) == stopped, "only a new stop clears all"
    assert rob.state is State.STOPPED


@pytest.mark.parametrize("by_voice", [True, False])
def test_a_stop_for_another_robot_outdoes_its_resume_that_the_owner_has_asked_for_before(by_voice: bool) -> None:
    """Rob said "stop" to Bot at once, and "resume", which was asked for before, when its turn came."""
    mission = Mission(("Rob", "Bot"), plants(3), ("Anna",), seed=3)
    mission.air.run_until(45.0)
    rob, book = mission.robots["Rob"], mission.book
    assert rob.say(book.parse_text("Hi Bot, I am Rob, resume"), 45.0) is None
    if by_voice:
        mission.hear(45.1, "Bot stop")
    else:
        assert rob.say(book.parse_text("Bot stop"), 45.0) is None
        mission.air.refresh(("Rob",))
    mission.air.run_until(120.0)
    assert "Hi Bot, I am Rob, resume" not in mission.written(45.0)
    assert mission.robots["Bot"].state is State.STOPPED


@pytest.mark.parametrize("name", ["Rob", "rob"])
def test_stop_is_obeyed_from_whoever_gives_the_robots_own_name(name: str) -> None:
    mission = Mission(("Rob",), plants(3), ("Anna",), seed=3)
    mission.air.run_until(45.0)
    rob = mission.robots["Rob"]
    rob.heard(m.Utterance(name, m.ToAll(), None, m.Stop()), 45.0)
    assert rob.state is State.STOPPED
    rob.heard(m.Utterance(name, m.ToAll(), None, m.Resume()), 50.0)
    assert rob.state is State.STOPPED


def test_others_take_over_what_a_stopped_robot_had_claimed() -> None:
    mission = Mission(("Rob", "Bot"), plants(4), ("Anna",), seed=6, conditions=Conditions())
    mission.hear(45.0, "Rob stop", speaker="Anna")
    mission.air.run_until(400.0)
    assert all(mission.watered[n] == 1 for n in range(1, 5))
