"""Nothing that is heard or plugged in can forge a log line, tell a secret or flood the disk."""

from __future__ import annotations

import io
import json
import os
from contextlib import suppress
from pathlib import Path
from typing import get_args

import pytest
import structlog
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.daemon.logging import (
    BURST,
    MAX_VALUE_LENGTH,
    REFILL_S,
    LogFormat,
    is_journal,
    log_held_back,
    set_up_logging,
)
from tests.daemon.hand_clock import Clock

FORGED = 'x\nlevel=info event=stopped \x1b[2J\r\u2028\u202e"quoted" a=b\\'


pytestmark = pytest.mark.usefixtures("own_log")


def written(form: LogFormat, event: str, method: str = "info", **values: object) -> str:
    """What a log of that form has of one event."""
    out = io.StringIO()
    set_up_logging("info", out, {}, form)
    getattr(structlog.get_logger(), method)(event, **values)
    return out.getvalue()


@pytest.mark.parametrize("form", ["keyvalue", "json", "console"])
def test_no_value_makes_a_line_of_its_own(form: LogFormat) -> None:
    (line,) = written(form, "sound failed", reason=FORGED).splitlines()
    assert "\x1b" not in line
    assert "\u202e" not in line


@given(st.text(max_size=60))
def test_any_text_is_one_line_of_each_form(text: str) -> None:
    for form in get_args(LogFormat):
        line = written(form, "heard", text=text)
        assert len(line.splitlines()) == 1
        if form == "json":
            assert json.loads(line)["event"] == "heard"


def test_json_is_strict() -> None:
    line = json.loads(written("json", "odd", "warning", level_db=float("-inf"), path=Path("/x"), nothing=None))
    assert (line["level"], line["level_db"], line["path"], line["nothing"]) == ("warning", None, "/x", None)


def test_a_traceback_is_one_line_and_shows_no_variables() -> None:
    password = "opensesame"
    for form, lines in (("keyvalue", 1), ("json", 1), ("console", 4)):
        try:
            raise RuntimeError("broken\x1b[2J")
        except RuntimeError:
            text = written(form, "crashed", "exception")  # type: ignore[arg-type]
        assert len(text.splitlines()) >= lines
        assert (len(text.splitlines()) == 1) == (lines == 1)
        assert "RuntimeError: broken" in text
        assert "\x1b[2J" not in text
        assert password not in text


def test_an_endless_value_is_cut() -> None:
    assert MAX_VALUE_LENGTH < len(written("keyvalue", "failed", reason="x" * 10**6)) < MAX_VALUE_LENGTH + 200


def test_secrets_are_not_written() -> None:
    line = written("keyvalue", "sealed", key="ab12", Password="cd34", name="Rob")
    assert "ab12" not in line
    assert "cd34" not in line
    assert "name=Rob" in line


def test_what_repeats_is_held_back_and_counted() -> None:
    out, clock = io.StringIO(), Clock()
    limiter = set_up_logging("info", out, {}, "keyvalue", clock)
    log = structlog.get_logger()
    for _ in range(1000):
        log.info("garbled")
        clock.now_s += 0.01
    written = out.getvalue().count("event=garbled")
    assert BURST <= written <= BURST + 10 / REFILL_S + 1
    log.info("heard")
    assert "event=heard" in out.getvalue(), "other kinds pass"
    clock.now_s += REFILL_S
    log.info("garbled")
    held = sum(
        int(line.split("held_back=")[1].split()[0]) for line in out.getvalue().splitlines() if "held_back" in line
    )
    assert held == 1000 - written
    for _ in range(BURST):
        log.info("garbled")
    log_held_back(limiter)
    assert 'event="lines held back" of=garbled' in out.getvalue().splitlines()[-1]
    before = out.getvalue()
    log_held_back(limiter)
    assert out.getvalue() == before


def test_talk_at_its_usual_pace_is_never_held_back() -> None:
    out, clock = io.StringIO(), Clock()
    set_up_logging("info", out, {}, "keyvalue", clock)
    for _ in range(200):
        structlog.get_logger().info("heard")
        clock.now_s += REFILL_S
    assert out.getvalue().count("event=heard") == 200


def test_only_the_journal_itself_gets_priorities(tmp_path: Path) -> None:
    with (tmp_path / "log").open("w+") as stream:
        status = os.fstat(stream.fileno())
        journal = {"JOURNAL_STREAM": f"{status.st_dev}:{status.st_ino}"}
        assert is_journal(stream, journal, os.fstat)
        assert not is_journal(stream, {"JOURNAL_STREAM": "8:1234"}, os.fstat)
        assert not is_journal(io.StringIO(), journal, os.fstat)
        set_up_logging("debug", stream, journal, "json")
        for method in ("debug", "info", "warning", "error", "critical"):
            getattr(structlog.get_logger(), method)("x")
        stream.seek(0)
        assert [line[:3] for line in stream] == ["<7>", "<6>", "<4>", "<3>", "<2>"]


def test_a_log_that_cannot_be_written_stops_nobody() -> None:
    full = Path("/dev/full").open("w")  # noqa: SIM115 - closing it fails, too
    set_up_logging("info", full, {}, "keyvalue")
    structlog.get_logger().info("x", text=["y" * 1000] * 10)
    with suppress(OSError):
        full.close()
    stream = io.StringIO()
    set_up_logging("info", stream, {}, "keyvalue")
    stream.close()
    structlog.get_logger().info("x")
