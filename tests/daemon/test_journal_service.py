"""Memory in its own thread: order, a full disk, and our own mistakes."""

from __future__ import annotations

import asyncio
import json
import sqlite3
import time
from contextlib import closing
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from hvcpd.coordination.actions import SaveChange, SaveDue, SavePeer, SaveTask
from hvcpd.daemon.control_socket import socket_path
from hvcpd.daemon.journal_service import LATER_S, MAX_LATER, MAX_WAITING
from hvcpd.daemon.wiring import Wiring
from hvcpd.memory.recent import Recent
from hvcpd.memory.store import Store
from hvcpd.robot.records import GarbledRecord
from tests.daemon.journals import kill, opened, taken


async def test_all_that_was_written_is_there_after_closing(wiring: Wiring) -> None:
    async with opened(wiring) as (journal, memory):
        assert memory.tasks == {}
        for second in range(100):
            journal.write((GarbledRecord(second, second, second + 1.0),), float(second))
        journal.write((SaveTask(2, "done", "Bot"),), 100.0)
    with closing(Store(wiring.settings.memory_path)) as store:
        assert [record.at_s for record in store.transcript()] == [float(second) for second in range(100)]
        assert [(task.number, task.state) for task in store.tasks()] == [(2, "done")]


async def test_changes_of_tasks_and_what_they_were_done_for_are_remembered(wiring: Wiring) -> None:
    async with opened(wiring) as (journal, _):
        journal.write((SaveDue(1, 1.7e9), SaveChange(1, 2, True), SaveChange(2, 1, True), SaveChange(2, 2, False)), 1.0)
    async with opened(wiring) as (_, memory):
        assert memory.dues == {1: 1.7e9}
        assert memory.changes == {1: (2, True), 2: (2, False)}


async def test_what_was_done_by_a_clock_that_was_ahead_gives_way_to_what_is_done_by_the_right_one(
    wiring: Wiring,
) -> None:
    for due_s in (1.8e9, 1.7e9):
        async with opened(wiring) as (journal, _):
            journal.write((SaveDue(1, due_s),), 1.0)
    async with opened(wiring) as (_, memory):
        assert memory.dues == {1: 1.7e9}


async def test_of_two_changes_with_one_number_the_last_one_is_remembered(wiring: Wiring) -> None:
    """Two people want opposite things at one time: "do it again" holds."""
    async with opened(wiring) as (journal, _):
        journal.write((SaveChange(1, 1, True),), 1.0)
        journal.write((SaveChange(1, 1, False),), 2.0)
    async with opened(wiring) as (_, memory):
        assert memory.changes == {1: (1, False)}


async def test_what_is_remembered_at_the_next_start(wiring: Wiring) -> None:
    async with opened(wiring) as (journal, _):
        journal.write((SaveTask(2, "done", "Bot"),), 1.0)
    async with opened(wiring) as (_, memory):
        assert memory.tasks == {2: ("done", "Bot")}


async def test_another_process_at_the_memory_costs_records_but_not_the_mission(wiring: Wiring) -> None:
    with capture_logs() as logs:
        async with opened(wiring) as (journal, _):
            with taken(wiring):
                journal.write((GarbledRecord(1.0, 1.0, 2.0),), 1.0)
                await journal.settled()
                assert journal.lost == 1
            journal.write((GarbledRecord(3.0, 3.0, 4.0),), 3.0)
    assert [line["event"] for line in logs] == ["memory failed", "memory works again"]
    assert "another process uses it" in logs[0]["reason"]


async def test_what_only_this_robot_knows_is_written_at_once_and_takes_the_rest_along(wiring: Wiring) -> None:
    async with opened(wiring) as (journal, _):
        for at_s in (1.0, 2.0):
            journal.write((GarbledRecord(at_s, at_s, at_s + 1.0), SavePeer("Bot", "plant", at_s)), at_s)
            while kept(wiring) != (1, [1.0], []):  # a new name does not wait
                await asyncio.sleep(0)
        journal.write((SaveTask(1, "claimed", "Bot"),), 2.5)
        journal.write((SaveTask(2, "claimed", "Rob"),), 3.0)
        while kept(wiring) != (2, [2.0], ["claimed", "claimed"]):
            await asyncio.sleep(0)
        journal.write((SavePeer("Bot", "plant", 4.0), SaveTask(1, "done", "Bot")), 4.0)
        journal.write((), 4.0 + LATER_S)
        while kept(wiring) != (2, [4.0], ["done", "claimed"]):
            await asyncio.sleep(0)


