"""The log's lines, in the three forms that they take."""

from __future__ import annotations

import io
import math
import os
from pathlib import Path

import pytest

from hvcpd.config.tasks import TaskDefinition, TaskRepository
from hvcpd.coordination.actions import SavePeer, SaveTask
from hvcpd.daemon.logging import log_record, set_up_logging
from hvcpd.language.messages import Stop, ToAll, Utterance
from hvcpd.robot.records import GarbledRecord, HeardRecord, PerformedRecord, Record, SaidRecord, SkillRecord
from hvcpd.skills.life import Call, Report, SkillState

TASKS = TaskRepository((TaskDefinition(1, "water the rose", None, ()),))
GREETING = Utterance("Bot", ToAll(), None, None)
RECORDS: tuple[Record, ...] = (
    SaidRecord(1.004, GREETING, "Hi all, I am Bot", 2.0),
    HeardRecord(5.0, GREETING, "Hi all, I am Bot", 3.0, 4.9, 0.98765, 21.04, "oak"),
    GarbledRecord(6.0, 5.5, 5.9),
    SaveTask(1, "claimed", "Bot"),
    SavePeer("Bot", None, 5.0),
    PerformedRecord(9.0, 1),
)


pytestmark = pytest.mark.usefixtures("own_log")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def written(out: io.StringIO, environment: dict[str, str], level: str = "info") -> list[str]:
    set_up_logging(level, out, environment)
    for record in RECORDS:
        log_record(record, TASKS)
    return out.getvalue().splitlines()


def test_logfmt_has_the_words_and_the_confidence() -> None:
    lines = written(io.StringIO(), {})
    assert [line.split("event=")[1].split()[0] for line in lines] == ["said", "heard", "garbled", "task", "performed"]
    assert all(line.startswith("timestamp=") for line in lines)
    assert 'text="Hi all, I am Bot" at_s=1.0 duration_s=2.0' in lines[0]
    assert "speaker=Bot confidence=0.988 snr_db=21.0 voice=oak at_s=3.0" in lines[1]
    assert 'number=1 name="water the rose" state=claimed owner=Bot' in lines[3]


def test_what_a_word_heard_by_itself_lacks_is_left_out() -> None:
    out = io.StringIO()
    set_up_logging("info", out, {})
    stop = Utterance(None, statement=Stop())
    log_record(HeardRecord(5.0, stop, "stop", 3.0, 4.9, math.nan, math.nan, ""), TASKS)
    assert out.getvalue().endswith("level=info event=heard text=stop at_s=3.0\n")


def test_why_a_skill_failed_is_told() -> None:
    """The log had only that the task was open again."""
    out = io.StringIO()
    set_up_logging("info", out, {})
    call = Call(7, 2, "wave", (), 3.0)
    for report in (Report(7, SkillState.RUNNING), Report(7, SkillState.FAILED, text="it took too long")):
        log_record(SkillRecord(5.0, call, report), TASKS)
    (line,) = out.getvalue().splitlines()
    assert line.endswith('level=warning event="skill failed" skill=wave task=2 reason="it took too long" at_s=5.0')


def test_under_systemd_the_journal_keeps_the_time_and_learns_the_priority(tmp_path: Path) -> None:
    with (tmp_path / "journal").open("w+") as stream:
        status = os.fstat(stream.fileno())
        set_up_logging("info", stream, {"JOURNAL_STREAM": f"{status.st_dev}:{status.st_ino}"})
        for record in RECORDS:
            log_record(record, TASKS)
        stream.seek(0)
        lines = stream.read().splitlines()
    assert len(lines) == 5
    assert all(line.startswith("<6>level=info event=") for line in lines)


def test_debug_tells_of_peers_too() -> None:
    assert len(written(io.StringIO(), {}, "debug")) == len(RECORDS)
    assert written(io.StringIO(), {}, "warning") == []


def test_a_terminal_gets_a_readable_line() -> None:
    lines = written(Terminal(), {"JOURNAL_STREAM": "8:1234"})
    assert len(lines) == 5
    assert "Hi all, I am Bot" in lines[0]
    assert not lines[0].startswith("<")
