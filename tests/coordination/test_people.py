"""People are speakers like any other: they ask, order, and move robots about."""

import pytest

from hvcpd.config.tasks import Forward, GoTo, Turn
from hvcpd.coordination.actions import Role
from hvcpd.coordination.composing import spoken_volts
from hvcpd.coordination.states import AT_WORK, State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants


def _waiting(*names: str, **more: object) -> Mission:
    """Robots that wait for orders."""
    mission = Mission(names, plants(4), ("Anna",), seed=5, coordinator="Nobody", **more)
    mission.air.run_until(50.0)
    return mission


def _at_work() -> Mission:
    """One robot that has just set out to its only plant, 35 s away."""
    mission = Mission(("Rob",), plants(3)[2:], ("Anna",), seed=5)
    mission.run_until(lambda: mission.robots["Rob"].state in AT_WORK, 1.0)
    return mission


def _answers(mission: Mission, text: str, within_s: float = 15.0) -> list[str]:
    at_s = mission.air.now + 0.5
    mission.hear(at_s, text, speaker="Anna")
    mission.air.run_until(at_s + within_s)
    return mission.written(at_s, without=("Anna",))


def test_what_are_you_doing() -> None:
    assert _answers(_waiting("Rob"), "Hi Rob, I am Anna, what are you doing") == ["Hi Anna, I am Rob, I am free"]
    assert _answers(_at_work(), "Rob, what are you doing", 6.0) == [
        "Hi all, I am Rob, completing task, water the indigo rose"
    ]


def test_who_is_here_is_answered_by_each_once() -> None:
    said = _answers(_waiting("Rob", "Bot", "Max"), "Hi all, I am Anna, who is here", 25.0)
    assert sorted(said) == [f"Hi Anna, I am {name}, member of team plant" for name in ("Bot", "Max", "Rob")]


@pytest.mark.parametrize("greeting", ["Hi Rob, I am Anna", "Hi Rob, I am friend"])
def test_a_person_who_greets_a_robot_by_name_is_greeted(greeting: str) -> None:
    """It was taken for a robot's answer to a greeting, and met with silence."""
    mission = _waiting("Rob", "Bot")
    name = greeting.split()[-1]
    assert _answers(mission, greeting) == [f"Hi {name}, I am Rob, member of team plant"]


@pytest.mark.parametrize("size", [2, 3, 6])
@pytest.mark.parametrize("question", ["Who is here", "Hi all", "Rob, who is here", "Hi Rob"])
def test_who_is_here_by_nobody_in_particular_is_no_reason_to_greet_each_other(question: str, size: int) -> None:
    """What a robot says to everybody was taken for a greeting, and answered: six robots said eleven sentences."""
    asked = ("Rob", "Bot", "Max", "Ann", "Mia", "Ted")[:size]
    said = _answers(_waiting(*asked), question, 15.0 * size + 30.0)
    named = [text for text in said if text.endswith(("team plant", "am Rob", "am Bot"))]
    answering = asked if question in ("Who is here", "Hi all") else ("Rob",)
    assert sorted(named) == sorted(f"Hi all, I am {name}, member of team plant" for name in answering)


def test_a_robot_that_is_switched_on_meanwhile_is_still_greeted() -> None:
    mission = _waiting("Rob", "Bot")
    assert len(_answers(mission, "Who is here", 11.0)) == 2
    for at_s in (0.5, 8.0):
        mission.hear(mission.air.now + at_s, "Hi all, I am Bot, member of team plant")
    began_s = mission.air.now
    mission.air.run_until(began_s + 25.0)
    assert "Hi team plant, I am Rob" in mission.written(began_s)


def test_a_mere_greeting_asks_the_same() -> None:
    assert _answers(_waiting("Rob"), "Hi Rob") == ["Hi all, I am Rob, member of team plant"]


def test_a_report_is_given_by_each_in_turn_with_all_that_a_shift_needs() -> None:
    mission = _waiting("Rob", "Bot", "Max")
    mission.robots["Rob"].sensed(battery_v=11.94)
    mission.robots["Bot"].sensed(battery_v=12.0)
    mission.robots["Bot"].stop(mission.air.now)
    mission.air.run_until(mission.air.now + 10.0)
    said = _answers(mission, "Hi all, I am Anna, report", 40.0)
    assert sorted(text for text in said if ", report, " in text) == [
        "Hi Anna, I am Bot, member of team plant, report, I have stopped, battery twelve volts",
        "Hi Anna, I am Max, member of team plant, report, I am free",
        "Hi Anna, I am Rob, member of team plant, report, I am free, battery eleven and a half volts",
    ]


