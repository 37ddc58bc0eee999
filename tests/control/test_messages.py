"""What `hvcpctl` answers to bad input: exit status 2 and one message that names the place and the remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from hvcpd.control.cli import main
from tests.control.conftest import Refuse

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("sentence", "part"),
    [
        ("Hi Rob, I am Bot, watter the yellow rose", "'watter' is not in the phrasebook"),
        ("Hi Rob, I am Bot, watter the yellow rose", "did you mean 'water'?"),
        ("good morning", "'good' is not in the phrasebook at the beginning"),
        ("Hi all, I am", "breaks off after 'hi all i am'; it could go on with"),
        ("Hi, I am Rob xylophone", "'xylophone'"),
        ("Hi, I am Zed", "'zed'"),
        ("", "there is no word to say"),
        ("?!", "there is no word to say"),
        ("Hi Rob, task one complete", "the speaker comes first: 'hi rob i am …'"),
        ("confirmed", "the speaker comes first: 'hi all i am …'"),
        ("Stop, Rob", "whom it is for comes first: 'rob stop'"),
        ("Rob, task one complete", "the speaker comes first: 'hi rob i am …'"),
        ("Hi Rob, I am Bot, battery twelve volts", "'battery' is not in the phrasebook after 'hi rob i am bot'; did"),
        ("Hi, I am Rob, task one complete now", "after 'hi i am rob task one complete'"),
    ],
)
def test_a_sentence_outside_the_phrasebook(sentence: str, part: str, refused: Refuse, tmp_path: Path) -> None:
    message = refused("say", sentence, "-o", tmp_path / "x.wav")
    assert part in message
    assert len(message.splitlines()) == 1
    assert "hvcpctl phrases" in message or "could go on with" in message
    assert not (tmp_path / "x.wav").exists()


def test_a_message_cannot_steer_the_terminal(refused: Refuse, tmp_path: Path) -> None:
    assert "\x1b" not in refused("say", "Hi \x1b[31mRob", "-o", tmp_path / "x.wav")


def test_names_make_words_known(refused: Refuse, tmp_path: Path) -> None:
    assert "'rob'" in refused("say", "Hi, I am Rob", "--names", "Zed,Bot", "-o", tmp_path / "x.wav")


@pytest.mark.parametrize(
    ("names", "part"),
    [
        ("R2-D2", "not a letter followed by letters and digits"),
        ("R2-D2,Bot,A b", "write for example 'R2D2'; the name 'A b' is not"),
        ("Rob,rob", "the same aloud"),
        ("Rob,Robb,Max,Maxx", "the names 'Max' and 'Maxx' sound the same"),
        ("Rob,rob,Bot,bot", "keep one; the names 'Bot' and 'bot' are"),
        (",", "at least one name"),
        ("Stop", "sounds like the phrasebook's word 'stop'"),
        ("Rob,Stopp", "sounds like the phrasebook's word 'stop'"),
        ("Rod,Tom", "the name 'Tom' sounds like the phrasebook's word 'come'"),
        ("José", "write for example 'Jose'"),
        ("R2-D2,Bot,Zoë", "; the name 'Zoë'"),
    ],
)
def test_names_that_cannot_be(names: str, part: str, refused: Refuse) -> None:
    assert part in refused("phrases", "--names", names)


@pytest.mark.parametrize("command", [["simulate"], ["phrases"], ["say", "stop", "-o", "x.wav"]])
@pytest.mark.parametrize("settings", ["names: [Rob,\n  Stop]\n", "names: [Rob]\nname: Stop\n"])
def test_a_name_in_the_settings_that_cannot_be_is_told_with_its_line(
    command: list[str], settings: str, refused: Refuse, tmp_path: Path
) -> None:
    (file := tmp_path / "hvcpd.yaml").write_text(settings)
    assert f"{file}:2: the name 'Stop' sounds like" in refused(*command, "--config", file)


@pytest.mark.parametrize(
    "command",
    [
        ["simulate", "--robots", "Rob,Robb"],
        ["say", "stop", "--names", "Rob,Robb", "-o", "x.wav"],
        ["say", "stop", "--names", "Rob", "--as", "Robb", "-o", "x.wav"],
        ["phrases", "--names", "Max,Rob,Robb"],
        ["prerender", "--names", "Rob,Robb"],
    ],
)
def test_names_that_sound_the_same(command: list[str], refused: Refuse) -> None:
    assert refused(*command) == ("hvcpctl: the names 'Rob' and 'Robb' sound the same; choose another for one of them\n")


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("tasks:\n- {number: 1, name: fetch the ball, actions: [{wait: 1}], colour: red}\n", "unknown key 'colour'"),
        ("tasks:\n- {number: one, name: fetch the ball, actions: [{wait: 1}]}\n", "expected a whole number"),
        (
            "tasks:\n- {number: 1, name: fetch the ball, actions: [{wait: 1}]}\n"
            "- {number: 1, name: guard the door, actions: [{wait: 1}]}\n",
            "task number 1 is taken in line 2",
        ),
        (
            "tasks:\n- {number: 1, name: fetch the ball, actions: [{wait: 1}]}\n"
            "- {number: 2, name: fetch the bowl, actions: [{wait: 1}]}\n",
            "sounds like 'fetch the ball' in line 2",
        ),
        ("tasks: [\n", "not valid YAML"),
        ("", "the key 'tasks' is missing"),
    ],
)
@pytest.mark.parametrize("command", [["phrases"], ["say", "Hi, I am Rob", "-o", "x.wav"], ["simulate", "--json"]])
def test_bad_tasks(text: str, part: str, command: list[str], refused: Refuse, tmp_path: Path) -> None:
    path = tmp_path / "tasks.yaml"
    path.write_text(text)
    message = refused(*command, "--tasks", path)
    assert part in message
    assert f"{path}:" in message


@pytest.mark.parametrize("option", ["--tasks", "--config"])
def test_files_that_cannot_be_read(option: str, refused: Refuse, tmp_path: Path) -> None:
    assert "there is no such file" in refused("phrases", option, tmp_path / "none.yaml")
    assert "this is a directory" in refused("phrases", option, tmp_path)
    (tmp_path / "latin.yaml").write_bytes(b"name: Ren\xe9\n")
    assert "latin.yaml:1: not UTF-8" in refused("phrases", option, tmp_path / "latin.yaml")


def test_a_bad_settings_file_tells_all_its_faults(refused: Refuse, tmp_path: Path) -> None:
    path = tmp_path / "hvcpd.yaml"
    path.write_text("taem: plant\nmode: boss\nteams: [A]\n")
    message = refused("phrases", "--config", path)
    assert [part in message for part in (":1: ", ":2: ", ":3: ")] == [True] * 3
    assert "did you mean 'team'?" in message


def test_a_bad_lexicon(refused: Refuse, tmp_path: Path) -> None:
    (tmp_path / "words.txt").write_text("rob R AA1 B\nzoe Z QQ\n")
    path = tmp_path / "hvcpd.yaml"
    path.write_text("lexicon: words.txt\n")
    assert "words.txt:2: unknown phone 'QQ'" in refused("phrases", "--config", path)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["sya", "Hi"], "sya"),
        (["say"], "TEXT"),
        (["hear"], "FILE.wav"),
        (["phrases", "--format", "pdf"], "pdf"),
        (["simulate", "--seed", "-1"], "whole number from 0 to 4294967295"),
        (["simulate", "--seed", "4294967296"], "whole number"),
        (["simulate", "--noise-db", "loud"], "is not a number"),
        (["console", "--port", "none"], "--port: 'none' is not a port from 0 to 65535"),
        (["simulate", "--noise-db", "nan"], "nan is not from -200 to 200 dB"),
        (["simulate", "--noise-db", "1e9"], "not from"),
        (["simulate", "--mode", "follow"], "follow"),
        (["simulate", "--coordinator", "Rob"], "add --mode coordinate"),
        (["simulate", "--mode", "coordinate", "--robots", "Rob"], "at least two"),
        (["simulate", "--mode", "coordinate", "--coordinator", "Zed"], "choose one of Rob, Bot"),
        (["simulate", "--robots", ",".join(f"N{n}" for n in range(13))], "at most 12"),
        (["say", "Hi, I am Rob", "--as", "R2-D2"], "not a letter followed by"),
        (["say", "stop", "--name", "Rob", "-o", "x.wav"], "--name has a robot say it, which -o does not change; leave"),
        (["say", "stop", "--socket", "none", "--rate", "1.2"], "--socket has a robot say it, which --rate does not"),
        (["say", "stop", "--name", "Rob", "--local"], "--name has a robot say it, which --local does not change"),
    ],
)
def test_wrong_usage(arguments: list[str], part: str, refused: Refuse) -> None:
    assert part in refused(*arguments)


def test_a_report_that_cannot_be_written_is_told_before_the_mission(refused: Refuse, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert "--report: " in refused("simulate", "--json", "--report", tmp_path / "file" / "report")


@pytest.mark.parametrize(
    ("option", "value", "part"),
    [
        ("--without", "Bob=pour", "--without: Bob does not take part; did you mean 'Rob'?"),
        ("--without", "Bot=pour", "Bot has no skill 'pour'; declare it under `skills:` in the task file"),
        ("--tank", "Bob=0.1", "--tank: Bob does not take part; did you mean 'Rob'?"),
        ("--tank", "Bot=much", "'much' is not a number from 0 to 1000 l"),
        ("--tank", "Bot=0.1", "--tank: no task uses a pump; give a skill a pin (`gpio:`) in the settings, or leave it"),
    ],
)
def test_a_skill_or_a_tank_that_no_robot_has(
    option: str, value: str, part: str, refused: Refuse, tmp_path: Path
) -> None:
    tasks = tmp_path / "tasks.yaml"
    tasks.write_text("tasks:\n- {number: 1, name: fetch the ball, actions: [{wait: 5}]}\n", encoding="utf-8")
    assert part in refused("simulate", "--robots", "Rob,Bot", "--tasks", tasks, option, value)


def test_commands_that_a_message_proposes_can_be_copied_whatever_the_file_is_called(
    refused: Refuse, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a name with a space the shell made two."""
    path = tmp_path / "my key"
    path.write_text("junk")
    assert f"`sox '{path}' new.wav`" in refused("hear", path)
    path.chmod(0o644)
    assert f"chmod 600 '{path}'" in refused("key", "show", "--key", path)
    path.write_text("name: Zorg\n")
    assert main(["status", "--config", str(path)]) == 3
    assert f"`hvcpd --config '{path}' --name Zorg`" in capsys.readouterr().err


def test_a_recording_that_is_not_there(refused: Refuse, tmp_path: Path) -> None:
    message = refused("mcap", tmp_path / "none", tmp_path / "x.mcap")
    assert message.startswith(f"hvcpctl: {tmp_path / 'none'}: there is no such file; check the name")
    (tmp_path / "bytes").write_bytes(b"\xff\xfe")
    assert "this is no text; is this a transcript of `simulate" in refused("mcap", tmp_path / "bytes", tmp_path / "x")


def test_a_task_file_in_place_of_the_settings(refused: Refuse, tmp_path: Path) -> None:
    tasks = tmp_path / "tasks.yaml"
    tasks.write_text("tasks:\n- {number: 1, name: fetch the ball, actions: [{wait: 5 s}]}\n", encoding="utf-8")
    assert "expected a file name, found a list; name the file that has it" in refused("phrases", "--config", tasks)
    assert "found the text '5 s'; write it without quotes or unit" in refused("phrases", "--tasks", tasks)
