"""Memory in its own thread: order, a full disk, and our own mistakes."""

from __future__ import annotations

import asyncio
import os
import re
import sqlite3
import sys
import time
from collections.abc import Coroutine
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from structlog.testing import capture_logs

from hvcpd.config.settings import Settings
from hvcpd.coordination.actions import SaveChange, SaveDue, SavePeer, SaveStopped, SaveTask
from hvcpd.daemon.control_socket import socket_path
from hvcpd.daemon.journal_service import CHECK_S, LATER_S, MAX_LATER, MAX_WAITING, JournalService
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.errors import RunningError, StoreError
from hvcpd.memory.latch import Permit, StopLatch
from hvcpd.memory.recent import Recent
from hvcpd.memory.store import Store
from hvcpd.robot.records import GarbledRecord


@pytest.fixture
def wiring(tmp_path: Path) -> Wiring:
    return wire_up(Settings(name="Rob", state_dir=tmp_path / "state"))


def run(scene: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(scene, 20.0))


async def starts_stopped(wiring: Wiring) -> None:
    """The next start of the same robot, which is stopped."""
    again = JournalService(wiring)
    await again.open()
    assert again.stopped
    await again.close()


def test_all_that_was_written_is_there_after_closing(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        assert (await journal.open()).tasks == {}
        for second in range(100):
            journal.write((GarbledRecord(second, second, second + 1.0),), float(second))
        journal.write((SaveTask(2, "done", "Bot"),), 100.0)
        await journal.close()

    run(scene())
    store = Store(wiring.settings.memory_path)
    assert [record.at_s for record in store.transcript()] == [float(second) for second in range(100)]
    assert [(task.number, task.state) for task in store.tasks()] == [(2, "done")]
    store.close()


def test_changes_of_tasks_and_what_they_were_done_for_are_remembered(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        await journal.open()
        journal.write((SaveDue(1, 1.7e9), SaveChange(1, 2, True), SaveChange(2, 1, True), SaveChange(2, 2, False)), 1.0)
        await journal.close()
        again = JournalService(wiring)
        memory = await again.open()
        assert memory.dues == {1: 1.7e9}
        assert memory.changes == {1: (2, True), 2: (2, False)}
        await again.close()

    run(scene())


def test_what_is_remembered_at_the_next_start(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        await journal.open()
        journal.write((SaveTask(2, "done", "Bot"),), 1.0)
        await journal.close()
        again = JournalService(wiring)
        assert (await again.open()).tasks == {2: ("done", "Bot")}
        await again.close()

    run(scene())


def test_another_process_at_the_memory_costs_records_but_not_the_mission(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        await journal.open()
        other = sqlite3.connect(wiring.settings.memory_path, isolation_level=None)
        other.execute("BEGIN EXCLUSIVE")
        journal.write((GarbledRecord(1.0, 1.0, 2.0),), 1.0)
        await journal.settled()
        assert journal.lost == 1
        other.execute("ROLLBACK")
        other.close()
        journal.write((GarbledRecord(3.0, 3.0, 4.0),), 3.0)
        await journal.close()

    with capture_logs() as logs:
        run(scene())
    assert [line["event"] for line in logs] == ["memory failed", "memory works again"]
    assert "another process uses it" in logs[0]["reason"]


def test_what_only_this_robot_knows_is_written_at_once_and_takes_the_rest_along(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        await journal.open()
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
        await journal.close()

    run(scene())


def test_what_others_do_outlives_a_robot_that_is_killed(wiring: Wiring) -> None:
    async def scene() -> None:
        killed = JournalService(wiring)
        await killed.open()
        killed.write((SaveTask(1, "claimed", "Bot"), SaveTask(2, "claimed", "Bot")), 1.0)
        killed.write((SaveTask(2, "done", "Bot"), SaveDue(2, 1.7e9)), 2.0)
        while killed._flights:
            await asyncio.sleep(0)
        assert kept(wiring) == (0, [], [])
        lock, killed._lock = killed._lock, None
        assert lock is not None
        os.close(lock)  # as the kernel would
        again = JournalService(wiring)
        plan = await again.open()
        assert (plan.tasks, plan.dues) == ({1: ("claimed", "Bot"), 2: ("done", "Bot")}, {2: 1.7e9})
        await again.close()
        await killed.close()

    run(scene())


def test_what_is_recent_belongs_to_one_memory(tmp_path: Path) -> None:
    path = tmp_path / "rob.recent"
    Recent(path, 1).keep([SaveTask(1, "claimed", "Bot")])
    assert Recent(path, 2).left() == []
    again = Recent(path, 1)
    assert again.left() == [SaveTask(1, "claimed", "Bot")]
    again.keep([SaveTask(1, "done", "Bot"), SaveChange(1, 1, True)])
    assert Recent(path, 1).left() == [SaveTask(1, "done", "Bot"), SaveChange(1, 1, True)]
    path.write_bytes(b"[")
    assert Recent(path, 1).left() == []


def test_without_a_runtime_folder_all_is_written_at_once(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        await journal.open()
        socket_path(wiring.settings).with_suffix(".recent.new").mkdir()
        journal.write((SaveTask(1, "claimed", "Bot"),), 1.0)
        while kept(wiring) != (0, [], ["claimed"]):
            await asyncio.sleep(0)
        await journal.close()

    run(scene())


def test_each_utterance_has_the_time_when_it_was_told(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        await journal.open()
        for now in (10.0, 70.0, 100.0):
            journal.write((GarbledRecord(now, now, now + 1.0),), now)
        journal.write((), 110.0)
        walls_s = [row.wall_s or 0.0 for row in await journal.transcript(0, 0.0, 10)]
        assert [round(wall_s - walls_s[0]) for wall_s in walls_s] == [0, 60, 90]
        assert walls_s[-1] == pytest.approx(time.time() - 10.0, abs=20.0)
        await journal.close()

    run(scene())


def kept(wiring: Wiring) -> tuple[int, list[float], list[str]]:
    """What is on the disk: utterances, when peers were heard, states of tasks."""
    with closing(sqlite3.connect(wiring.settings.memory_path)) as db:
        (utterances,) = db.execute("SELECT count(*) FROM transcript").fetchone()
        heard = [at_s for (at_s,) in db.execute("SELECT last_heard_s FROM peers")]
        return utterances, heard, [state for (state,) in db.execute("SELECT state FROM tasks")]


def test_what_waits_is_bounded(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        await journal.open()
        for _ in range(MAX_WAITING + MAX_LATER):  # without letting the loop turn
            journal.write((GarbledRecord(1.0, 1.0, 2.0),), 1.0)
        assert journal.lost == MAX_LATER
        await journal.close()

    with capture_logs() as logs:
        run(scene())
    assert [line["event"] for line in logs].count("memory failed") == 1


def test_a_memory_that_cannot_be_opened(wiring: Wiring) -> None:
    wiring.settings.state_dir.write_text("in the way")

    async def scene() -> None:
        journal = JournalService(wiring)
        with pytest.raises(StoreError, match="state_dir"):
            await journal.open()
        await journal.close()

    run(scene())


def test_our_own_mistake_is_raised(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        await journal.open()
        journal.write((SaveTask(77, "done", "Bot"),), 1.0)  # there is no such task
        await journal.settled()
        with pytest.raises(KeyError):
            journal.write((SaveTask(1, "done", "Bot"),), 1.0)
        await journal.close()

    run(scene())


def permit(wiring: Wiring) -> Permit | None:
    """The latch's decision about the next start."""
    found = StopLatch(wiring.latch_path).read()
    return found.permit if found is not None else None


def test_what_must_not_be_lost_is_written_as_soon_as_the_disk_works_again(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        await journal.open()
        assert permit(wiring) is Permit.FREE
        other = sqlite3.connect(wiring.settings.memory_path, isolation_level=None)
        other.execute("BEGIN EXCLUSIVE")
        journal.write((SaveTask(1, "claimed", "Rob"), SaveTask(2, "done", "Bot")), 1.0)
        await journal.settled()
        assert journal.fault is not None
        assert permit(wiring) is Permit.UNSURE, "killed now, the robot would start stopped"
        journal.write((SaveTask(1, "done", "Rob"),), 1.5)
        await journal.settled()
        other.execute("ROLLBACK")
        other.close()
        journal.write((), 10.0)
        await journal.settled()
        assert (journal.fault, journal.lost) == (None, 0)
        assert permit(wiring) is Permit.FREE
        await journal.close()
        again = JournalService(wiring)
        assert (await again.open()).tasks == {1: ("done", "Rob"), 2: ("done", "Bot")}
        assert again.stopped is False
        await again.close()

    run(scene())


def test_a_stop_is_kept_before_it_is_answered_and_whatever_waits_for_the_disk(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        journal.stop()  # before the memory is open
        opening = asyncio.ensure_future(journal.open())
        assert await journal.stop_kept() is None
        await opening
        assert permit(wiring) is Permit.STOPPED
        journal.stop(False)
        assert await journal.stop_kept() is None
        assert permit(wiring) is Permit.FREE
        other = sqlite3.connect(wiring.settings.memory_path, isolation_level=None)
        other.execute("BEGIN EXCLUSIVE")
        journal.write((GarbledRecord(1.0, 1.0, 2.0), SaveStopped(True)), 1.0)
        assert await journal.stop_kept() is None
        assert permit(wiring) is Permit.STOPPED, "though nothing else can be written"
        other.execute("ROLLBACK")
        other.close()
        await journal.close()
        await starts_stopped(wiring)

    run(scene())


def test_resume_and_stop_in_one_breath_leave_the_latch_stopped_all_the_while(wiring: Wiring) -> None:
    written: list[str] = []

    def note(event: str, arguments: tuple[object, ...]) -> None:  # an audit hook stays for good, and then notes nothing
        if noting and event == "os.rename" and arguments[1] == str(wiring.latch_path):
            written.append(Path(str(arguments[0])).read_text().split()[0])

    async def scene() -> None:
        journal = JournalService(wiring)
        await journal.open()
        journal.stop()
        assert await journal.stop_kept() is None
        journal.write((SaveStopped(False), SaveStopped(True)), 1.0)
        await journal.settled()
        await journal.close()

    sys.addaudithook(note)
    noting = True
    try:
        run(scene())
    finally:
        noting = False
    assert written
    assert "free" not in written[written.index("stopped") :]


def test_a_memory_has_one_daemon_whichever_sockets_they_have(wiring: Wiring) -> None:
    async def scene() -> None:
        journal, other = JournalService(wiring), JournalService(wiring)
        await journal.open()
        journal.stop()
        assert await journal.stop_kept() is None
        with pytest.raises(RunningError, match=re.escape(str(wiring.settings.memory_path))):
            await other.open()
        await other.close()
        assert permit(wiring) is Permit.STOPPED
        await journal.close()
        await starts_stopped(wiring)

    run(scene())


def test_a_file_that_cannot_be_used_costs_the_memory_and_the_robot_starts_stopped(wiring: Wiring) -> None:
    wiring.settings.state_dir.mkdir()
    wiring.settings.memory_path.mkdir()

    async def scene() -> None:
        journal = JournalService(wiring)
        assert (await journal.open()).tasks == {}
        assert journal.stopped
        assert journal.fault is not None
        assert journal.fault in (journal.loss or "")
        journal.write((SaveStopped(False), SaveTask(1, "done", "Rob"), GarbledRecord(1.0, 1.0, 2.0)), 1.0)
        journal.write((), 5.0)
        await journal.close()
        assert permit(wiring) is Permit.UNSURE, "it was told to resume, and nobody knows what it has done since"

    with capture_logs() as logs:
        run(scene())
    (lost,) = [line for line in logs if line["event"] == "memory lost"]
    assert "set `state_dir` to another" in lost["reason"]


def test_a_file_that_was_cut_is_noticed_though_nothing_is_written(wiring: Wiring) -> None:
    async def scene() -> None:
        journal = JournalService(wiring)
        await journal.open()
        os.truncate(wiring.settings.memory_path, 0)
        journal.write((), CHECK_S)
        await journal.settled()
        assert journal.fault is not None
        assert "cut short" in journal.fault
        await journal.close()
        await starts_stopped(wiring)

    run(scene())
