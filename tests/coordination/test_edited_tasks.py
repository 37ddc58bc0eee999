"""Tasks that people edit, under the same number and name, while robots work or between two starts."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hil_fakes.word_mission import Outage
from hvcpd.config.tasks import GoTo, Place, TaskDefinition, Wait
from hvcpd.coordination.states import State
from tests.coordination.mission import Mission, plants

ASKED_S, END_S = 400.0, 1300.0


@pytest.mark.parametrize("state", [State.GOING, State.ANNOUNCING])
def test_a_task_that_is_moved_before_a_robot_begins_it_is_done_at_its_new_place(state: State) -> None:
    """It did the new work at the old place."""

    def table_at(place: Place) -> TaskDefinition:
        return TaskDefinition(1, "carry the table", place, (GoTo(place), Wait(5.0)), robots=2)

    mission, there = Mission(("Rob", "Bot"), (table_at(Place(-3.0, -3.0)),), seed=1), Place(2.0, 2.0)
    mission.until("Rob", state)
    for robot in mission.robots.values():
        robot.reconfigure(mission.air.now, robot.role, (table_at(there),))
    mission.go_on(END_S)
    assert mission.watered == {1: 2}
    assert all(body.place.distance_m(there) < 0.01 for body in mission.bodies.values())


@pytest.mark.parametrize("restarts", [False, True])
def test_what_is_to_be_done_on_demand_from_now_on_is_done_by_nobody_until_somebody_asks(restarts: bool) -> None:
    """It was open before, and was done."""
    one, two = plants(2)
    tasks = (one, replace(two, on_demand=True))
    mission = Mission(("Rob",), (one, two), ("Anna",), seed=1)
    if restarts:
        mission.plan = replace(mission.plan, tasks=tasks)
        mission.saved["Rob"][2] = ("open", None)
        mission.fail(Outage("Rob", 0.0, 1.0))
    else:
        mission.robots["Rob"].reconfigure(0.0, mission.robots["Rob"].role, tasks)
    mission.air.run_until(ASKED_S)
    assert mission.watered == {1: 1}
    mission.hear(ASKED_S, "Hi all, I am Anna, task two again")
    mission.air.run_until(END_S)
    assert mission.watered == {1: 1, 2: 1}
    assert mission.robots["Rob"].board.all_done
