"""What a person asks for is done only if that person, or nobody in the room, objects to the read-back."""

from __future__ import annotations

import pytest

from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from hvcpd.security.trust import Trust
from tests.coordination.mission import Mission, plants

READ_BACK_S = 6.0
"""After an order its read-back is out, and not yet repeated."""


class Room:
    """Robots that wait for orders, of which the first hears each sentence with a confidence, and makes no motion."""

    def __init__(self, *robots: str) -> None:
        self.mission = Mission(robots, plants(4), ("Anna", "Ben"), seed=5, coordinator="Nobody")
        self.mission.air.run_until(50.0)
        self.mission.holds_motion = True
        self.robot = self.mission.robots[robots[0]]

    def hears(self, text: str, confidence: float = 0.9, trust: Trust = Trust.OPEN, for_s: float = READ_BACK_S) -> State:
        """The first robot's state some time after it has heard a sentence."""
        air = self.mission.air
        self.robot.heard(
            self.mission.book.parse_text(text),
            air.now,
            confidence=confidence,
            trust=trust,
            by_person=" Bot," not in text,
        )
        air.refresh()
        air.run_until(air.now + for_s)
        return self.robot.state


@pytest.mark.parametrize("again", ["Hi Rob, I am Anna, turn left", "Hi Rob, I am Ben, turn left", "Rob, turn left"])
def test_a_motion_that_is_heard_twice_unsurely_still_waits_for_the_confirmation(again: str) -> None:
    """What was misheard was made as soon as it was misheard again, by whomever."""
    room = Room("Rob")
    for text in ("Hi Rob, I am Anna, turn left", again):
        assert room.hears(text, 0.55, for_s=4.5) is State.READ_BACK
    assert not room.mission.performed


def test_no_robot_confirms_a_motion_that_was_ordered_without_a_name() -> None:
    """A robot that confirmed its own order, in whose place the motion had come, set the wheels in motion."""
    room = Room("Rob", "Bot")
    assert room.hears("Rob, move forward five metres") is State.READ_BACK
    assert room.hears("Hi Rob, I am Bot, confirmed", for_s=0.0) is State.READ_BACK
    assert room.hears("Hi Rob, I am Anna, confirmed", for_s=0.0) is State.MOVING


def test_who_gave_a_code_and_no_name_may_confirm_without_a_code() -> None:
    """It was told "I do not trust that"."""
    room = Room("Rob")
    assert room.hears("Rob, move forward one metre", trust=Trust.CODE) is State.READ_BACK
    assert room.hears("Rob, confirmed", trust=Trust.BARE, for_s=0.0) is State.MOVING


@pytest.mark.parametrize("order", ["turn left", "complete task two"])
def test_anybody_in_the_room_can_say_no_for_a_person(order: str) -> None:
    """The name that was heard with the order may be the wrong one."""
    room = Room("Rob", "Bot")
    assert room.hears(f"Hi Rob, I am Ben, {order}") is State.READ_BACK
    assert room.hears("Hi Rob, I am Bot, negative", for_s=0.0) is State.READ_BACK
    assert room.hears("Hi Rob, I am Anna, negative", for_s=0.0) is State.READY


@pytest.mark.parametrize("no", ["Rob, negative", "Hi Rob, I am Anna, negative"])
@pytest.mark.parametrize("order", ["Rob, move forward five metres", "Hi Rob, I am Anna, move forward five metres"])
def test_a_motion_that_was_heard_surely_can_still_be_denied(order: str, no: str) -> None:
    """The robot sets out as soon as it has read it back: "negative" came too late, and changed nothing."""
    room = Room("Rob")
    assert room.hears(order, 1.0) is State.MOVING
    assert room.hears(no, for_s=0.0) is State.READY


@pytest.mark.parametrize("no", ["Rob, negative", "Hi Rob, I am Anna, negative", "Hi Rob, I am Ben, negative"])
@pytest.mark.parametrize("state", [State.GOING, State.ACTING])
def test_a_person_can_take_an_order_back_that_is_carried_out(state: State, no: str) -> None:
    """The robot carried the task out to its end, without a word."""
    room = Room("Rob", "Bot")
    air, rob = room.mission.air, room.robot
    assert room.hears("Hi Rob, I am Anna, complete task two") is State.READ_BACK
    assert room.hears("Hi Rob, I am Anna, confirmed", for_s=0.0) is State.GOING
    if state is State.ACTING:
        rob.performed(air.now)
        air.refresh()
    assert room.hears("Hi Rob, I am Bot, negative", for_s=0.0) is state
    asked_s = air.now
    assert room.hears(no, for_s=5.0) is State.READY
    assert room.mission.halted_s["Rob"] == pytest.approx(asked_s, abs=0.1)
    assert room.mission.written(asked_s) == ["Hi all, I am Rob, skip task two, change one"]
    assert room.hears("Hi Rob, I am Anna, complete task two") is State.READ_BACK, "it may be ordered anew"