async def test_what_others_do_outlives_a_robot_that_is_killed(wiring: Wiring) -> None:
    async with opened(wiring) as (killed, _):
        killed.write((SaveTask(1, "claimed", "Bot"), SaveTask(2, "claimed", "Bot")), 1.0)
        killed.write((SaveTask(2, "done", "Bot"), SaveDue(2, 1.7e9)), 2.0)
        await kill(killed)
        assert kept(wiring) == (0, [], [])
        async with opened(wiring) as (_, plan):
            assert (plan.tasks, plan.dues) == ({1: ("claimed", "Bot"), 2: ("done", "Bot")}, {2: 1.7e9})


def test_what_is_recent_belongs_to_one_memory(tmp_path: Path) -> None:
    path, names = tmp_path / "rob.recent", {1: "water the rose"}
    Recent(path, 1).keep([SaveTask(1, "claimed", "Bot")], names)
    assert Recent(path, 2).left(names) == []
    again = Recent(path, 1)
    assert again.left(names) == [SaveTask(1, "claimed", "Bot")]
    again.keep([SaveTask(1, "done", "Bot"), SaveChange(1, 1, True)], names)
    assert Recent(path, 1).left(names) == [SaveTask(1, "done", "Bot"), SaveChange(1, 1, True)]
    path.write_bytes(b"[")
    assert Recent(path, 1).left(names) == []


@pytest.mark.parametrize(
    "record",
    [
        ["SaveTask", "dome", "Bot"],
        ["SaveTask", "done", 5],
        ["SaveDue", "soon"],
        ["SaveDue", 1e400],
        ["SaveChange", 10**30, True],
        ["SaveChange", 1],
        ["SaveWorld", 1],
    ],
)
def test_what_is_recent_and_no_record_is_left_out(tmp_path: Path, record: list[object]) -> None:
    """The daemon ended with a traceback at every start."""
    path, names = tmp_path / "rob.recent", {1: "water the rose"}
    path.write_text(json.dumps({"memory": 1, "records": [["water the rose", *record]]}))
    assert Recent(path, 1).left(names) == []


async def test_without_a_runtime_folder_all_is_written_at_once(wiring: Wiring) -> None:
    async with opened(wiring) as (journal, _):
        socket_path(wiring.settings).with_suffix(".recent.new").mkdir()
        journal.write((SaveTask(1, "claimed", "Bot"),), 1.0)
        while kept(wiring) != (0, [], ["claimed"]):
            await asyncio.sleep(0)


async def test_a_runtime_folder_that_is_full_by_now_does_not_bring_back_what_was_known_before(wiring: Wiring) -> None:
    """The robot forgot at its next start that the task is done, and did it again."""
    async with opened(wiring) as (journal, _):
        journal.write((SaveTask(1, "claimed", "Rob"),), 1.0)
        await journal.settled()
        socket_path(wiring.settings).with_suffix(".recent.new").mkdir()
        journal.write((SaveTask(1, "done", "Rob"),), 2.0)
    async with opened(wiring) as (_, memory):
        assert memory.tasks == {1: ("done", "Rob")}


async def test_each_utterance_has_the_time_when_it_was_told(wiring: Wiring) -> None:
    async with opened(wiring) as (journal, _):
        for now in (10.0, 70.0, 100.0):
            journal.write((GarbledRecord(now, now, now + 1.0),), now)
        journal.write((), 110.0)
        walls_s = [row.wall_s or 0.0 for row in await journal.transcript(0, 0.0, 10)]
        assert [round(wall_s - walls_s[0]) for wall_s in walls_s] == [0, 60, 90]
        assert walls_s[-1] == pytest.approx(time.time() - 10.0, abs=20.0)


def kept(wiring: Wiring) -> tuple[int, list[float], list[str]]:
    """What is on the disk: utterances, when peers were heard, states of tasks."""
    with closing(sqlite3.connect(wiring.settings.memory_path)) as db:
        (utterances,) = db.execute("SELECT count(*) FROM transcript").fetchone()
        heard = [at_s for (at_s,) in db.execute("SELECT last_heard_s FROM peers")]
        return utterances, heard, [state for (state,) in db.execute("SELECT state FROM tasks")]


async def test_what_waits_is_bounded(wiring: Wiring) -> None:
    with capture_logs() as logs:
        async with opened(wiring) as (journal, _):
            for _ in range(MAX_WAITING + MAX_LATER):  # without letting the loop turn
                journal.write((GarbledRecord(1.0, 1.0, 2.0),), 1.0)
            assert journal.lost == MAX_LATER
    assert [line["event"] for line in logs].count("memory failed") == 1


async def test_our_own_mistake_is_raised(wiring: Wiring) -> None:
    async with opened(wiring) as (journal, _):
        journal.write((SaveTask(77, "done", "Bot"),), 1.0)  # there is no such task
        await journal.settled()
        with pytest.raises(KeyError):
            journal.write((SaveTask(1, "done", "Bot"),), 1.0)
