"""What the settings make of a robot."""

import random
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from hvcpd.assembly.make import make_robot
from hvcpd.assembly.plan import MemoryPlan
from hvcpd.config.recurrence import Recurrence
from hvcpd.config.settings import Settings, WaitSettings, WheelSettings
from hvcpd.config.task_changes import TaskChanges
from hvcpd.config.tasks import TaskDefinition, Wait
from hvcpd.coordination.actions import Role, Timing
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.entry import DONE, OPEN
from hvcpd.daemon.devices import make_wheels
from hvcpd.daemon.wiring import wire_up
from hvcpd.errors import ConfigError
from hvcpd.memory.people import person_path, write_person
from hvcpd.people.enrolled import Person
from tests.config.test_recurrence import calls


def test_a_robot_knows_what_it_cannot_do(tmp_path: Path) -> None:
    wiring = wire_up(Settings(name="Rob", state_dir=tmp_path, unable=(2, 3)))
    assert wiring.plan().role.unable == {2, 3}


def test_a_robot_without_wheels_cannot_do_what_drives(tmp_path: Path) -> None:
    tasks = tmp_path / "tasks.yaml"
    tasks.write_text(
        "tasks:\n"
        "  - {number: 1, name: water the rose, place: {x_m: 1, y_m: 0}, actions: [go to place, {water: 1}]}\n"
        "  - {number: 2, name: water the lily, place: {x_m: 0, y_m: 0}, actions: [{water: 1}]}\n"
        "  - {number: 3, name: clean the room, place: {x_m: 0, y_m: 0}, actions: [{turn: 90}]}\n"
    )
    standing = Settings(name="Rob", state_dir=tmp_path, tasks=tasks, wheels=WheelSettings(driver="none"))
    assert wire_up(standing).plan().role.unable == {1, 3}
    assert wire_up(replace(standing, unable=(2,))).unable == {1, 2, 3}
    assert wire_up(replace(standing, wheels=WheelSettings())).unable == frozenset()


def test_it_waits_for_others_as_long_as_it_is_told(tmp_path: Path) -> None:
    wiring = wire_up(Settings(name="Rob", state_dir=tmp_path, waits=WaitSettings(900.0, 300.0, 8.0)))
    timing = wiring.plan().timing
    assert timing == Timing(absent_s=900.0, lease_s=300.0, answer_s=8.0)
    assert wire_up(Settings(name="Rob", state_dir=tmp_path)).plan().timing == Timing(), "the same defaults"


def test_a_robot_is_made_with_these_times(tmp_path: Path) -> None:
    wiring = wire_up(Settings(name="Rob", state_dir=tmp_path, waits=WaitSettings(absent_s=900.0)))
    robot = make_robot(wiring.plan(), wiring.sound)
    assert robot.coordination.knowledge.timing.absent_s == 900.0


def test_the_times_of_a_rule_are_known_before_the_robot_is_at_work(tmp_path: Path) -> None:
    tasks = tmp_path / "tasks.yaml"
    tasks.write_text("tasks: [{number: 1, name: feed the cat, every: FREQ=HOURLY, actions: [{wait: 1}]}]")
    wiring = wire_up(Settings(name="Rob", state_dir=tmp_path, tasks=tasks))
    every = wiring.tasks.tasks[0].every
    assert every is not None
    assert calls(partial(every.last, time.time())) < 500, "not for each hour since 2024"


@pytest.mark.parametrize("clock", [True, False])
def test_what_was_done_is_not_due_again_because_the_clock_was_not_set_at_first(tmp_path: Path, clock: bool) -> None:
    wiring, due_s = wire_up(Settings(name="Rob", state_dir=tmp_path, clock=clock)), 1_790_000_000 // 3600 * 3600.0
    task = TaskDefinition(1, "water the rose", None, (Wait(20.0),), every=Recurrence("1 h"))
    rob = Coordination(Role("Rob"), (task,), random.Random(1), remembered={1: (DONE, "Rob")}, dues={1: due_s})
    for wall_s, state in ((300.0, DONE), (due_s + 1200.0, DONE), (due_s + 3600.0, OPEN if clock else DONE)):
        if (known_s := wiring.known_s(wall_s)) is not None:
            rob.set_clock(known_s, 0.0)
        assert rob.board[1].state == state


def test_a_task_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"unable: .* has no task 77; its numbers are 1, 2"):
        wire_up(Settings(name="Rob", state_dir=tmp_path, unable=(77,)))


def test_a_clash_of_an_added_task_is_told_of_that_task_and_not_of_the_file(tmp_path: Path) -> None:
    added = {"number": 6, "name": "stop the music", "actions": [{"wait": 1}]}
    with pytest.raises(ConfigError) as fault:
        wire_up(Settings(name="Rob", state_dir=tmp_path), changes=TaskChanges().with_added(added))
    assert str(fault.value).startswith("task 6: the task 'stop the music' can be mistaken")


def test_only_a_name_that_the_others_were_told_is_not_spelled(tmp_path: Path) -> None:
    listed = {name: wire_up(Settings(name=name, state_dir=tmp_path)).plan().role.listed for name in ("Rob", "Zorg")}
    assert listed == {"Rob": True, "Zorg": False}


def test_names_that_were_heard_are_known_again(tmp_path: Path) -> None:
    wiring = wire_up(Settings(name="Rob", state_dir=tmp_path))
    assert wiring.plan(heard=("Zorg", "rob", "all")).team.names == ("Rob", "Bot", "Zorg")


def test_of_what_is_remembered_names_are_as_they_are_written_now(tmp_path: Path) -> None:
    """A robot whose settings write a peer in capitals ended when it was to say what that peer had done before."""
    memory = MemoryPlan({1: ("done", "bot"), 2: ("claimed", "Gus"), 3: ("open", None)}, stopped=True)
    plan = wire_up(Settings(name="Rob", state_dir=tmp_path)).plan(memory)
    assert plan.memory == replace(memory, tasks={1: ("done", "Bot"), 2: ("claimed", None), 3: ("open", None)})


def test_what_cannot_be_a_name_is_forgotten(tmp_path: Path) -> None:
    """A failing card had made it one of 5,000 letters, and the daemon never got beyond its sound."""
    wiring = wire_up(Settings(name="Rob", state_dir=tmp_path))
    assert wiring.names_with(("", "Zo\x1be", "Zorg" * 10, "Zorg")) == ("Rob", "Bot", "Zorg")


def test_no_wheels_by_the_settings() -> None:
    assert make_wheels(WheelSettings(driver="none")) is None
    assert make_wheels(WheelSettings()) is not None


def test_a_robot_starts_whatever_the_people_are_called_who_are_enrolled(tmp_path: Path) -> None:
    """One that was called "friend", in a file from elsewhere, kept it from starting."""
    for name in ("Anna", "friend"):
        write_person(person_path(tmp_path, name), Person(name))
    wiring = wire_up(Settings(name="Rob", state_dir=tmp_path))
    assert wiring.people.keys() == {"anna"}
    assert "hvcpctl enrol friend --remove" in wiring.unknown[0]
