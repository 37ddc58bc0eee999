"""What `hvcpctl` does with good input."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from hvcpd import __version__
from hvcpd.control.cli import main
from hvcpd.control.simulate import simulate
from hvcpd.hardware.soundfile import read_wav, write_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from tests.control.conftest import Ran
from tests.hardware.fake_card import CAMERA, FakeCard

pytestmark = pytest.mark.slow


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--version"])
    assert end.value.code == 0
    assert capsys.readouterr().out == f"hvcpctl {__version__}\n"


def test_the_card_as_text_has_every_task_and_name(ran: Ran) -> None:
    card = ran("phrases", "--names", "Alice,Bot")
    assert "water the yellow rose" in card
    assert "Alice" in card
    assert "stop" in card


def test_the_card_as_markdown(ran: Ran) -> None:
    card = ran("phrases", "--format", "markdown")
    assert card.startswith("#")
    assert "water the yellow rose" in card


def test_the_card_as_html_is_well_formed_and_needs_nothing_from_elsewhere(ran: Ran) -> None:
    class Balance(HTMLParser):
        def __init__(self) -> None:
            super().__init__()
            self.open: list[str] = []

        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            assert not any(name in ("src", "href") for name, _ in attrs)
            if tag not in ("meta", "br", "link", "hr", "img"):
                self.open.append(tag)

        def handle_endtag(self, tag: str) -> None:
            assert self.open.pop() == tag

    page = ran("phrases", "--format", "html")
    balance = Balance()
    balance.feed(page)
    assert balance.open == []
    assert "water the yellow rose" in page


def test_a_team_of_the_settings_is_on_the_card(ran: Ran, tmp_path: Path) -> None:
    path = tmp_path / "hvcpd.yaml"
    path.write_text("team: garden\nnames: [Zoe]\n")
    card = ran("phrases", "--config", path)
    assert "garden" in card
    assert "Zoe" in card


@pytest.fixture(scope="module")
def sentence(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("said") / "order.wav"
    assert main(["say", "Hi Rob, I am Bot, water the yellow rose", "-o", str(path)]) == 0
    return path


def test_what_was_said_is_a_wav_of_16_khz_mono_16_bit(sentence: Path) -> None:
    header = sentence.read_bytes()[:44]
    assert header[20:36] == bytes.fromhex("0100 0100 803e0000 007d0000 0200 1000")
    samples = read_wav(sentence)
    assert 2.0 < len(samples) / SAMPLE_RATE_HZ < 6.0
    assert 0.02 < float(np.sqrt(np.mean(samples**2))) < 0.5


def test_what_was_said_is_heard(sentence: Path, ran: Ran, tmp_path: Path) -> None:
    samples = read_wav(sentence)
    noise = np.random.default_rng(1).standard_normal(len(samples) + 3 * SAMPLE_RATE_HZ).astype(np.float32) * 1e-4
    noise[2 * SAMPLE_RATE_HZ : 2 * SAMPLE_RATE_HZ + len(samples)] += samples
    write_wav(tmp_path / "room.wav", noise)
    (line,) = ran("hear", tmp_path / "room.wav", "--json").splitlines()
    heard = json.loads(line)
    assert heard.pop("start_s") == pytest.approx(2.0, abs=0.3)
    assert heard.pop("end_s") == pytest.approx(2.0 + len(samples) / SAMPLE_RATE_HZ, abs=0.4)
    assert 0.5 < heard.pop("confidence") <= 1.0
    assert heard == {"text": "Hi Rob, I am Bot, water the yellow rose", "speaker": "Bot", "addressee": "Rob"}
    assert "Hi Rob, I am Bot, water the yellow rose" in ran("hear", tmp_path / "room.wav")


def test_what_was_said_with_a_british_accent_is_heard_with_it(ran: Ran, tmp_path: Path) -> None:
    settings, wav = tmp_path / "hvcpd.yaml", tmp_path / "said.wav"
    settings.write_text("name: Rob\nnames: [Rob, Bot]\naccent: gb\n")
    text = "Hi Rob, I am Bot, water the yellow rose"
    ran("say", text, "--local", "--config", settings, "-o", wav)
    said, plain = read_wav(wav), tmp_path / "us.wav"
    ran("say", text, "--local", "-o", plain)
    assert read_wav(plain).shape != said.shape
    write_wav(wav, np.pad(said, SAMPLE_RATE_HZ))
    assert text in ran("hear", wav, "--config", settings)
    assert "W AO:1 TT AH0  WAW-tuh" in ran("pronounce", "water", "--config", settings)


def test_silence_has_no_sentence_and_says_so(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    quiet = np.random.default_rng(3).normal(0.0, 1e-3, SAMPLE_RATE_HZ).astype(np.float32)
    for sound, why in (
        (quiet, "no sentence of the phrasebook in"),
        (np.float32(0.01) * quiet, "is silent (1.0 s): its loudest sample has -90 dBFS"),
        (np.float32(0.0) * quiet, "is silent (1.0 s): all of its samples are zero; was the microphone muted"),
    ):
        write_wav(tmp_path / "quiet.wav", sound)
        assert main(["hear", str(tmp_path / "quiet.wav")]) == 0
        out, err = capsys.readouterr()
        assert out == ""
        assert why in err
    assert main(["hear", str(tmp_path / "quiet.wav"), "--json"]) == 0
    assert capsys.readouterr() == ("", "")


def test_robots_sound_different_and_each_always_the_same(
    sentence: Path, capsys: pytest.CaptureFixture[str], ran: Ran, tmp_path: Path
) -> None:
    text = "Hi Rob, I am Bot, water the yellow rose"
    ran("say", text, "-o", tmp_path / "again.wav")
    assert (tmp_path / "again.wav").read_bytes() == sentence.read_bytes()
    assert main(["say", text, "--as", "Rob", "-o", str(tmp_path / "other.wav")]) == 0
    assert "Bot's words in Rob's voice" in capsys.readouterr().err
    assert (tmp_path / "other.wav").read_bytes() != sentence.read_bytes()


def test_a_wav_that_cannot_be_written(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["say", "Hi, I am Rob", "-o", str(tmp_path / "none" / "x.wav")]) == 2
    assert "cannot be written" in capsys.readouterr().err


def paced(play: bool, speed: str = "max") -> argparse.Namespace:
    return argparse.Namespace(play=play, speed=speed)


def test_play_goes_to_the_loudspeaker_louder() -> None:
    card = FakeCard()
    quiet: Samples = np.full(400, 0.001, np.float32)
    with simulate.pacing(paced(True), card) as pace:
        pace(0.025, quiet)
        pace(0.05, np.full(400, 0.9, np.float32))
    np.testing.assert_allclose(card.played[0], quiet * simulate.LISTENER_GAIN)
    assert float(card.played[1].max()) == 1.0
    assert card.stream.closed


def test_play_without_a_loudspeaker_is_noted_once_and_goes_on_in_real_time(capsys: pytest.CaptureFixture[str]) -> None:
    with simulate.pacing(paced(True), FakeCard((CAMERA,))) as pace:
        pace(0.0, np.zeros(400, np.float32))
        pace(0.0, np.zeros(400, np.float32))
        assert isinstance(pace, simulate.RealTime)
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("hvcpctl: note: nothing is played: there is no loudspeaker")


def test_speed_chooses_the_pace() -> None:
    with simulate.pacing(paced(False, "real")) as pace:
        assert isinstance(pace, simulate.RealTime)
    with simulate.pacing(paced(False)) as pace:
        assert not isinstance(pace, simulate.RealTime)


@pytest.mark.slow
def test_what_is_said_can_be_piped_to_who_hears_it() -> None:
    hvcpctl = [sys.executable, "-m", "hvcpd.control.cli"]
    said = subprocess.run([*hvcpctl, "say", "Hi Rob, I am Bot, water the yellow rose", "-o", "-"], capture_output=True)
    assert said.stdout[:4] == b"RIFF"
    silence = bytes(2 * 16_000)
    heard = subprocess.run([*hvcpctl, "hear", "-"], input=said.stdout + silence, capture_output=True, check=True)
    assert b"water the yellow rose" in heard.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ("pronounce", "water"),
        ("pronounce", "water", "--json"),
        ("voices", "oak", "--text", "water"),
        ("say", "Hi Rob, I am Bot, water the yellow rose", "--json"),
    ],
)
def test_nothing_but_sound_goes_into_a_pipe(arguments: Sequence[str]) -> None:
    hvcpctl = [sys.executable, "-m", "hvcpd.control.cli"]
    piped = subprocess.run([*hvcpctl, *arguments, "-o", "-"], capture_output=True, check=True).stdout
    assert piped[:4] == b"RIFF"
    assert len(piped) == 8 + int.from_bytes(piped[4:8], "little")
