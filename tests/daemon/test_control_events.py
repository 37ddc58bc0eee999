"""What a robot's records are as events of the control socket."""

from __future__ import annotations

from pathlib import Path

import pytest
from structlog.testing import capture_logs

from hvcpd.config.settings import Settings
from hvcpd.daemon.control_events import KINDS, EventSource, Meter
from hvcpd.daemon.journal_service import JournalService
from hvcpd.daemon.logging import log_record
from hvcpd.daemon.wiring import wire_up
from hvcpd.reporting.events import Noted
from hvcpd.robot.records import DoubtRecord, Record, StuckRecord, VoiceRecord
from tests.robot.test_hold import Bench


@pytest.mark.parametrize(
    ("record", "text"),
    [
        (VoiceRecord(1.0, "Bot", "oak", "elm"), "another voice than Bot's: oak, not elm"),
        (DoubtRecord(1.0, "Bot", "Hi Rob, I am Bot, turn left", "no seal"), "not believed: no seal"),
    ],
)
def test_what_a_robot_thinks_of_a_speaker_is_told(record: Record, text: str) -> None:
    told = EventSource("Rob", Meter()).of_step(Bench().robot, [record], False)
    assert Noted(1.0, "Rob", "Bot", text) in list(told)
    assert "noted" in KINDS


async def test_why_driving_failed_is_told_and_written_down_and_logged(tmp_path: Path) -> None:
    wiring, stuck = wire_up(Settings(name="Rob", state_dir=tmp_path)), StuckRecord(1.0, 3, "a wheel is blocked")
    told = EventSource("Rob", Meter()).of_step(Bench().robot, [stuck], False)
    assert Noted(1.0, "Rob", None, "driving failed: a wheel is blocked") in list(told)
    with capture_logs() as logs:
        log_record(stuck, wiring.tasks)
    assert (logs[0]["log_level"], logs[0]["task"], logs[0]["reason"]) == ("warning", 3, "a wheel is blocked")
    journal = JournalService(wiring)
    await journal.open()
    journal.write((stuck,), 1.0)
    (row,) = await journal.transcript(0, 0.0, 10)
    assert row.record.text == "driving failed: a wheel is blocked"
    await journal.close()
