"""Two that do not hear each other, and a third one between them that passes their words on."""

import random

import pytest

from hil_fakes.word_channel import Conditions
from hvcpd.config.tasks import Place, TaskDefinition, Tend, Wait
from hvcpd.coordination.actions import Role
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission
from tests.coordination.test_two_tasks import next_said

HERE = (TaskDefinition(1, "water the green rose", None, (Wait(1.0), Tend(5.0))),)
"""Done on the spot, so that nobody comes nearer."""
TWO = (*HERE, TaskDefinition(2, "water the violet rose", None, (Wait(1.0), Tend(5.0))))
BETWEEN = ("Max", "Kim", "Ada")


def line(between: int = 1, coordinator: str = "Rob", **plan: object) -> Mission:
    """Rob, others in the middle, and Zoe: the two at the ends met when they were nearer, and do not hear each other any
    more. Only Zoe can do the task."""
    middle = BETWEEN[:between]
    names = ("Rob", *middle, "Zoe")
    unable = {name: frozenset({1}) for name in middle}
    mission = Mission(names, HERE, coordinator=coordinator, earshot_m=100.0, unable=unable, **plan)
    for name in names:
        x_m = {"Rob": -80.0, "Zoe": 80.0}.get(name, 0.0)
        mission.bodies[name].place = Place(x_m, 0.0)

    def meet() -> None:
        for name, robot in mission.robots.items():
            for other in names:
                if other != name:
                    robot.heard(m.Utterance(other, m.ToTeam("plant")), mission.air.now)

    mission.at(0.5, meet)
    return mission


def relays(mission: Mission) -> list[m.Utterance]:
    return [u for _, _, u in mission.said if isinstance(u.statement, m.Relayed)]


def test_an_order_its_read_back_and_the_report_cross_the_one_between() -> None:
    mission = line(seed=3)
    mission.run()
    assert mission.watered == {1: 1}
    assert mission.by == {1: "Zoe"}
    assert mission.written()[-10:] == [
        "Hi Zoe, I am Rob, water the green rose",
        "Hi Zoe, I am Max, Rob says, water the green rose",
        "Hi Rob, I am Zoe, I will water the green rose",
        "Hi Rob, I am Max, Zoe says, I will water the green rose",
        "Hi Zoe, I am Rob, confirmed",
        "Hi Zoe, I am Max, Rob says, confirmed",
        "Hi Rob, I am Zoe, task one complete",
        "Hi Rob, I am Max, Zoe says, task one complete",
        "Hi Zoe, I am Rob, confirmed",
        "Hi Zoe, I am Max, Rob says, confirmed",
    ]
    assert mission.robots["Rob"].board.all_done


@pytest.mark.parametrize("between", [1, 2, 3])
@pytest.mark.parametrize("seed", range(6))
def test_whoever_is_between_no_message_is_passed_on_twice(between: int, seed: int) -> None:
    mission = line(between, seed=seed)
    mission.run()
    passed = [(u.addressee, u.statement) for u in relays(mission)]
    confirmed = (m.ToRobot("Zoe"), m.Relayed("Rob", m.Confirmed()))
    assert passed.count(confirmed) == 2, "of the read-back, and of the report"
    passed.remove(confirmed)
    order = m.TaskByName("water the green rose")
    assert set(passed) == {
        (m.ToRobot("Zoe"), m.Relayed("Rob", m.Order(order))),
        (m.ToRobot("Rob"), m.Relayed("Zoe", m.Claim(order))),
        (m.ToRobot("Rob"), m.Relayed("Zoe", m.Completed(m.TaskByNumber(1)))),
        confirmed,
    }
    assert len(passed) == 4
    assert mission.by == {1: "Zoe"}


def test_a_question_and_its_answer_cross_it_too() -> None:
    mission = line(coordinator="Nobody", seed=2)
    mission.tell(60.0, "Rob", m.Utterance("Rob", m.ToRobot("Zoe"), None, m.WhatDoing()))
    mission.air.run_until(90.0)
    assert mission.written(59.0) == [
        "Hi Zoe, I am Rob, what are you doing",
        "Hi Zoe, I am Max, Rob says, what are you doing",
        "Hi Rob, I am Zoe, I am free",
        "Hi Rob, I am Max, Zoe says, I am free",
    ]


def test_where_all_hear_each_other_nothing_is_passed_on() -> None:
    for seed in range(6):
        mission = Mission(("Rob", "Max", "Zoe"), TWO, seed=seed, coordinator="Rob")
        mission.run()
        assert mission.exactly_once
        assert relays(mission) == []


def test_back_within_earshot_they_speak_for_themselves() -> None:
    mission = line(coordinator="Nobody", seed=2)
    ask = m.Utterance("Rob", m.ToRobot("Zoe"), None, m.WhatDoing())
    mission.tell(60.0, "Rob", ask)
    mission.air.run_until(150.0)
    mission.bodies["Zoe"].place = mission.bodies["Rob"].place
    for at_s in (151.0, 171.0):
        mission.tell(at_s, "Rob", ask)
    mission.air.run_until(200.0)
    assert (
        mission.written(150.0)
        == [
            "Hi Zoe, I am Rob, what are you doing",
            "Hi Rob, I am Zoe, I am free",
        ]
        * 2
    )


