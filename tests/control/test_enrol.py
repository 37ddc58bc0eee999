"""`hvcpctl enrol`: a person's words from WAVs and from the microphone, and what can be done with them."""

from __future__ import annotations

import argparse
import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hvcpd.control.cli import main, make_parser
from hvcpd.control.enrol.enrol import run
from hvcpd.control.enrol.enrol_sentences import SENTENCES
from hvcpd.control.enrol.enrol_session import record_takes
from hvcpd.daemon.devices import Devices
from hvcpd.hardware.audio_exchange import StreamCounters
from hvcpd.hardware.soundfile import write_wav
from hvcpd.language.words import strict_words
from hvcpd.memory.people import content, person_path, read_person, write_person
from hvcpd.people.enrolled import Person
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import Voice
from tests.recognition.signals import word

LEXICON = Lexicon.load()
QUIET = np.zeros(SAMPLE_RATE_HZ // 3, np.float32)
SAID = ("stop", "rob", "bot", "water")


def spoken(name: str, pitch_hz: float = 120.0) -> Samples:
    return np.concatenate([QUIET, word(name, pitch_hz), QUIET])


def sentence(text: str) -> Samples:
    """In a voice that no robot has."""
    voice = Voice("child", 240.0, 1.35, 0.92, -32.0, 0.6, 3000.0)
    return room(np.pad(Speaker(voice, LEXICON).render([strict_words(text)]), SAMPLE_RATE_HZ // 2))


def room(sound: Samples, seed: int = 1) -> Samples:
    return np.asarray(sound + 1e-4 * np.random.default_rng(seed).standard_normal(len(sound)), np.float32)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    takes = tmp_path / "takes"
    takes.mkdir()
    for name in SAID:
        for k, pitch_hz in enumerate((118.0, 122.0, 126.0), 1):
            write_wav(takes / f"{name}_{k}.wav", room(spoken(name, pitch_hz)))
    return takes


def enrol(tmp_path: Path, *more: str) -> int:
    return main(["enrol", "--state-dir", str(tmp_path / "state"), *more])


def test_words_from_wavs_are_kept(tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_wav(folder / "hi_1.wav", np.clip(60.0 * spoken("hi"), -1.0, 1.0))
    write_wav(folder / "holiday.wav", room(spoken("rose")))
    write_wav(folder / "stop_4.wav", room(spoken("rose")))
    assert enrol(tmp_path, "Anna", "--from", str(folder), "--json") == 0
    told: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert told["words"] == len(SAID)
    assert told["takes"] == 3 * len(SAID)
    assert "hi" in told["missing"]
    reasons = "\n".join(told["rejected"])
    assert "hi_1.wav: it is too loud for the microphone" in reasons
    assert "holiday.wav: not named after a word" in reasons
    assert "'stop', take 4: unlike the others" in reasons
    person = read_person(person_path(tmp_path / "state", "Anna"))
    assert person.takes.keys() == set(SAID)
    assert len(person.takes["stop"]) == 3


def test_of_wavs_of_other_words_than_are_wanted_nothing_is_told(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert enrol(tmp_path, "Anna", "--from", str(folder), "--words", "stop", "--json") == 0
    told: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert (told["takes"], told["rejected"]) == (3, [])


def test_who_has_a_broken_file_is_told_how_to_enrol_anew(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = person_path(tmp_path / "state", "Anna")
    path.parent.mkdir(parents=True)
    path.write_bytes(b"PK")
    assert enrol(tmp_path, "Anna", "--from", str(folder)) == 2
    assert "first remove the old takes: hvcpctl enrol Anna --remove" in capsys.readouterr().err
    assert enrol(tmp_path, "Anna", "--remove") == 0
    assert enrol(tmp_path, "Anna", "--from", str(folder), "--words", "stop") == 0


def test_sentences_from_wavs_are_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert enrol(tmp_path, "Anna", "--show") == 0
    texts = capsys.readouterr().out.splitlines()
    assert len(texts) == SENTENCES
    takes = tmp_path / "takes"
    takes.mkdir()
    for name, text in zip(("sentence_1.wav", "Sentence_2.WAV", "sentence_3.wav"), texts[:3], strict=True):
        write_wav(takes / name, sentence(text))
    write_wav(takes / "sentence_4.wav", sentence(texts[0]))
    write_wav(takes / "sentence_9.wav", sentence(texts[0]))
    assert enrol(tmp_path, "Anna", "--from", str(takes), "--json") == 0
    told: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert (told["sentences"], told["words"], told["missing"]) == (3, 0, [])
    assert told["rejected"] == [
        "sentence_4.wav: that was not the sentence, or it was hardly to be understood",
        f"sentence_9.wav: there are {SENTENCES} sentences: hvcpctl enrol NAME --show",
    ]
    person = read_person(person_path(tmp_path / "state", "Anna"))
    assert {each.words for each in person.sentences} == {strict_words(text) for text in texts[:3]}
    assert enrol(tmp_path, "--list") == 0
    assert capsys.readouterr().out == "Anna: 3 sentences, 0 words, 0 takes\n"


def test_recordings_that_are_known_are_not_added_again(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same folder, read twice, doubled the sentences and takes."""
    assert enrol(tmp_path, "Anna", "--show") == 0
    texts = capsys.readouterr().out.splitlines()
    write_wav(folder / "sentence_1.wav", sentence(texts[0]))
    assert enrol(tmp_path, "Anna", "--from", str(folder)) == 0
    assert "known already" not in capsys.readouterr().out
    once = read_person(person_path(tmp_path / "state", "Anna"))
    write_wav(folder / "sentence_2.wav", sentence(texts[1]))
    assert enrol(tmp_path, "Anna", "--from", str(folder)) == 0
    told = capsys.readouterr().out
    assert "Anna: 13 recordings known already, and not added again\nAnna: 1 sentence, kept in" in told
    twice = read_person(person_path(tmp_path / "state", "Anna"))
    assert (len(twice.sentences), len(content(twice)["takes"])) == (2, len(content(once)["takes"]))
    assert enrol(tmp_path, "Anna", "--from", str(folder)) == 0
    assert content(twice) == content(read_person(person_path(tmp_path / "state", "Anna")))


@pytest.mark.parametrize("said", ["Anna", "Bella"])
def test_recordings_that_name_another_person_are_told(
    said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Anna's became Bella's without a word."""
    config, takes = tmp_path / "hvcpd.yaml", tmp_path / "takes"
    config.write_text("names: [Rob, Bot, Anna, Ben]\n")
    takes.mkdir()
    assert enrol(tmp_path, "Bella", "--config", str(config), "--show") == 0
    for n, text in enumerate(capsys.readouterr().out.splitlines()[:2], 1):
        write_wav(takes / f"sentence_{n}.wav", sentence(text.replace("Bella", said)))
    assert enrol(tmp_path, "Bella", "--config", str(config), "--from", str(takes)) == 0
    told = capsys.readouterr().out
    warning = "Bella: they say 'I am Anna', and not 'Bella'; if the voice is not Bella's: hvcpctl enrol Bella --remove"
    assert (warning in told) == (said == "Anna")
    assert "Bella: 2 sentences" in told


def test_who_is_enrolled_in_the_folder_is_known(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With --state-dir those were known who are enrolled in the settings' folder."""
    takes = tmp_path / "takes"
    takes.mkdir()
    assert enrol(tmp_path, "Anna", "--show") == 0
    for n, text in enumerate(capsys.readouterr().out.splitlines()[:2], 1):
        write_wav(takes / f"sentence_{n}.wav", sentence(text))
    assert enrol(tmp_path, "Anna", "--from", str(takes)) == 0
    assert enrol(tmp_path, "Bella", "--from", str(takes)) == 0
    assert "Bella: they say 'I am Anna', and not 'Bella'" in capsys.readouterr().out
    assert enrol(tmp_path, "Ana", "--show") == 2
    assert "the names 'Anna' and 'Ana' sound the same" in capsys.readouterr().err


def test_the_words_are_shown_if_words_are_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It showed the sentences."""
    assert enrol(tmp_path, "Anna", "--show", "--words", "rob,stop") == 0
    assert capsys.readouterr().out == "rob\nstop\n"
    assert enrol(tmp_path, "Anna", "--show", "--words", "fly") == 2
    assert "'fly' is not a word of the phrasebook" in capsys.readouterr().err


def test_the_sentences_are_orders_to_the_robot_itself_and_have_many_sounds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert enrol(tmp_path, "Zoe", "--show") == 0
    texts = capsys.readouterr().out.splitlines()
    assert all(" I am Zoe, " in text and "stop" not in text.split() for text in texts)
    phones = {phone for text in texts for word in strict_words(text) for phone in LEXICON.sounds(word)[0]}
    assert len(phones) >= 30


def test_people_come_go_and_move(tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "anna.npz"
    assert enrol(tmp_path, "Anna", "--from", str(folder)) == 0
    assert enrol(tmp_path, "Anna", "--export", str(tmp_path / "none" / "anna.npz")) == 2
    assert f"there is no folder {tmp_path / 'none'}; make it" in capsys.readouterr().err
    assert enrol(tmp_path, "Anna", "--export", str(file)) == 0
    assert enrol(tmp_path, "Anna", "--remove") == 0
    capsys.readouterr()
    assert enrol(tmp_path, "--list") == 0
    assert "nobody is enrolled" in capsys.readouterr().out
    assert enrol(tmp_path, "Anna", "--remove") == 2
    assert "not enrolled" in capsys.readouterr().err
    assert enrol(tmp_path, "Ben", "--import", str(file)) == 2
    assert "this is Anna, not Ben" in capsys.readouterr().err
    assert enrol(tmp_path, "--import", str(file)) == 0
    capsys.readouterr()
    assert enrol(tmp_path, "--list", "--json") == 0
    assert json.loads(capsys.readouterr().out) == [{"name": "Anna", "sentences": 0, "words": 4, "takes": 12}]


def test_what_is_imported_is_added_to_what_is_known(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "anna.npz"
    assert enrol(tmp_path, "Anna", "--from", str(folder)) == 0
    kept = person_path(tmp_path / "state", "Anna")
    whole = read_person(kept)
    one, *others = whole.takes.items()
    write_person(file, replace(whole, takes=dict([one])))
    write_person(kept, replace(whole, takes=dict(others)))
    capsys.readouterr()
    assert enrol(tmp_path, "--import", str(file)) == 0
    assert f"{len(whole.takes)} words" in capsys.readouterr().out
    assert content(read_person(kept)) == content(whole)
    assert enrol(tmp_path, "--import", str(file)) == 0
    assert "is known already" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ((), "whose voice"),
        (("A b",), "not a letter followed by"),
        (("Anna", "--from", "nowhere"), "nowhere is no folder"),
        (("Anna", "--from", ".", "--words", "stop,banana"), "'banana' is not a word"),
        (("--import", "nothing.npz"), "nothing.npz"),
        (("Anna", "--words", ","), "--words: there is no word in ','"),
    ],
)
def test_what_is_wrong_is_told(
    tmp_path: Path, arguments: tuple[str, ...], why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert enrol(tmp_path, *arguments) == 2
    assert why in capsys.readouterr().err


def test_a_file_in_place_of_the_robots_folder_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nobody was enrolled there."""
    (tmp_path / "state").touch()
    assert enrol(tmp_path, "--list") == 2
    assert f"{tmp_path / 'state'}: this is no folder" in capsys.readouterr().err


class Microphone:
    """A person who says what is on the script, one item for each time that there is quiet for long."""

    latency_s = 0.0
    counters = StreamCounters()

    def __init__(self, script: list[Samples]) -> None:
        self.sound = room(np.concatenate([np.zeros(2 * SAMPLE_RATE_HZ, np.float32), *script]), seed=3)
        self.at = 0
        self.open_now = False

    async def open(self, afresh: bool = False) -> None:
        self.open_now = True

    async def start(self) -> None:
        pass

    async def read(self) -> Samples:
        self.at += 400
        if self.at > len(self.sound):
            return room(np.zeros(400, np.float32), self.at)
        return self.sound[self.at - 400 : self.at]

    def write(self, samples: Samples) -> None:
        assert not samples.any()

    async def close(self) -> None:
        self.open_now = False


def said(name: str, pitch_hz: float = 120.0) -> Samples:
    return np.concatenate([word(name, pitch_hz), np.zeros(SAMPLE_RATE_HZ, np.float32)])


def test_the_session_asks_again_for_what_was_no_good() -> None:
    two_at_once = np.concatenate([word("rob"), np.zeros(5000, np.float32), said("bot")])
    script = [said("stop"), two_at_once, said("rob"), said("stop", 124.0), said("rob", 124.0)]
    microphone, out = Microphone(script), io.StringIO()
    found = record_takes(["stop", "rob"], 2, microphone, out)
    assert {name: len(takes) for name, takes in found.items()} == {"stop": 2, "rob": 2}
    assert out.getvalue().count("once more: there is a pause in it") == 1
    assert out.getvalue().count("good") == 4
    assert "[4/4] ROB" in out.getvalue()
    assert not microphone.open_now


def test_who_says_nothing_is_not_waited_for_for_ever() -> None:
    out = io.StringIO()
    assert record_takes(["stop"], 1, Microphone([]), out) == {}
    assert "'stop' is left out; enrol it later with --words stop" in out.getvalue()


def test_an_offset_of_the_microphone_is_no_noise() -> None:
    """It hid words that were not four times as loud; a session was of no use."""
    microphone = Microphone([said("stop")])
    microphone.sound = microphone.sound + np.float32(0.1)
    assert record_takes(["stop"], 1, microphone, io.StringIO()).keys() == {"stop"}


def test_the_command_records_from_the_microphone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script = [said("stop"), said("stop", 123.0), said("stop", 126.0)]
    arguments = ["enrol", "Anna", "--state-dir", str(tmp_path), "--words", "stop"]
    options: argparse.Namespace = make_parser().parse_args(arguments)
    assert run(options, Devices(make_stream=lambda _settings: Microphone(script))) == 0
    assert "Anna: 1 word, 3 takes" in capsys.readouterr().out
    assert len(read_person(person_path(tmp_path, "Anna")).takes["stop"]) == 3


def test_the_command_records_sentences_from_the_microphone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert enrol(tmp_path, "Anna", "--show") == 0
    texts = capsys.readouterr().out.splitlines()
    quiet = np.zeros(2 * SAMPLE_RATE_HZ, np.float32)
    script = [np.concatenate([sentence(text), quiet]) for text in (texts[0], texts[2], *texts[1:])]
    options: argparse.Namespace = make_parser().parse_args(["enrol", "Anna", "--state-dir", str(tmp_path)])
    assert run(options, Devices(make_stream=lambda _settings: Microphone(script))) == 0
    out = capsys.readouterr().out
    assert f"[2/5] {texts[1]}  once more: that was not the sentence" in out
    assert "Anna: 5 sentences, kept in" in out
    assert len(read_person(person_path(tmp_path, "Anna")).sentences) == 5


def test_nobody_is_enrolled_under_the_robots_own_name(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The file was written, and the robot left it out without a word."""
    config, file = tmp_path / "hvcpd.yaml", tmp_path / "rob.npz"
    config.write_text("name: Rob\nnames: [Rob, Bot]\n")
    write_person(file, Person("rob"))
    for more in ("Rob", "--from", str(folder)), ("--import", str(file)), ("Rob", "--show"):
        assert enrol(tmp_path, "--config", str(config), *more) == 2
        assert "hvcpctl: Rob is this robot's own name, and it obeys nobody by that name" in capsys.readouterr().err
    assert not (tmp_path / "state").exists()


def test_who_is_enrolled_under_the_name_of_a_robot_is_told(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From its next start on Rob took Bot for a person, and understood it no more."""
    config = tmp_path / "hvcpd.yaml"
    config.write_text("name: Rob\nnames: [Rob, Bot]\n")
    for name in ("Bot", "Anna"):
        assert enrol(tmp_path, name, "--config", str(config), "--from", str(folder), "--words", "stop") == 0
        assert ("if it is a robot's: hvcpctl enrol Bot --remove" in capsys.readouterr().err) == (name == "Bot")


def test_a_file_of_somebody_whose_name_cannot_be_used_is_not_imported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No robot started any more, and no command worked."""
    for name, why in (("friend", "the phrasebook's word 'friend'"), ("Robb", "'Rob' and 'Robb' sound the same")):
        write_person(file := tmp_path / f"{name}.npz", Person(name))
        assert enrol(tmp_path, "--import", str(file)) == 2
        assert why in capsys.readouterr().err
