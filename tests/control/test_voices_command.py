"""`hvcpctl voices`: the eight voices compared, and written one after the other."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hvcpd.control.cli import main
from hvcpd.control.say.sounding import write_or_play
from hvcpd.control.say.voices import BETWEEN_S, nearest, spectral_centre_hz
from hvcpd.errors import DeviceError
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES, voice_for, voice_named
from tests.control.conftest import Ran, Refuse
from tests.hardware.fake_card import CAMERA, FakeCard


def test_every_voice_is_compared_and_each_robot_has_one(ran: Ran) -> None:
    lines = ran("voices", "--silent", "--json", "--text", "Hi", "--names", "Rob,Bot,Zorg").splitlines()
    rows = [json.loads(line) for line in lines]
    assert [row["voice"] for row in rows] == [voice.name for voice in VOICES]
    whose = {name: row["voice"] for row in rows for name in row["robots"]}
    assert whose == {name: voice_for(name).name for name in ("Rob", "Bot", "Zorg")}
    assert all(row["most_like"] != row["voice"] for row in rows)


def test_a_chosen_voice_is_told(tmp_path: Path, ran: Ran) -> None:
    settings = tmp_path / "hvcpd.yaml"
    settings.write_text("name: Rob\nvoice: wren\nnames: [Rob, Bot]\npeers: {Bot: {voice: oak}}\n")
    table = ran("voices", "oak", "Wren", "--silent", "--text", "Hi", "--config", settings).splitlines()
    assert table[1].startswith("oak")
    assert table[1].endswith("Bot")
    assert table[2].startswith("wren")
    assert table[2].endswith("Rob")


def test_a_voice_at_another_pitch_or_rate_has_a_row_of_its_own(tmp_path: Path, ran: Ran) -> None:
    settings = tmp_path / "hvcpd.yaml"
    settings.write_text("name: Rob\nvoice: oak\npitch: 1.1\nnames: [Rob, Bot]\npeers: {Bot: {voice: oak}}\n")
    lines = ran("voices", "--silent", "--json", "--text", "Hi", "--config", settings).splitlines()
    rows = [json.loads(line) for line in lines]
    assert [row["voice"] for row in rows] == [*(voice.name for voice in VOICES), "oak, pitch 1.1, rate 1"]
    assert {name: row["pitch_hz"] for row in rows for name in row["robots"]} == {
        "Rob": pytest.approx(1.1 * voice_named("oak").f0_hz),
        "Bot": voice_named("oak").f0_hz,
    }


def test_the_file_has_the_voices_one_after_the_other(tmp_path: Path) -> None:
    path = tmp_path / "voices.wav"
    assert main(["voices", "cedar", "lark", "--text", "Hi all, stop", "-o", str(path)]) == 0
    each = [Speaker(voice_named(name), Lexicon.load()).render([["hi", "all"], ["stop"]]) for name in ("cedar", "lark")]
    silence = np.zeros(round(BETWEEN_S * SAMPLE_RATE_HZ))
    assert np.allclose(read_wav(path), np.concatenate([each[0], silence, each[1]]), atol=1e-3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["okk"], "'okk' is not a voice; did you mean 'oak'?"),
        (["--text", "?!"], "nothing to say"),
        (["--text", "water " * 2000, "--silent"], "more than 1000 words"),
    ],
)
def test_what_is_no_voice_and_no_text_is_refused(arguments: list[str], message: str, refused: Refuse) -> None:
    assert message in refused("voices", *arguments)


def test_without_a_loudspeaker_the_way_to_a_file_is_named() -> None:
    with pytest.raises(DeviceError, match=r"no loudspeaker on this machine; .*; or write a WAV file with -o FILE\.wav"):
        write_or_play(np.zeros(10, np.float32), None, None, FakeCard((CAMERA,)))


def test_nearest_and_centre() -> None:
    assert nearest(voice_named("wren")) == voice_named("lark")
    tone = np.sin(2 * np.pi * 1000.0 * np.arange(SAMPLE_RATE_HZ) / SAMPLE_RATE_HZ).astype(np.float32)
    assert spectral_centre_hz(tone) == pytest.approx(1000.0, abs=1.0)