def test_a_report_of_one_at_work_names_its_task() -> None:
    mission = _at_work()
    mission.robots["Rob"].sensed(battery_v=7.4)
    said = _answers(mission, "Rob, report", 12.0)
    assert said == ["Hi all, I am Rob, member of team plant, report, completing task three"]


@pytest.mark.parametrize("size", [2, 5, 8])
def test_reports_do_not_collide(size: int) -> None:
    mission = _waiting(*("Rob", "Bot", "Max", "Ann", "Mia", "Ted", "Gus", "Rex")[:size])
    collided = mission.air.collisions
    said = _answers(mission, "Hi all, I am Anna, report", 15.0 * size)
    assert len({text.split(", ")[1] for text in said if ", report, " in text}) == size
    assert mission.air.collisions == collided


@pytest.mark.parametrize(
    ("battery_v", "said"),
    [(None, None), (8.99, None), (9.0, 9.0), (11.49, 11.0), (11.5, 11.5), (12.99, 12.5), (13.0, None)],
)
def test_a_battery_is_never_said_to_hold_more_than_was_measured(battery_v: float | None, said: float | None) -> None:
    assert spoken_volts(battery_v) == said


def test_what_is_left_is_answered_by_one() -> None:
    mission = _waiting("Rob", "Bot", "Max")
    assert [t.split(", ", 2)[2] for t in _answers(mission, "What is left")] == [
        "task one and two and three and more left"
    ]
    for robot in mission.robots.values():
        robot.board.complete(2, "Bot")
    assert [t.split(", ", 2)[2] for t in _answers(mission, "What is left")] == ["task one and three and four left"]
    for robot in mission.robots.values():
        for number in (1, 3, 4):
            robot.board.complete(number, "Bot")
    assert [t.split(", ", 2)[2] for t in _answers(mission, "Hi Bot, I am Anna, what is left")] == ["nothing left"]


@pytest.mark.parametrize(
    ("order", "action", "said"),
    [
        ("Rob, move forward two metres", Forward(2.0), "I will move forward two metres"),
        ("Rob, move back half a metre", Forward(-0.5), "I will move back half a metre"),
        ("Rob, turn left", Turn(90.0), "I will turn left"),
        ("Turn right", Turn(-90.0), "I will turn right"),
    ],
)
def test_a_motion_is_read_back_and_made(order: str, action: Forward | Turn, said: str) -> None:
    mission = _waiting("Rob")
    robot = mission.robots["Rob"]
    mission.holds_motion = True
    assert _answers(mission, order) == [f"Hi all, I am Rob, {said}"]
    assert mission.performed == [(0, (action,))]
    assert robot.state is State.MOVING
    robot.performed(mission.air.now)
    assert robot.state is State.READY


def test_come_back_leads_to_where_the_robot_began() -> None:
    mission = _waiting("Rob")
    home = mission.robots["Rob"].knowledge.body.home
    assert home is not None
    mission.holds_motion = True
    _answers(mission, "Hi Rob, I am Anna, come back")
    assert mission.performed == [(0, (GoTo(home),))]


def test_a_motion_for_nobody_moves_nobody_where_there_are_two() -> None:
    assert _answers(_waiting("Rob", "Bot"), "Turn left") == []


def _hear_unsurely(mission: Mission, statement: m.Statement) -> None:
    robot, now = mission.robots["Rob"], mission.air.now
    robot.heard(m.Utterance("Anna", m.ToRobot("Rob"), None, statement), now, confidence=0.6)
    mission.air.refresh()


def test_a_motion_that_was_not_clearly_heard_waits_for_the_confirmation() -> None:
    mission = _waiting("Rob")
    began_s = mission.air.now
    _hear_unsurely(mission, m.TurnBy(90.0))
    mission.air.run_until(began_s + 4.5)
    assert mission.written(began_s) == ["Hi Anna, I am Rob, I will turn left"]
    assert mission.robots["Rob"].state is State.READ_BACK
    mission.hear(began_s + 4.6, "Hi Rob, I am Anna, confirmed")
    mission.air.run_until(began_s + 7.9)
    assert mission.robots["Rob"].state in (State.MOVING, State.READY)
    assert mission.robots["Rob"].knowledge.current.motion is None or mission.robots["Rob"].state is State.MOVING


