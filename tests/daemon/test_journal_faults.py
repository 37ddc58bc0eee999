"""The latch and what must not be lost, on a full disk, in files that cannot be used, and with two daemons."""

from __future__ import annotations

import asyncio
import os
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from hvcpd.coordination.actions import SaveStopped, SaveTask
from hvcpd.daemon.journal_service import CHECK_S, JournalService
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.errors import RunningError, StoreError
from hvcpd.memory.latch import Permit, StopLatch
from hvcpd.memory.store_file import MAX_SET_ASIDE
from hvcpd.robot.records import GarbledRecord
from tests.daemon.journals import opened, taken
from tests.full_disk import no_new_bytes


async def starts_stopped(wiring: Wiring) -> None:
    """The next start of the same robot, which is stopped."""
    async with opened(wiring) as (again, _):
        assert again.stopped


async def test_a_memory_that_cannot_be_opened(wiring: Wiring) -> None:
    wiring.settings.state_dir.write_text("in the way")
    journal = JournalService(wiring)
    with pytest.raises(StoreError, match="state_dir"):
        await journal.open()
    await journal.close()


def permit(wiring: Wiring) -> Permit | None:
    """The latch's decision about the next start."""
    found = StopLatch(wiring.latch_path).read()
    return found.permit if found is not None else None


async def test_what_must_not_be_lost_is_written_as_soon_as_the_disk_works_again(wiring: Wiring) -> None:
    async with opened(wiring) as (journal, _):
        assert permit(wiring) is Permit.FREE
        with taken(wiring):
            journal.write((SaveTask(1, "claimed", "Rob"), SaveTask(2, "done", "Bot")), 1.0)
            await journal.settled()
            assert journal.fault is not None
            assert permit(wiring) is Permit.UNSURE, "killed now, the robot would start stopped"
            assert "the next start will be stopped" in (await journal.latch.kept() or ""), "so is who says resume told"
            journal.write((SaveTask(1, "done", "Rob"),), 1.5)
            await journal.settled()
        journal.write((), 10.0)
        await journal.settled()
        assert (journal.fault, journal.lost) == (None, 0)
        assert permit(wiring) is Permit.FREE
    async with opened(wiring) as (again, memory):
        assert memory.tasks == {1: ("done", "Rob"), 2: ("done", "Bot")}
        assert again.stopped is False


async def test_a_disk_that_works_again_is_noticed_by_a_robot_that_has_nothing_to_write(wiring: Wiring) -> None:
    """After a start on a full disk it said that nothing is kept, though there was room again, until somebody spoke."""
    async with opened(wiring):
        pass
    with no_new_bytes(), capture_logs():
        await (journal := JournalService(wiring)).open()
    assert journal.fault is not None
    journal.latch.stop(False)
    journal.write((), 2.0)
    await journal.settled()
    assert journal.fault is None
    assert await journal.latch.kept() is None
    assert permit(wiring) is Permit.FREE
    await journal.close()


async def test_a_stop_is_kept_before_it_is_answered_and_whatever_waits_for_the_disk(wiring: Wiring) -> None:
    journal = JournalService(wiring)
    journal.latch.stop()  # before the memory is open
    opening = asyncio.ensure_future(journal.open())
    assert await journal.latch.kept() is None
    await opening
    assert permit(wiring) is Permit.STOPPED
    journal.latch.stop(False)
    assert await journal.latch.kept() is None
    assert permit(wiring) is Permit.FREE
    with taken(wiring):
        journal.write((GarbledRecord(1.0, 1.0, 2.0), SaveStopped(True)), 1.0)
        assert await journal.latch.kept() is None
        assert permit(wiring) is Permit.STOPPED, "though nothing else can be written"
    await journal.close()
    await starts_stopped(wiring)


async def test_resume_and_stop_in_one_breath_leave_the_latch_stopped_all_the_while(wiring: Wiring) -> None:
    written: list[str] = []

    def note(event: str, arguments: tuple[object, ...]) -> None:  # an audit hook stays for good, and then notes nothing
        if noting and event == "os.rename" and arguments[1] == str(wiring.latch_path):
            written.append(Path(str(arguments[0])).read_text().split()[0])

    sys.addaudithook(note)
    noting = True
    try:
        async with opened(wiring) as (journal, _):
            journal.latch.stop()
            assert await journal.latch.kept() is None
            journal.write((SaveStopped(False), SaveStopped(True)), 1.0)
            await journal.settled()
    finally:
        noting = False
    assert written
    assert "free" not in written[written.index("stopped") :]


