"""The score follows what a task asks for, judged by where the robot truly stood."""

import pytest

from hil_fakes.scorekeeper import Scorekeeper
from hvcpd.config.tasks import Action, Forward, GoTo, Place, SayAction, TaskDefinition, TaskRepository, Tend, Wait
from hvcpd.ports import Pose
from hvcpd.reporting.events import Performed
from hvcpd.robot.records import PerformedRecord

HOME, PLANT, DOOR = Place(0.0, 0.0), Place(3.0, 0.0), Place(0.0, 2.0)
SAY, WATER, WAIT = SayAction("hello"), Tend(5.0), Wait(5.0)
BLOCK_S = 0.025


def done(
    actions: tuple[Action, ...], way: tuple[Place, ...], place: Place | None = PLANT, speed_m_s: float = 0.2
) -> bool:
    """Whether the task counts as done by a robot that begins at home, drives this way, and stands a second at each of
    its points."""
    score = Scorekeeper(("Rob",), TaskRepository((TaskDefinition(1, "a task", place, actions),)), lambda _event: None)
    now, here = 0.0, HOME

    def live(pose: Place, records: tuple[object, ...] = ()) -> None:
        nonlocal now
        now += BLOCK_S
        score.note("Rob", 0.0, records, Pose(pose.x_m, pose.y_m), now)

    for goal in (HOME, *way):
        n = max(round(max(abs(goal.x_m - here.x_m), abs(goal.y_m - here.y_m)) / speed_m_s / BLOCK_S), 1)
        for k in range(n):
            share = (k + 1) / n
            live(Place(here.x_m + share * (goal.x_m - here.x_m), here.y_m + share * (goal.y_m - here.y_m)))
        for _ in range(40):
            live(goal)
        here = goal
    live(here, (PerformedRecord(now, 1),))
    return score.summary(now, 1.0, 1, "volunteer").lost == 0


@pytest.mark.parametrize(
    "actions",
    [(SAY,), (WAIT,), (WAIT, SAY), (Forward(0.5),)],
    ids=["say", "wait", "both", "forward"],
)
def test_what_is_not_done_at_the_place_is_done_anywhere(actions: tuple[Action, ...]) -> None:
    assert done(actions, way=())


def test_who_is_sent_to_a_place_must_have_stood_there() -> None:
    there = (GoTo(PLANT),)
    assert done(there, (PLANT,))
    assert done((*there, SAY), (PLANT,))
    assert not done((*there, SAY), (Place(2.6, 0.0),))
    assert not done((*there, SAY), (Place(4.0, 0.0),)), "it only drove past"


def test_watering_needs_the_plant_even_if_no_action_leads_there() -> None:
    assert not done((WATER,), way=())
    assert done((Forward(3.0), WATER), (PLANT,))
    assert done((WATER,), way=(), place=None)


def test_a_round_counts_if_it_stood_at_each_place_and_is_told_at_the_plant() -> None:
    actions = (GoTo(DOOR), GoTo(PLANT), WATER, GoTo(HOME))
    assert done(actions, (DOOR, PLANT, HOME))
    assert not done(actions, (PLANT, HOME))
    assert not done(actions, (DOOR, HOME))


def test_what_was_stood_at_for_the_last_task_does_not_count_for_the_next() -> None:
    task = TaskDefinition(1, "a task", PLANT, (GoTo(PLANT), WATER))
    score = Scorekeeper(("Rob",), TaskRepository((task,)), lambda _event: None)
    at_s = [BLOCK_S * (k + 1) for k in range(120)]
    for now in at_s[:40]:
        score.note("Rob", 0.0, (), Pose(PLANT.x_m, PLANT.y_m), now)
    score.note("Rob", 0.0, (PerformedRecord(at_s[40], 1),), Pose(PLANT.x_m, PLANT.y_m), at_s[40])
    for now in at_s[41:119]:
        score.note("Rob", 0.0, (), Pose(HOME.x_m, HOME.y_m), now)
    score.note("Rob", 0.0, (PerformedRecord(at_s[119], 1),), Pose(HOME.x_m, HOME.y_m), at_s[119])
    assert len([event for event in score.events if isinstance(event, Performed)]) == 1