@pytest.mark.parametrize("answer", ["Hi Rob, I am Anna, negative", None])
def test_a_motion_that_is_denied_or_not_confirmed_is_not_made(answer: str | None) -> None:
    mission = _waiting("Rob")
    mission.holds_motion = True
    began_s = mission.air.now
    _hear_unsurely(mission, m.MoveBy(5.0))
    if answer:
        mission.hear(began_s + 4.0, answer)
    mission.air.run_until(began_s + 60.0)
    assert mission.performed == []
    assert mission.robots["Rob"].state is State.READY


def test_unknown_and_impossible_tasks_are_refused_with_the_reason() -> None:
    mission = _waiting("Rob")
    assert _answers(mission, "Hi Rob, I am Anna, complete task nine") == ["Hi Anna, I am Rob, I do not know task nine"]
    robot = mission.robots["Rob"]
    robot.knowledge.role = Role("Rob", "plant", volunteer=False, unable=frozenset({2}))
    assert _answers(mission, "Hi Rob, I am Anna, complete task two") == [
        "Hi Anna, I am Rob, I cannot complete task two"
    ]
    robot.board.complete(3, "Rob")
    assert _answers(mission, "Hi Rob, I am Anna, complete task three") == ["Hi Anna, I am Rob, task three complete"]


def test_a_robot_at_work_says_that_it_is_busy() -> None:
    mission = _at_work()
    assert _answers(mission, "Hi Rob, I am Anna, turn left", 6.0) == ["Hi Anna, I am Rob, I am busy"]
    order = m.Utterance("Anna", m.ToRobot("Rob"), None, m.Order(m.TaskByNumber(3)))
    mission.tell(mission.air.now, "Anna", order)
    mission.air.run_until(mission.air.now + 6.0)
    assert mission.written()[-1] == "Hi Anna, I am Rob, I am busy"
    assert mission.robots["Rob"].state in AT_WORK


@pytest.mark.parametrize("state", [State.MEETING, State.ASKING, State.ASKED])
def test_a_robot_that_only_asks_what_is_left_is_not_busy(state: State) -> None:
    mission = _waiting("Rob")
    mission.robots["Rob"].knowledge.state = state
    said = _answers(mission, "Hi Rob, I am Anna, turn left", 6.0)
    assert said == ["Hi Anna, I am Rob, I will turn left"]


def test_one_robot_refuses_and_an_able_one_takes_over() -> None:
    mission = Mission(("Rob", "Max", "Bot"), plants(2), seed=3, coordinator="Bot")
    mission.robots["Rob"].knowledge.role = Role("Rob", "plant", volunteer=False, unable=frozenset({1, 2}))
    mission.run()
    assert mission.exactly_once
    assert set(mission.by.values()) == {"Max"}


@pytest.mark.parametrize(
    ("heard", "released"),
    [
        (((0.0, 0.97),), True),
        (((0.0, 0.85),), False),
        (((0.0, 0.85), (20.0, 0.85)), True),
        (((0.0, 0.85), (40.0, 0.85)), False),
    ],
)
def test_resume_is_heard_surely_or_twice(heard: tuple[tuple[float, float], ...], released: bool) -> None:
    mission = _waiting("Rob")
    robot = mission.robots["Rob"]
    began_s = mission.air.now
    robot.heard(m.Utterance(None, statement=m.Stop()), began_s)
    assert robot.state is State.STOPPED
    for after_s, confidence in heard:
        robot.heard(m.Utterance(None, statement=m.Resume()), began_s + 1.0 + after_s, confidence=confidence)
    assert (robot.state is not State.STOPPED) is released


@pytest.mark.parametrize(
    ("order", "yes"),
    [
        ("Hi Rob, I am friend, complete task two", "Hi Rob, I am friend, confirmed"),
        ("Rob, water the violet rose", "Rob, confirmed"),
        ("Hi Rob, I am friend, water the violet rose", "Hi Rob, I am Anna, confirmed"),
    ],
)
def test_a_person_whose_name_is_not_known_is_obeyed_and_called_friend(order: str, yes: str) -> None:
    mission = _waiting("Rob")
    assert _answers(mission, order, 9.0)[0].startswith("Hi friend, I am Rob, I will ")
    _answers(mission, yes, 60.0)
    assert mission.watered[2] == 1
    assert mission.robots["Rob"].peers.get("friend") is None, "nobody waits for its turn"