async def test_a_memory_has_one_daemon_whichever_sockets_they_have(wiring: Wiring) -> None:
    journal, other = JournalService(wiring), JournalService(wiring)
    await journal.open()
    journal.latch.stop()
    assert await journal.latch.kept() is None
    with pytest.raises(RunningError, match=re.escape(str(wiring.settings.memory_path))):
        await other.open()
    await other.close()
    assert permit(wiring) is Permit.STOPPED
    await journal.close()
    await starts_stopped(wiring)


async def test_a_file_that_cannot_be_used_costs_the_memory_and_the_robot_starts_stopped(wiring: Wiring) -> None:
    wiring.settings.state_dir.mkdir()
    wiring.settings.memory_path.mkdir()
    with capture_logs() as logs:
        journal = JournalService(wiring)
        assert (await journal.open()).tasks == {}
        assert journal.stopped
        assert journal.fault is not None
        assert journal.fault in (journal.loss or "")
        journal.write((SaveStopped(False), SaveTask(1, "done", "Rob"), GarbledRecord(1.0, 1.0, 2.0)), 1.0)
        journal.write((), 5.0)
        await journal.close()
        assert permit(wiring) is Permit.UNSURE, "it was told to resume, and nobody knows what it has done since"
    (lost,) = [line for line in logs if line["event"] == "memory lost"]
    assert "set `state_dir` to another" in lost["reason"]


async def test_a_robot_that_was_stopped_says_at_its_start_why_it_does_nothing(wiring: Wiring) -> None:
    with capture_logs() as logs:
        for _ in range(2):
            async with opened(wiring) as (journal, _):
                journal.latch.stop()
    (told,) = logs
    assert (told["log_level"], told["event"]) == ("warning", "starts stopped")
    assert "hvcpctl resume" in told["remedy"]


async def test_changes_of_tasks_that_cannot_be_read_are_set_aside_and_the_robot_starts_stopped(wiring: Wiring) -> None:
    """The daemon did not start at all: where nobody is near, nothing was left but a silent robot."""
    file = wiring.settings.task_changes_path
    file.parent.mkdir()
    file.write_text("removed: [")
    settings = replace(wiring.settings, unable=(11,))  # which only that file had
    damaged = wire_up(settings)
    assert damaged.tasks == wiring.tasks
    async with opened(damaged) as (journal, _):
        assert journal.stopped
        assert journal.loss == f"{file} cannot be read, and is set aside"
        journal.latch.stop(False)
    assert file.with_name("rob.tasks.yaml.corrupt-1").read_text() == "removed: ["
    async with opened(wire_up(wiring.settings)) as (again, _):
        assert not again.stopped, "it was told to resume"


async def test_changes_of_tasks_that_cannot_be_set_aside_end_nothing(wiring: Wiring) -> None:
    file = wiring.settings.task_changes_path
    file.mkdir(parents=True)
    for number in range(1, MAX_SET_ASIDE + 1):
        file.with_name(f"{file.name}.corrupt-{number}").touch()
    damaged = wire_up(wiring.settings)
    async with opened(damaged) as (journal, _):
        assert "this is a directory" in (journal.loss or "")
        assert "damaged files lie beside it" in (journal.loss or "")
    await starts_stopped(damaged)


async def test_a_start_on_a_full_disk_tells_that_nothing_can_be_saved_and_not_that_anything_is_lost(
    wiring: Wiring,
) -> None:
    with capture_logs() as logs:
        journal = JournalService(wiring)
        with no_new_bytes():
            await journal.open()
            assert journal.loss is None
            assert journal.fault is not None
            await journal.close()
    assert [(line["event"], line["starts"]) for line in logs if line["event"].startswith("memory")] == [
        ("memory failed", "stopped")
    ]


async def test_a_file_that_was_cut_is_noticed_though_nothing_is_written(wiring: Wiring) -> None:
    async with opened(wiring) as (journal, _):
        os.truncate(wiring.settings.memory_path, 0)
        journal.write((), CHECK_S)
        await journal.settled()
        assert journal.fault is not None
        assert "cut short" in journal.fault
    await starts_stopped(wiring)
