"""A recorded mission, and what `hvcpctl follow --json` printed, as MCAP; read back by the format's own library."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hvcpd.console.replay import read_recording
from hvcpd.control.cli import main
from hvcpd.errors import ConfigError
from hvcpd.hardware.soundfile import write_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Pose
from hvcpd.reporting.events import Heard, Moved, Said, Sound, Trail
from hvcpd.reporting.jsonlines import line
from hvcpd.reporting.transcript import write_trails, write_transcript

reader = pytest.importorskip("mcap.reader")

SAID = Said(1.5, 4.0, 0, "Rob", "Hi all, I am Rob", collided=False)
HEARD = Heard(1.5, 0, "Bot", "Rob", "Hi all, I am Rob", 0.9, 20.0)


def read(path: Path) -> list[tuple[str, str, float, dict[str, Any]]]:
    """Of each message the topic, its schema's name, the time in s and the body, in the file's order."""
    with path.open("rb") as file:
        found = reader.make_reader(file, validate_crcs=True).iter_messages()
        return [
            (channel.topic, schema.name, message.log_time / 1e9, json.loads(message.data))
            for schema, channel, message in found
        ]


def test_a_mission_has_its_sound_its_sentences_and_its_ways(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sound = np.linspace(-0.5, 0.5, round(1.2 * SAMPLE_RATE_HZ), dtype=np.float32)
    write_transcript((SAID, HEARD), tmp_path / "transcript.jsonl")
    write_trails([Trail("Rob", *np.array([[0.0, 2.0], [0.0, 0.0], [0.0, 3.0]]))], tmp_path / "trails.jsonl")
    write_wav(tmp_path / "mission.wav", sound)
    file = tmp_path / "mission.mcap"
    assert main(["mcap", str(tmp_path), str(file)]) == 0
    assert "messages" in capsys.readouterr().out
    found = read(file)
    assert [at_s for *_, at_s, _ in found] == sorted(at_s for *_, at_s, _ in found)
    logs = {topic: body for topic, schema, _, body in found if schema == "foxglove.Log"}
    assert logs["/said"]["message"] == "Rob: Hi all, I am Rob"
    assert logs["/Bot/heard"]["timestamp"] == {"sec": 1, "nsec": 500_000_000}
    first, last = [body["pose"] for topic, _, _, body in found if topic == "/pose/Rob"]
    assert last["position"] == {"x": 0.0, "y": 3.0, "z": 0.0}
    assert first["orientation"]["z"] == pytest.approx(np.sqrt(0.5)), "it heads for +y, a quarter turn"
    heard = b"".join(base64.b64decode(body["data"]) for topic, *_, body in found if topic == "/sound")
    assert np.frombuffer(heard, "<i2") / 32_767 == pytest.approx(sound, abs=1e-4)


def test_a_shift_has_the_time_of_the_clock_on_the_wall(tmp_path: Path) -> None:
    lines, file = tmp_path / "shift.jsonl", tmp_path / "shift.mcap"
    events = (SAID, Moved(2.0, (Pose(1.0, 2.0, 0.0),)))
    lines.write_text("".join(json.dumps({**json.loads(line(e)), "wall_s": 1.7e9 + e.at_s}) + "\n" for e in events))
    assert main(["mcap", str(lines), str(file)]) == 0
    found = read(file)
    assert {(topic, at_s) for topic, _, at_s, _ in found} >= {("/said", 1.7e9 + 1.5), ("/pose/0", 1.7e9 + 2.0)}


def test_a_shift_has_its_sound(tmp_path: Path) -> None:
    lines, file = tmp_path / "shift.jsonl", tmp_path / "shift.mcap"
    event = json.loads(line(Sound(2.0, base64.b64encode(b"\x01\x02" * 4000).decode())))
    lines.write_text(json.dumps({**event, "wall_s": 1.7e9}) + "\n")
    assert main(["mcap", str(lines), str(file)]) == 0
    [(topic, schema, at_s, body)] = read(file)
    assert (topic, schema, at_s) == ("/sound", "foxglove.RawAudio", 1.7e9)
    assert base64.b64decode(body["data"]) == b"\x01\x02" * 4000


@pytest.mark.parametrize("end", ['{"event": "sound", "at_s": 2.0, "pcm": "AgA', "\0\0\0"], ids=["killed", "power cut"])
def test_a_shift_whose_last_line_is_cut_has_all_before(end: str, tmp_path: Path) -> None:
    lines, file = tmp_path / "shift.jsonl", tmp_path / "shift.mcap"
    lines.write_text(line(SAID) + end)
    assert main(["mcap", str(lines), str(file)]) == 0
    assert [topic for topic, *_ in read(file)] == ["/said", "/events/said"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "no JSON\n",
        "no JSON",
        '{"event": "said", "at_s"\n{"event": "said", "at_s": 1}\n',
        "[1]\n",
        '{"event": "moved", "at_s": 1, "poses": [1]}\n',
        '{"event": "sound", "at_s": 1, "pcm": "no base64"}\n',
        '{"event": "sound", "at_s": 1, "pcm": 7}\n',
        '{"event": "said", "at_s": -1}\n',
        '{"event": "said", "at_s": NaN}\n',
        '{"event": "said", "at_s": 1e999}\n',
        f'{{"event": "said", "at_s": {10**400}}}\n',
    ],
)
def test_what_is_no_recording_is_refused(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines, file = tmp_path / "shift.jsonl", tmp_path / "shift.mcap"
    lines.write_text(text)
    assert main(["mcap", str(lines), str(file)]) == 2
    assert str(lines) in capsys.readouterr().err
    assert not file.exists()


@pytest.mark.parametrize(
    ("t_s", "x_m"),
    [
        ([], []),
        ([None], [1.0]),
        ([0.0], [None]),
        (["1e999"], [1.0]),
        ([1e300], [1.0]),
        ([10**400], [1.0]),
        ([2, 1], [0, 0]),
    ],
)
def test_a_trail_that_is_none_is_named(
    t_s: list[object], x_m: list[object], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It ended with a traceback, in the console, too."""
    write_transcript((SAID, HEARD), tmp_path / "transcript.jsonl")
    trails = tmp_path / "trails.jsonl"
    trails.write_text(json.dumps({"robot": "Rob", "t_s": t_s, "x_m": x_m, "y_m": x_m}) + "\n")
    assert main(["mcap", str(tmp_path), str(tmp_path / "out.mcap")]) == 2
    assert f"{trails}, line 1: no trail (" in capsys.readouterr().err
    with pytest.raises(ConfigError, match="line 1: no trail"):
        read_recording(tmp_path)
