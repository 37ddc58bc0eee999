"""A recorded mission, as the page plays it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hvcpd.console.app import replay_app
from hvcpd.console.guard import PageAccess
from hvcpd.console.replay import read_recording
from hvcpd.errors import ConfigError
from hvcpd.hardware.soundfile import write_wav
from hvcpd.reporting.events import MissionRecord, Moved, Skill, Summary
from hvcpd.reporting.transcript import read_trails, read_transcript, write_trails, write_transcript
from tests.console.asking import request
from tests.reporting.example import example


def recorded(folder: Path, record: MissionRecord) -> Path:
    write_transcript(record.events, folder / "transcript.jsonl")
    write_trails(record.trails, folder / "trails.jsonl")
    return folder


def test_what_is_written_is_read(tmp_path: Path) -> None:
    record = example(sound=False)
    recorded(tmp_path, record)
    events = read_transcript(tmp_path / "transcript.jsonl")
    kept = sorted((e for e in record.events if not isinstance(e, Moved | Summary)), key=lambda event: event.at_s)
    assert list(events[:-1]) == kept
    assert isinstance(events[-1], Summary)
    trails = read_trails(tmp_path / "trails.jsonl")
    assert [trail.robot for trail in trails] == [trail.robot for trail in record.trails]
    for read, true in zip(trails, record.trails, strict=True):
        off = np.hypot(*(np.interp(true.t_s, read.t_s, a) - b for a, b in ((read.x_m, true.x_m), (read.y_m, true.y_m))))
        assert off.max() < 0.03


def test_a_skill_is_read_with_its_numbers_and_words(tmp_path: Path) -> None:
    """The mission of `make demo` waters."""
    values: dict[str, float | str] = {"litres": 0.25, "tap": "left"}
    used = Skill(64.9, "Rob", 1, 5, "water", "finished", share=1.0, arguments=values, results={"seconds": 5.0})
    write_transcript([used], tmp_path / "transcript.jsonl")
    assert read_transcript(tmp_path / "transcript.jsonl") == (used,)


def test_the_replay_ends_as_the_mission_did(tmp_path: Path) -> None:
    record = example(3, 6, sound=False)
    recording = read_recording(recorded(tmp_path, record)).messages
    steps = recording["steps"]
    assert [step["at_s"] for step in steps] == sorted(step["at_s"] for step in steps)
    boards = [step["message"] for step in steps if step["message"]["kind"] == "board"]
    assert {task["state"] for task in recording["begin"]["parts"][1]["tasks"]} == {"open"}
    assert {task["state"] for task in boards[-1]["tasks"]} == {"done"}
    for trail in record.trails:
        last = [s["message"] for s in steps if s["message"]["kind"] == "moved" and s["message"]["name"] == trail.robot][
            -1
        ]
        assert (last["x_m"], last["y_m"]) == pytest.approx((trail.x_m[-1], trail.y_m[-1]), abs=0.05)


def test_the_map_has_the_places_that_only_one_robot_fits_in(tmp_path: Path) -> None:
    plan = read_recording(recorded(tmp_path, example(sound=False))).messages["begin"]["plan"]
    assert "The corridor: only one robot fits in" in plan["svg"]


def test_each_line_tells_who_heard_it_and_how_surely(tmp_path: Path) -> None:
    recording = read_recording(recorded(tmp_path, example(sound=False))).messages
    lines = [step["message"]["line"] for step in recording["steps"] if step["message"]["kind"] == "line"]
    assert [line["n"] for line in lines] == list(range(len(lines)))
    marks = [mark["text"] for line in lines for mark in line["marks"]]
    assert any("% sure" in mark for mark in marks)
    assert "collided with another voice" in marks


def test_the_page_serves_the_sound_in_parts(tmp_path: Path) -> None:
    write_wav(tmp_path / "mission.wav", np.zeros(16_000, np.float32))
    recording = read_recording(recorded(tmp_path, example(sound=False)))
    app = replay_app(recording.messages, str(recording.sound), recording.title, PageAccess())
    part = request(app, "/sound", range="bytes=100-199")
    assert (part.status, len(part.body)) == (206, 100)
    assert request(app, "/replay").json()["has_sound"] is True
    assert 'data-mode="replay"' in request(app, "/").text
    assert request(app, "/act", "POST").status == 403, "there is nothing to stop"


def test_a_mission_without_trails_or_sound_can_be_seen_too(tmp_path: Path) -> None:
    record = example(sound=False)
    write_transcript(replace(record, trails=()).events, tmp_path / "transcript.jsonl")
    recording = read_recording(tmp_path)
    assert recording.sound is None
    app = replay_app(recording.messages, None, recording.title, PageAccess())
    assert request(app, "/sound").status == 404


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("no JSON\n", "line 1"),
        ('{"event": "said"}\n', "line 1: no said"),
        ('{"event": "said"}\n', "required field missing: at_s"),
        ('{"event": "garbled", "at_s": "soon", "listener": "Rob"}\n', "expected float: at_s"),
        ('{"event": "garbled", "at_s": "soon", "listener": "Rob"}\n', "garbled"),
        ("", "has no robot"),
        ('{"event": "of a newer version"}\n', "has no robot"),
    ],
)
def test_a_broken_recording_is_told_with_its_line(text: str, part: str, tmp_path: Path) -> None:
    (tmp_path / "transcript.jsonl").write_text(text)
    with pytest.raises(ConfigError, match=part):
        read_recording(tmp_path)


def test_a_folder_without_a_recording_is_told_so(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="simulate --report"):
        read_recording(tmp_path)
    (tmp_path / "trails.jsonl").write_text('{"robot": "Rob", "t_s": [1], "x_m": [1, 2], "y_m": [1]}\n')
    with pytest.raises(ConfigError, match="differ in length"):
        read_trails(tmp_path / "trails.jsonl")
    (tmp_path / "trails.jsonl").write_text('{"robot": "Rob", "t_s": [1], "x_m": [1]}\n')
    with pytest.raises(ConfigError, match=r"no trail \('y_m' is missing"):
        read_trails(tmp_path / "trails.jsonl")