def test_who_has_not_been_heard_is_not_spoken_for() -> None:
    mission = Mission(("Rob", "Max"), HERE, ("Zoe",), seed=2, coordinator="Nobody")
    mission.tell(60.0, "Rob", m.Utterance("Rob", m.ToRobot("Zoe"), None, m.WhatDoing()))
    mission.air.run_until(90.0)
    assert relays(mission) == []


@pytest.mark.parametrize("seed", range(8))
def test_with_some_loss_the_task_is_done_once_in_the_end(seed: int) -> None:
    mission = line(2, seed=seed, conditions=Conditions(0.15), limit_s=2000.0)
    mission.run()
    assert mission.watered == {1: 1}, mission.written()
    assert mission.robots["Rob"].board.all_done


def test_what_is_passed_on_with_the_own_name_is_not_obeyed() -> None:
    mission = Mission(("Rob",), HERE, ("Bot",), seed=2, coordinator="Nobody")
    order = m.Relayed("Rob", m.Order(m.TaskByNumber(1)))
    mission.tell(60.0, "Bot", m.Utterance("Bot", m.ToRobot("Rob"), None, order))
    mission.air.run_until(80.0)
    assert mission.robots["Rob"].state is State.READY
    assert mission.written(60.0, without=("Bot",)) == []


def test_what_says_two_things_is_not_passed_on() -> None:
    """No sentence can do that, and the robot between ended with an error."""
    mission = line(seed=3)
    mission.run()
    one, two = m.TaskByNumber(1), m.TaskByNumber(2)
    for statement in (m.Confirmed(one, also=two), m.Completed(one, also=two), m.Claim(one, two), m.Busy()):
        now = mission.air.now
        mission.robots["Max"].heard(m.Utterance("Zoe", m.ToRobot("Rob"), None, statement), now)
        mission.go_on(now + 30.0)
        passed_on = m.Relayed("Zoe", statement) in [u.statement for u in relays(mission)]
        assert passed_on is (statement == m.Busy())


NAMES, ONE = ("Rob", "Max", "Zoe"), m.TaskByNumber(1)


def met(name: str, robots: int = 1, **role: object) -> Coordination:
    """One of the three that is free, and has heard the other two."""
    task = TaskDefinition(1, "water the green rose", None, (Tend(5.0),), robots=robots)
    robot = Coordination(Role(name, "plant", roster=NAMES, **role), (task,), random.Random(1))  # type: ignore[arg-type]
    robot.knowledge.state = State.READY
    for other in NAMES:
        if other != name:
            robot.heard(m.Utterance(other, m.ToTeam("plant")), 0.0)
    return robot


def test_what_is_said_again_minutes_later_is_another_message() -> None:
    """It was passed on once then, and its repetition no more."""
    max_ = met("Max", volunteer=False)
    for now in (10.0, 300.0):
        passed_on = []
        for _ in range(3):
            max_.heard(m.Utterance("Rob", m.ToRobot("Zoe"), None, m.Order(ONE)), now)
            passed_on.append(max_.knowledge.floor.wants("relay rob zoe"))
            if passed_on[-1]:
                said, now = next_said(max_, now)
                assert said == m.Relayed("Rob", m.Order(ONE))
            now += 5.0
        assert passed_on == [True, True, False]


@pytest.mark.parametrize(("listener", "speaker"), [("Zoe", "Rob"), ("Rob", "Zoe")])
def test_who_is_heard_through_another_one_counts_as_present(listener: str, speaker: str) -> None:
    robot, now = met(listener, coordinator=listener == "Rob"), 1000.0
    peer = robot.peers.get(speaker)
    assert peer is not None
    peer.assigned = 1
    robot.board.complete(1, "Max")  # what is reported is known
    words = m.Order(ONE) if listener == "Zoe" else m.Completed(ONE)
    assert not robot.peers.is_present(speaker, now)
    robot.heard(m.Utterance("Max", m.ToRobot(listener), None, m.Relayed(speaker, words)), now)
    assert robot.peers.is_present(speaker, now)
    assert (peer.assigned is None) is (listener == "Rob"), "its order is carried out"


@pytest.mark.parametrize("robots", [1, 2])
def test_who_is_said_to_have_done_its_task_denies_it_unless_it_has_done_its_part(robots: int) -> None:
    rob = met("Rob", robots)
    if robots > 1:
        rob.board[1].acted_s = 5.0
    rob.heard(m.Utterance("Max", m.ToAll(), None, m.Relayed("Rob", m.Completed(ONE))), 10.0)
    assert rob.knowledge.floor.wants("answer Max") is (robots == 1)
