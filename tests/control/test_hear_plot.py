"""`hvcpctl hear --plot`: a picture of what was heard."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import numpy as np
import pytest

from hvcpd.control.cli import main
from hvcpd.hardware.soundfile import write_wav
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Event, Garbled, Recognised, Released, Urgent, WordSpan
from hvcpd.reporting.hearing_plot import PlotError, hearing_png, levels_of, spectrum_of
from tests.control.conftest import Refuse

NOISE_DBFS = -40.0


def noise(length_s: float, dbfs: float = NOISE_DBFS) -> np.ndarray:
    sound = np.random.default_rng(3).standard_normal(int(length_s * SAMPLE_RATE_HZ)) * 10.0 ** (dbfs / 20.0)
    return sound.astype(np.float32)


def size_of(png: bytes) -> tuple[int, int]:
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", png[16:24])
    return width, height


def test_level_and_noise_are_told_in_dbfs() -> None:
    levels = levels_of(noise(6.0))
    # The filters reach from 80 Hz to about 7.3 kHz of 8 kHz, so a little of white noise is missing.
    assert np.median(levels.sound_dbfs[100:]) == pytest.approx(NOISE_DBFS - 0.6, abs=0.8)
    assert levels.noise_dbfs[-1] == pytest.approx(NOISE_DBFS - 0.6, abs=0.8)
    assert np.isnan(levels.noise_dbfs[:8]).all(), "no estimate before there is one"
    assert levels.at_s[-1] == pytest.approx(6.0, abs=0.06)


def test_the_noise_line_follows_a_step() -> None:
    levels = levels_of(np.concatenate([noise(3.0, -60.0), noise(3.0, -40.0)]))
    at_3_s = int(np.searchsorted(levels.at_s, 3.0))
    assert levels.noise_dbfs[at_3_s - 5] == pytest.approx(-60.6, abs=1.0)
    assert levels.noise_dbfs[at_3_s + 100] == pytest.approx(-40.6, abs=1.0)


def test_a_tone_lies_at_its_frequency() -> None:
    tone = np.sin(2 * np.pi * 3000 * np.arange(8000) / SAMPLE_RATE_HZ).astype(np.float32)
    level_db = spectrum_of(tone)
    assert level_db[:, 1:].mean(axis=1).argmax() * 31.25 == pytest.approx(3000, abs=32)


def test_a_long_recording_makes_no_larger_picture() -> None:
    assert spectrum_of(noise(600.0)).shape[1] <= 6000


def test_words_and_garbled_speech_change_the_picture() -> None:
    pytest.importorskip("matplotlib")
    sound = noise(3.0)
    spans = (WordSpan("hi", 16_000, 20_000, 0.9), WordSpan("rob", 20_000, 26_000, 0.3))
    heard = Recognised(("hi", "rob"), "oak", 16_000, 26_000, 0.8, 12.0, spans)
    none, words, unsure = ([], [heard], [heard, Garbled(30_000, 40_000)])
    halts = ([heard, Released(30_000, 40_000)], [heard, Urgent(30_000, 40_000)])
    pictures = {hearing_png(sound, events, "x.wav") for events in (none, words, unsure, *halts)}
    assert len(pictures) == 5
    assert {size_of(png)[1] for png in pictures} == {792}


@pytest.mark.slow
def test_the_picture_is_written_whole(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    write_wav(tmp_path / "room.wav", noise(1.0))
    assert main(["hear", str(tmp_path / "room.wav"), "--json", "--plot", str(tmp_path / "room.png")]) == 0
    assert size_of((tmp_path / "room.png").read_bytes()) == (990, 792)
    assert {p.name for p in tmp_path.iterdir()} == {"room.wav", "room.png"}


def test_a_picture_that_cannot_be_written(refused: Refuse, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    write_wav(tmp_path / "room.wav", noise(1.0))
    assert "there is no folder" in refused("hear", tmp_path / "room.wav", "--plot", tmp_path / "none" / "x.png")
    assert "Is a directory; name a file in it" in refused("hear", tmp_path / "room.wav", "--plot", tmp_path)


def test_an_empty_recording_has_no_picture() -> None:
    events: list[Event] = []
    with pytest.raises(PlotError, match="too short"):
        hearing_png(np.zeros(399, np.float32), events, "x")


def test_without_matplotlib_it_says_what_to_install_before_it_listens(
    monkeypatch: pytest.MonkeyPatch, refused: Refuse, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    write_wav(tmp_path / "room.wav", noise(1.0))
    told = refused("hear", tmp_path / "room.wav", "--plot", tmp_path / "x.png")
    assert told.startswith("hvcpctl: --plot needs matplotlib")
    with pytest.raises(PlotError, match="pip install matplotlib"):
        hearing_png(noise(0.5), [], "x")
