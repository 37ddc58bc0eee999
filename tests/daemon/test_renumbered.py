"""A task file that was edited while its robot was off: tasks are told apart by their names."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace

import pytest

from hvcpd.assembly.plan import MemoryPlan
from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import SaveChange, SaveDue, SaveTask
from hvcpd.daemon.journal_service import JournalService
from hvcpd.daemon.wiring import Wiring
from hvcpd.memory.store import Store
from hvcpd.robot.records import Record
from tests.daemon.journals import kill


def edited(wiring: Wiring, moved: Mapping[int, int], **renamed: str) -> Wiring:
    """The tasks under other numbers (0: left out), and task `task5` with another name."""
    tasks = [replace(task, number=moved.get(task.number, task.number)) for task in wiring.tasks.tasks]
    tasks = [replace(task, name=renamed.get(f"task{task.number}", task.name)) for task in tasks]
    return replace(wiring, tasks=TaskRepository(tuple(task for task in tasks if task.number)))


def live(wiring: Wiring, *records: Record, killed: bool = False) -> MemoryPlan:
    """What a robot remembers at its start, which then writes these records and is switched off, or killed."""

    async def life() -> MemoryPlan:
        journal = JournalService(wiring)
        plan = await journal.open()
        journal.write(records, 1.0)
        if killed:
            await kill(journal)
        else:
            await journal.close()
        return plan

    return asyncio.run(asyncio.wait_for(life(), 20.0))


def test_counters_that_a_failing_card_has_changed_are_left_out(wiring: Wiring) -> None:
    """The file passes SQLite's check, and the daemon ended with a traceback at every start."""
    live(wiring, SaveTask(1, "done", "Rob"), SaveDue(1, 1.7e9), SaveChange(1, 3, False))
    with closing(Store(wiring.settings.memory_path)) as store:
        for name, value in (("due q", 3), ("change ", 3), ("due 2", 2**62), ("due 3", -1)):
            store.set_counter(name, value)
    plan = live(wiring)
    assert (plan.dues, plan.changes) == ({1: 1.7e9}, {1: (3, False)})


@pytest.mark.parametrize("killed", [False, True])
def test_a_task_keeps_its_state_under_another_number(wiring: Wiring, killed: bool) -> None:
    states = SaveTask(1, "done", "Bot"), SaveTask(2, "claimed", "Bot"), SaveTask(3, "done", "Bot")
    live(wiring, *states, SaveDue(1, 1.7e9), SaveChange(1, 2, False), SaveChange(2, 1, True), killed=killed)
    swapped = edited(wiring, {1: 2, 2: 1, 3: 9})
    for _ in range(2):  # it is kept so
        plan = live(swapped)
        assert plan.tasks == {1: ("claimed", "Bot"), 2: ("done", "Bot"), 9: ("done", "Bot")}
        assert plan.dues == {2: 1.7e9}
        assert plan.changes == {1: (1, True), 2: (2, False)}


@pytest.mark.parametrize("killed", [False, True])
def test_another_task_under_the_number_of_one_that_is_done_is_still_to_be_done(wiring: Wiring, killed: bool) -> None:
    live(wiring, SaveTask(5, "done", "Rob"), SaveDue(5, 1.7e9), SaveChange(5, 1, True), killed=killed)
    other = edited(wiring, {}, task5="dust the shelves")
    plan = live(other, SaveTask(5, "claimed", "Bot"))
    assert (plan.tasks, plan.dues, plan.changes) == ({}, {}, {})
    assert live(other).tasks == {5: ("claimed", "Bot")}


def test_a_task_that_was_left_out_of_the_file_for_a_time_is_remembered(wiring: Wiring) -> None:
    live(wiring, SaveTask(5, "done", "Rob"))
    assert live(edited(wiring, {5: 0})).tasks == {}
    assert live(wiring).tasks == {5: ("done", "Rob")}