@pytest.mark.parametrize("order", ["Hi, I am Anna, turn left", "Hi all, I am Anna, turn left", "All, turn left"])
def test_the_only_robot_there_needs_no_name(order: str) -> None:
    """ "Hi all" and "hi" mean the same, and either may be heard for the other."""
    room = Room("Rob")
    room.hears("Hi Rob, I am Ben, what are you doing")  # people do not count
    assert room.hears(order, 1.0) is State.MOVING
    assert Room("Rob", "Bot").hears(order, 1.0) is State.READY


def test_a_robot_that_may_not_be_the_only_one_makes_no_motion_for_nobody_in_particular() -> None:
    """Two that had just been switched on, and had not heard each other yet, both took themselves for the only one."""
    mission = Mission(("Rob", "Bot"), plants(1), ("Anna",), seed=5, coordinator="Nobody", late={"Bot": 9000.0})
    mission.holds_motion = True
    mission.until("Rob", State.MEETING, 0.5)
    rob, turn = mission.robots["Rob"], m.Utterance(None, None, None, m.TurnBy(90.0))
    rob.heard(turn, mission.air.now)
    assert rob.state is State.MEETING
    mission.air.run_until(60.0)  # by now the other one would have spoken
    rob.heard(turn, mission.air.now)
    assert rob.state is State.READING_BACK


def test_a_coordinator_gives_no_orders_to_people() -> None:
    """Anna, who had asked what a robot is doing, was ordered to water a rose, again and again."""
    mission = Mission(("Rob", "Bot"), plants(3), ("Anna", "Ben"), seed=5, coordinator="Bot")

    def hear(text: str, *robots: str) -> None:
        for name in robots:
            mission.robots[name].heard(mission.book.parse_text(text), mission.air.now, by_person=True)
        mission.air.refresh()

    mission.at(21.0, lambda: hear("Hi Rob, I am Anna, what are you doing", "Rob", "Bot"))
    mission.at(60.0, lambda: hear("Hi Rob, I am Ben, what are you doing", "Rob"))  # Bot hears only the answer
    mission.run()
    assert mission.exactly_once
    assert {u.addressee for _, _, u in mission.said if isinstance(u.statement, m.Order)} == {m.ToRobot("Rob")}


@pytest.mark.parametrize("said", ["Hi Bot, I am Max, I am free", "Hi team plant, I am Max"])
def test_who_is_once_heard_as_a_robot_is_one(said: str) -> None:
    mission = Mission(("Bot",), plants(1), ("Max",), seed=5, coordinator="Bot")
    mission.air.run_until(20.0)
    bot, book = mission.robots["Bot"], mission.book
    bot.heard(book.parse_text("Hi Bot, I am Max, what is left"), mission.air.now, by_person=True)
    assert bot.peers.people() == {"max"}
    bot.heard(book.parse_text(said), mission.air.now, by_person="team" in said)
    assert bot.peers.people() == set()


def test_who_is_free_by_its_turn_does_not_say_that_it_is_busy() -> None:
    """It said so up to 13 s later, and a coordinator then gave it no order for long."""
    room = Room("Rob", "Bot")
    robot, air = room.robot, room.mission.air
    robot.knowledge.state, began_s = State.PROPOSED, air.now
    robot.heard(room.mission.book.parse_text("Hi Rob, I am Anna, complete task two"), air.now)
    robot.knowledge.state = State.READY
    air.refresh()
    air.run_until(air.now + 10.0)
    assert room.mission.written(began_s) == []


def test_who_reads_an_order_back_no_longer_says_that_it_is_busy() -> None:
    """It said both where a voice had come between the order that it refused and the one that it took."""
    room = Room("Rob", "Bot")
    robot, book, air = room.robot, room.mission.book, room.mission.air
    robot.knowledge.state, began_s = State.PROPOSED, air.now
    for text in ("Hi Rob, I am Anna, complete task two", "Hi Rob, I am Bot, negative"):
        robot.heard(book.parse_text(text), air.now)
        robot.channel(True, air.now)
    robot.knowledge.state = State.READY
    robot.channel(False, air.now)
    assert room.hears("Hi Rob, I am Anna, complete task two", 1.0) is State.READ_BACK
    assert room.mission.written(began_s) == ["Hi Anna, I am Rob, I will complete task two"]
