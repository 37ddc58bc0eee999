"""The call from recordings: what a list may hold, and what is counted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly.sound import make_sound, user_cache_folder
from hvcpd.control.cli import main
from hvcpd.errors import ConfigError
from hvcpd.evaluation.recordings import LIST, Recording, findings, read_list, understood
from hvcpd.hardware.soundfile import write_wav
from hvcpd.ports import SAMPLE_RATE_HZ

HEAD = "file,distance_m,speaker,listener,said\n"


def listed(folder: Path, text: str) -> Path:
    for name in ("a.wav", "c.wav"):
        (folder / name).write_bytes(b"")
    (folder / LIST).write_text(text)
    return folder


def test_a_list_is_read(tmp_path: Path) -> None:
    listed(tmp_path, HEAD + "c.wav,0.5,Mia,Ted,20\na.wav,1.2,Mia,Ted,10\n")
    assert read_list(tmp_path)[1] == Recording(tmp_path / "a.wav", 1.2, "Mia", "Ted", 10)


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("file,distance\n", ["first line"]),
        (HEAD, ["two distances"]),
        (HEAD + "a.wav,1,Mia,Ted,20\nc.wav,1,Mia,Ted,20\n", ["two distances"]),
        (HEAD + "a.wav,1,Mia,Ted,20\na.wav,2,mia,Ted,20\n", ["line 3: the same calls are in line 2"]),
        (HEAD + "a.wav,1,Mia,Ted,20\n\na.wav,far,Ted,Mia,20\n", ["line 4: distance_m"]),
        (
            HEAD + "b.wav,1,Mia,Ted,20\na.wav,far,Mia,Ted,no\n",
            ["line 2: there is no file", "line 3: distance_m", "said is"],
        ),
        (HEAD + f"{'x' * 300},1,Mia,Ted,20\n", ["line 2: there is no file"]),
        (HEAD + f"a.wav,1,{'x' * 200_000},Ted,20\n", ["line 2: field larger than field limit"]),
        ("x" * 200_000, ["line 1: field larger than field limit"]),
        (HEAD + "a.wav,-1,Mia,Mia,0\n", ["from 0.01", "the same", "said is"]),
        (HEAD + "a.wav,nan,,Ted,5\na.wav,1\n", ["distance_m is nan", "speaker: ", "line 3: give 5 values"]),
    ],
)
def test_all_faults_of_a_list_are_told_at_once(tmp_path: Path, text: str, faults: list[str]) -> None:
    with pytest.raises(ConfigError) as error:
        read_list(listed(tmp_path, text))
    assert [fault for fault in faults if fault not in str(error.value)] == []


def test_a_list_that_is_not_there_or_no_text(tmp_path: Path) -> None:
    """It gave the error of Python, with the path once more."""
    with pytest.raises(ConfigError, match=f"^{tmp_path / LIST}: there is no such file; check the name, or create it;"):
        read_list(tmp_path)
    (tmp_path / LIST).write_bytes(b"\xff")
    with pytest.raises(ConfigError, match="not UTF-8 text"):
        read_list(tmp_path)


def test_recordings_of_one_distance_are_added_up() -> None:
    recordings = [Recording(Path(), at, "Mia", "Ted", 20) for at in (1.0, 1.0, 2.0, 4.0)]
    found = findings(recordings, [20, 18, 3, 0])
    assert [row[:3] for row in found.table.rows] == [(1.0, 40, 38), (2.0, 20, 3), (4.0, 20, 0)]
    assert found.paragraphs[0].startswith("41 of 80 recorded calls were understood; half of them at 1.")


def test_calls_beyond_those_said_do_not_count_and_are_told() -> None:
    recordings = [Recording(Path(f"{at:g}.wav"), at, "Mia", "Ted", 3) for at in (1.0, 2.0)]
    found = findings(recordings, [5, 1])
    assert [row[:3] for row in found.table.rows] == [(1.0, 3, 3), (2.0, 3, 1)]
    assert found.paragraphs[1:] == (
        "In 1.wav 5 calls from Mia to Ted were understood and 3 said; 3 are counted. Listen to it, and check the list.",
    )


@pytest.mark.slow
def test_calls_in_a_recording_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    call = make_sound(None, user_cache_folder()).speaker_of("Mia").render((("hi", "ted"), ("i", "am", "mia")))
    silence = np.zeros(2 * SAMPLE_RATE_HZ, np.float32)
    noise = np.random.default_rng(1).standard_normal(2 * (len(call) + len(silence))) * 1e-4
    near = np.concatenate([silence, call, silence, call])
    write_wav(tmp_path / "near.wav", (0.1 * near + noise[: len(near)]).astype(np.float32))
    write_wav(tmp_path / "far.wav", noise.astype(np.float32))
    (tmp_path / LIST).write_text(HEAD + "near.wav,1,Mia,Ted,2\nfar.wav,9,Mia,Ted,2\n")
    assert [understood(recording) for recording in read_list(tmp_path)] == [2, 0]
    assert main(["evaluate", "wake", "--from-recordings", str(tmp_path), "--out", str(tmp_path / "out")]) == 0
    assert "2 of 4 recorded calls were understood" in capsys.readouterr().out
    assert (tmp_path / "out" / "wake-recorded.csv").exists()


def test_only_the_call_can_be_recorded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "robots", "--from-recordings", str(tmp_path), "--out", str(tmp_path)]) == 2
    assert "--from-recordings" in capsys.readouterr().err
