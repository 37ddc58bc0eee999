"""`pronounce`, `prerender` and the ways of `say`, as a person types them."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hvcpd.control.cli import main
from hvcpd.hardware.soundfile import read_wav, write_wav
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.synthesis.explain import PAPER_TABLE
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker, UnitPosition
from hvcpd.synthesis.voices import voice_named
from tests.control.conftest import Ran, Refuse
from tests.full_disk import no_new_bytes

pytestmark = pytest.mark.slow

SENTENCE = "Hi Rob, I am Bot, water the yellow rose"
OWN_LEXICON = Path(__file__).parents[2] / "etc" / "lexicon.txt"


def test_every_pronunciation_is_shown_the_used_one_marked(ran: Ran) -> None:
    lines = ran("pronounce", "I will wind the clock", "Zorg").splitlines()
    at = lines.index("wind")
    assert "W IH1 N D" in lines[at + 1]
    assert lines[at + 2].startswith("  * W AY1 N D")
    assert "a verb" in lines[at + 2]
    assert "letter to sound" in lines[lines.index("zorg") + 1]


def test_the_paper_table_has_its_words_with_all_their_pronunciations(ran: Ran) -> None:
    rows = [json.loads(line) for line in ran("pronounce", "--paper-table", "--json").splitlines()]
    assert [row["word"] for row in rows] == list(PAPER_TABLE)
    assert all(len(row["possible"]) == 2 and row["alone"] in row["possible"] for row in rows)
    by_word = {row["word"]: row for row in rows}
    assert by_word["wind"]["verb"] == "weyend"
    assert by_word["lead"]["noun"] == "lehd"
    assert by_word["read"]["past"] == "rehd"
    text = ran("pronounce", "--paper-table")
    assert all(f"\n{word} " in f"\n{text}" for word in PAPER_TABLE)


def test_the_lexicon_of_etc_is_good_and_stands_over_all_others(ran: Ran) -> None:
    row = json.loads(ran("pronounce", "Xiu", "--lexicon", OWN_LEXICON, "--json"))
    used, replaced = row["pronunciations"]
    assert (used["phones"], used["source"], used["used"]) == ("SH Y UW1", "your lexicon", True)
    assert (replaced["source"], replaced["used"]) == ("letter to sound", False)


def test_words_can_be_heard_and_their_frames_written(ran: Ran, tmp_path: Path, refused: Refuse) -> None:
    assert "--as changes the sound alone" in refused("pronounce", "water", "--as", "Bot")
    ran("pronounce", "water", "-o", tmp_path / "x.wav", "--track", tmp_path / "x.csv", "--as", "Bot")
    assert len(read_wav(tmp_path / "x.wav")) > 0.2 * SAMPLE_RATE_HZ
    with (tmp_path / "x.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[1]["t"]) == pytest.approx(0.005)
    assert all(200.0 < float(row["F1"]) < float(row["F2"]) < float(row["F3"]) for row in rows)


def test_quantities_are_explained_in_the_words_that_are_said(ran: Ran) -> None:
    text = "Tue, 5 Dec, 10 am, 20cm, 3.5"
    rows = [json.loads(line) for line in ran("pronounce", text, "--json").splitlines()]
    assert " ".join(row["word"] for row in rows) == (
        "tuesday five december ten a m twenty centimetres three point five"
    )


def test_the_frames_can_be_piped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["pronounce", "water", "--track", "-"]) == 0
    rows = list(csv.DictReader(capfd.readouterr().out.splitlines()))
    assert len(rows) > 20
    assert float(rows[1]["t"]) == pytest.approx(0.005)
    assert list(tmp_path.iterdir()) == []


def test_words_are_heard_in_the_voice_that_the_settings_choose(
    capsys: pytest.CaptureFixture[str], ran: Ran, tmp_path: Path
) -> None:
    config = tmp_path / "hvcpd.yaml"
    config.write_text("name: Rob\nvoice: granite\n")
    ran("pronounce", "water", "--config", config, "-o", tmp_path / "x.wav", "--track", tmp_path / "x.csv")
    said = Speaker(voice_named("granite"), Lexicon.load()).render([["water"]])
    assert np.allclose(read_wav(tmp_path / "x.wav"), said, atol=1e-3)
    with (tmp_path / "x.csv").open() as file:
        assert all(float(row["F0"]) < 1.4 * voice_named("granite").f0_hz for row in csv.DictReader(file))
    config.write_text("name: Rob\nsynthesizer: natural\n")
    assert main(["pronounce", "water", "--config", str(config), "--track", str(tmp_path / "x.csv")]) == 2
    assert "natural voices have no such frames" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ((), "give words"),
        (("water", "--paper-table"), "give words"),
        (("--paper-table", "-o", "table.wav"), "alone"),
        (("\U0001f389",), "cannot be said"),
        (("\x01\x7f",), "cannot be said"),
        (("1,000 roses",), "'1,000' in '1,000 roses' cannot be said: write it in words"),
        (("turn -5",), "'-5' in 'turn -5' cannot be said"),
        (("",), "nothing to say"),
        (("word " * 10_000,), "more than 1000 words"),
        (("two", "words", "--track", "x.csv"), "--track takes one word"),
        (("rob", "-o", "/dev/stdout", "--track", "-"), "-o and --track cannot both go to standard output"),
        (("rob", "--lexicon", "/nowhere/x.txt"), "/nowhere/x.txt"),
    ],
    ids=[
        "none",
        "both",
        "table and file",
        "emoji",
        "control characters",
        "comma",
        "minus",
        "empty",
        "ten thousand words",
        "track",
        "one pipe for two",
        "no file",
    ],
)
def test_what_cannot_be_pronounced(arguments: tuple[str, ...], part: str, refused: Refuse) -> None:
    assert part in refused("pronounce", *arguments)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=st.text(max_size=30))
def test_any_text_is_explained_or_refused(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = main(["pronounce", "--", text])
    out, err = capsys.readouterr()
    refused = "nothing to say" in err or "cannot be said" in err
    assert (status == 0 and "*" in out and not err) or (status == 2 and refused)


def test_a_faulty_lexicon_names_its_lines(refused: Refuse, tmp_path: Path) -> None:
    own = tmp_path / "own.txt"
    own.write_text("rob R QQ1 B\nzoe Z OW1 IY\n")
    message = refused("pronounce", "rob", "--lexicon", own)
    assert f"{own}:1: unknown phone 'QQ1'; the phones are AA AE" in message
    assert f"{own}:2:" in message
    own.write_bytes(b"rob R AA1 B\nzo\xeb Z OW1 IY0\n")
    message = refused("pronounce", "rob", "--lexicon", own)
    assert message == f"hvcpctl: {own}:2: not UTF-8 text; save the file as UTF-8\n"


def test_rate_gain_and_lombard_are_heard(tmp_path: Path) -> None:
    def said(*options: str) -> np.ndarray:
        out = tmp_path / "x.wav"
        assert main(["say", SENTENCE, "-o", str(out), *options]) == 0
        return read_wav(out)

    plain = said()
    assert len(said("--rate", "1.5")) < 0.8 * len(plain)
    assert float(np.std(said("--lombard"))) > 1.2 * float(np.std(plain))
    softer = said("--gain-db", "-12")
    assert float(np.std(softer)) == pytest.approx(float(np.std(plain)) * 10.0**-0.6, rel=0.02)
    assert float(np.max(np.abs(said("--gain-db", "20")))) <= 10.0 ** (-1.0 / 20.0)


@pytest.mark.parametrize("text", ["I am Rob", "stop"])
def test_an_error_in_the_settings_is_told_once(text: str, refused: Refuse, tmp_path: Path) -> None:
    config = tmp_path / "hvcpd.yaml"
    config.write_text("nonsense: 3\n")
    assert refused("say", text, "--config", config).count("unknown key 'nonsense'") == 1


@pytest.mark.parametrize(("rate", "noted"), [("1.25", False), ("0.9", False), ("1.5", True), ("0.6", True)])
def test_speech_that_robots_do_not_understand_is_noted(
    rate: str, noted: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["say", "stop", "--rate", rate, "-o", str(tmp_path / "x.wav")]) == 0
    note = "hvcpctl: note: for people; robots understand 0.7 to 1.25 of the usual rate\n"
    assert capsys.readouterr().err == note * noted


def test_a_greeting_that_robots_do_not_hear_is_said_as_a_question(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["say", "Hi Rob", "--json", "-o", str(tmp_path / "x.wav")]) == 0
    out, err = capsys.readouterr()
    assert err == "hvcpctl: note: said as 'Rob, who is here', which robots hear\n"
    assert json.loads(out)["text"] == "Rob, who is here"


@pytest.mark.parametrize("options", [("--rate", "3"), ("--rate", "x"), ("--rate", "nan"), ("--gain-db", "inf")])
def test_a_setting_out_of_range_is_refused(options: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["say", "stop", *options])
    assert end.value.code == 2
    assert options[0] in capsys.readouterr().err


def record(folder: Path, *words: str) -> None:
    speaker = Speaker(voice_named("granite"), Lexicon.load())
    for word in words:
        write_wav(folder / f"{word.title()}.WAV", np.pad(0.2 * speaker.unit(word, UnitPosition.FINAL), 4000))


def test_a_robot_speaks_with_recorded_words(tmp_path: Path, refused: Refuse) -> None:
    folder = tmp_path / "voice"
    folder.mkdir()
    record(folder, "hi", "rob", "i", "am", "bot", "water", "the")
    message = refused("say", SENTENCE, "--voice", folder, "-o", tmp_path / "x.wav")
    assert "no recording of rose, yellow" in message
    assert "--as: not allowed with argument --voice" in refused("say", SENTENCE, "--voice", folder, "--as", "Rob")
    record(folder, "yellow", "rose")
    assert main(["say", SENTENCE, "--voice", str(folder), "-o", str(tmp_path / "x.wav")]) == 0
    assert len(read_wav(tmp_path / "x.wav")) > 2.0 * SAMPLE_RATE_HZ
    (folder / "Rose.WAV").write_bytes(b"RIFF")
    write_wav(folder / "The.WAV", np.zeros(8000, np.float32))
    message = refused("say", SENTENCE, "--voice", folder, "-o", tmp_path / "x.wav")
    assert "Rose.WAV" in message
    assert "The.WAV: it is silent" in message
    for option in (("--rate", "1.5"), ("--natural",)):
        assert "--rate" in refused("say", SENTENCE, "--voice", folder, *option, "-o", tmp_path / "x.wav")
    assert "no such folder" in refused("say", SENTENCE, "--voice", tmp_path / "nowhere", "-o", tmp_path / "x.wav")


def files_of(folder: Path) -> dict[Path, int]:
    return {path: path.lstat().st_mtime_ns for name in ("units", "vocabulary") for path in (folder / name).iterdir()}


@pytest.mark.slow
def test_a_daemon_makes_nothing_anew_after_prerendering(tmp_path: Path, units: Path, ran: Ran) -> None:
    """Every twentieth of the words that other tests have rendered is missing, of whatever kind, and more."""
    state, config = tmp_path / "state", tmp_path / "hvcpd.yaml"
    (state / "units").mkdir(parents=True)
    for number, unit in enumerate(sorted(units.glob("*.unit"))):
        if number % 20:
            (state / "units" / unit.name).symlink_to(unit)
    config.write_text(f"name: Rob\nstate_dir: {state}\nwheels: {{driver: none}}\nseed: 1\n")
    out = json.loads(ran("prerender", "--config", config, "--json"))
    assert (out["names"], out["folder"], out["for_service"]) == (["Rob"], str(state / "units"), True)
    before = files_of(state)
    assert len(list((state / "units").glob("*.unit"))) > 300
    assert main(["prerender", "--config", str(config)]) == 0, "as it is safe to do it again"
    room = ["-m", "tests.daemon.quiet_robot", "--config", str(config), "--name", "Rob"]
    robot = subprocess.Popen([sys.executable, *room], stderr=subprocess.PIPE, text=True)
    assert robot.stderr is not None
    with robot:
        for line in robot.stderr:
            if "waveforms of the others' voices ready" in line:
                robot.terminate()  # once to say that it leaves, and again
                robot.terminate()
    assert files_of(state) == before


def test_a_cache_that_cannot_be_written_is_told_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: Refuse
) -> None:
    config, home = tmp_path / "hvcpd.yaml", tmp_path / "cache"
    config.write_text(f"name: Rob\nstate_dir: {tmp_path / 'none'}\n")
    home.write_text("no folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(home))
    told = refused("prerender", "--config", config)
    assert told.startswith(f"hvcpctl: {home / 'hvcpd' / 'units'}: cannot be written: ")
    assert "set XDG_CACHE_HOME" in told


def team_of_one(folder: Path) -> Path:
    """The settings of one robot with one task, whose state folder is missing."""
    config = folder / "hvcpd.yaml"
    (folder / "tasks.yaml").write_text(
        "tasks: [{number: 1, name: water the rose, place: {x_m: 0, y_m: 0}, actions: [say: all roses have water]}]"
    )
    config.write_text(f"name: Rob\nnames: [Rob]\nstate_dir: {folder / 'none'}\ntasks: tasks.yaml\n")
    return config


@pytest.mark.parametrize("bytes_left", [0, 4096])
def test_a_disk_that_is_full_or_becomes_so_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: Refuse, bytes_left: int
) -> None:
    config = team_of_one(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with no_new_bytes(beyond=bytes_left):
        told = refused("prerender", "--config", config)
    assert f"{tmp_path / 'cache' / 'hvcpd' / 'units'}: cannot be written: File too large; make room there" in told


def test_who_cannot_write_the_services_cache_is_told_how(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Where there is none yet, it was said that this user cannot write it."""
    config, told = team_of_one(tmp_path), f"a service reads {tmp_path / 'none' / 'units'}, which"
    assert main(["prerender", "--config", str(config)]) == 0
    assert f"{told} is not there yet\n" in capsys.readouterr().err
    (tmp_path / "none").write_text("in the way")
    assert main(["prerender", "--config", str(config)]) == 0
    err = capsys.readouterr().err
    assert f"{told} you cannot write; for that one: sudo -u {tmp_path.owner()} hvcpctl prerender --config " in err