def test_a_coordinator_gives_no_order_to_a_friend() -> None:
    """It took whoever a robot speaks to for a robot, and spoke to "friend" again and again."""
    mission = Mission(("Rob", "Bot", "Max"), plants(4), ("Anna",), seed=5, coordinator="Bot")
    for at_s, text in ((20.0, "Hi Rob, I am friend, what are you doing"), (40.0, "Rob, what is left")):
        mission.hear(at_s, text, speaker="Anna")
    mission.hear(60.0, "Hi Bot, I am Max, friend says, what are you doing", speaker="Max")
    mission.run()
    assert all(robot.peers.get("friend") is None for robot in mission.robots.values())
    assert not [text for text in mission.written() if text.startswith("Hi friend, I am Bot, water")]


def test_a_friend_who_repeats_an_order_is_not_told_that_the_robot_is_busy_with_it() -> None:
    mission = _waiting("Rob")
    _answers(mission, "Hi Rob, I am Anna, complete task four", 9.0)
    _answers(mission, "Rob, confirmed", 8.0)
    assert mission.robots["Rob"].state in AT_WORK
    assert _answers(mission, "Rob, complete task four", 8.0) == ["Hi friend, I am Rob, I will complete task four"]


def test_who_said_a_name_may_confirm_without_one() -> None:
    mission = _waiting("Rob")
    assert _answers(mission, "Hi Rob, I am Anna, complete task two", 7.0) == [
        "Hi Anna, I am Rob, I will complete task two"
    ]
    _answers(mission, "Rob, confirmed", 60.0)
    assert mission.watered[2] == 1


@pytest.mark.parametrize("order", ["Hi Rob, I am Anna, complete task two", "Rob, complete task two"])
def test_so_may_who_is_among_the_names_that_all_know(order: str) -> None:
    """Whoever the setting `names` names counted as a robot, for which nobody without a name may confirm."""
    mission = Mission(("Rob", "Anna"), plants(4), seed=5, coordinator="Nobody", late={"Anna": 9000.0})
    mission.air.run_until(50.0)
    _answers(mission, order, 9.0)
    _answers(mission, "Rob, confirmed" if "Anna" in order else "Hi Rob, I am Anna, confirmed", 60.0)
    assert mission.watered[2] == 1


@pytest.mark.parametrize("no", ["Rob, negative", "Hi Rob, I am Anna, negative"])
@pytest.mark.parametrize("order", ["Rob, turn left", "Rob, complete task two"])
def test_who_gave_no_name_can_still_say_no(order: str, no: str) -> None:
    """A motion that was ordered without a name was read back until the robot gave up, whatever was said."""
    mission = _waiting("Rob")
    at_s = mission.air.now + 0.5
    mission.at(at_s, lambda: mission.robots["Rob"].heard(mission.book.parse_text(order), at_s, confidence=0.9))
    mission.air.run_until(at_s + 1.0)
    mission.go_on(at_s + 6.0)
    assert mission.robots["Rob"].state is State.READ_BACK
    _answers(mission, no, 4.0)
    assert mission.robots["Rob"].state is State.READY
    assert not mission.performed


def test_nobody_without_a_name_confirms_for_a_robot() -> None:
    mission = Mission(("Rob", "Bot"), plants(2), ("Anna",), seed=5, coordinator="Bot")
    rob = mission.robots["Rob"]
    mission.until("Rob", State.READ_BACK, 0.5)
    rob.heard(m.Utterance("friend", m.ToRobot("Rob"), None, m.Confirmed()), mission.air.now)
    assert rob.state is State.READ_BACK


@pytest.mark.parametrize("is_person", [True, False])
def test_nobody_waits_for_people_to_confirm_a_claim(is_person: bool) -> None:
    """Rob was alone with Anna, who had given her name: it claimed its first task eighteen times, in four minutes, and
    would have driven back to where it had heard her."""
    mission = Mission(("Rob",), plants(2), ("Anna",), seed=5)
    rob = mission.robots["Rob"]

    def says(text: str) -> None:
        rob.heard(mission.book.parse_text(text), mission.air.now, by_person=is_person)
        mission.air.refresh()

    for at_s in (10.0, 70.0):
        mission.at(at_s, lambda: says("Hi Rob, I am Anna, what are you doing"))
    mission.air.run_until(180.0)
    assert (len(mission.done) == 2) is is_person, "\n".join(mission.written())
    assert not [task for task, _ in mission.performed if task == 0]
