"""JSON lines and the transcript: strict JSON, in order, unharmed by a reader that goes away."""

from __future__ import annotations

import io
import json
import os
from dataclasses import replace
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from hvcpd.reporting.events import Heard, Moved, Said, Summary, as_json
from hvcpd.reporting.jsonlines import JsonLines, line
from hvcpd.reporting.transcript import write_transcript
from tests.reporting.example import example

MISSION = example(sound=False)
SUMMARY_KEYS = {
    *("tasks", "done", "duplicates", "lost", "utterances_sent", "utterances_understood", "collisions"),
    *("virtual_s", "wall_s", "realtime_factor", "seed"),
}


def test_every_event_is_one_line_and_comes_back() -> None:
    stream = io.StringIO()
    lines = JsonLines(stream)
    for event in MISSION.events:
        lines.handle(event)
    read = [json.loads(each) for each in stream.getvalue().splitlines()]
    assert read == [json.loads(json.dumps(as_json(event))) for event in MISSION.events]
    assert read[-1].keys() >= SUMMARY_KEYS
    assert read[-1]["done"]["water the green rose"] == "Rob"


@given(st.text(), st.floats(), st.floats())
def test_any_text_and_number_make_strict_json(text: str, confidence: float, snr_db: float) -> None:
    written = line(Heard(1.0, None, text, text, text, confidence, snr_db))
    assert written.endswith("\n")
    assert len(written.splitlines()) == 1

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    read = json.loads(written, parse_constant=refuse)
    assert read["text"] == text
    assert read["snr_db"] is None or read["snr_db"] == snr_db


def test_a_reader_that_goes_away_does_no_harm() -> None:
    reader, writer = os.pipe()
    with os.fdopen(writer, "w", encoding="utf-8") as stream:
        lines = JsonLines(stream)
        lines.handle(MISSION.events[0])
        first = os.read(reader, 100_000)
        os.close(reader)
        for event in MISSION.events[1:]:
            lines.handle(event)
        stream.flush()  # nothing is left over that would fail when the process ends
    assert json.loads(first)["event"] == "started"


def test_lines_come_at_once() -> None:
    class Stream(io.StringIO):
        flushed = ""

        def flush(self) -> None:
            self.flushed = self.getvalue()

    stream = Stream()
    JsonLines(stream).handle(MISSION.events[0])
    assert stream.flushed.endswith("\n")


def test_the_transcript_is_in_order_and_whole(tmp_path: Path) -> None:
    path = tmp_path / "transcript.jsonl"
    path.write_text("old", encoding="utf-8")
    write_transcript(MISSION.events, path)
    read = [json.loads(each) for each in path.read_text(encoding="utf-8").splitlines()]
    assert [r["event"] for r in (read[0], read[-1])] == ["started", "summary"]
    times = [r["at_s"] for r in read[:-1]]
    assert times == sorted(times)
    for kind, name in ((Said, "said"), (Heard, "heard")):
        wanted = sorted(e.text for e in MISSION.events if isinstance(e, kind))
        assert sorted(r["text"] for r in read if r["event"] == name) == wanted
    assert len(read) == sum(not isinstance(e, Moved) for e in MISSION.events)
    assert [p.name for p in tmp_path.iterdir()] == ["transcript.jsonl"]


def test_a_transcript_that_cannot_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "transcript.jsonl"
    path.write_text("old", encoding="utf-8")
    broken = replace(next(e for e in MISSION.events if isinstance(e, Summary)), done={"a": object()})  # type: ignore[dict-item]
    try:
        write_transcript([broken], path)
    except TypeError:
        pass
    else:
        raise AssertionError("an object was written as JSON")
    assert path.read_text(encoding="utf-8") == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["transcript.jsonl"]
