"""Settings: defaults, files, options over them, and every fault told at its line."""

from __future__ import annotations

import dataclasses
import math
import os
from pathlib import Path

import pytest
import yaml

from hvcpd.config.settings import (
    DEFAULT_TEAMS,
    MAX_TEAMS,
    AudioSettings,
    ClipSettings,
    ControlSettings,
    PeerSettings,
    Settings,
    SpeechSettings,
    StartSettings,
    WaitSettings,
    WheelSettings,
)
from hvcpd.config.settings_file import load_settings
from hvcpd.config.skill_settings import StopButtonSettings
from hvcpd.config.tasks import default_tasks_path
from hvcpd.errors import ConfigError
from hvcpd.synthesis.likeness import name_check

ETC = Path(__file__).parents[2] / "etc"


def load(tmp_path: Path, text: str, **overrides: object) -> Settings:
    path = tmp_path / "hvcpd.yaml"
    path.write_text(text)
    return load_settings(path, overrides)


def test_a_skill_that_is_done_in_no_way_is_told_at_its_line(tmp_path: Path) -> None:
    """The line was that of `skills:`."""
    (found,) = faults(tmp_path, "name: Rob\nskills:\n  pour: {run: [sh]}\n  grip: {}\n")
    assert found.startswith("F:4: grip: give one of `run: [program, …]`")


def faults(tmp_path: Path, text: str, **overrides: object) -> list[str]:
    with pytest.raises(ConfigError) as error:
        load(tmp_path, text, **overrides)
    return [line.replace(str(tmp_path / "hvcpd.yaml"), "F") for line in str(error.value).splitlines()]


def test_only_the_name_is_needed(tmp_path: Path) -> None:
    settings = load(tmp_path, "name: Rob\n")
    assert settings == Settings(name="Rob")
    assert settings.teams == DEFAULT_TEAMS
    assert settings.tasks == default_tasks_path()


def test_the_former_name_of_a_wheel_driver_still_works(tmp_path: Path) -> None:
    assert load(tmp_path, "name: Rob\nwheels: {driver: xl430}\n").wheels == WheelSettings(driver="dynamixel")


def test_without_a_file_the_options_do(tmp_path: Path) -> None:
    nowhere = tmp_path / "none.yaml"
    assert load_settings(None, {"name": "Bot"}, system_path=nowhere) == Settings(name="Bot")
    with pytest.raises(ConfigError, match="give --name NAME"):
        load_settings(None, {}, system_path=nowhere)
    assert load_settings(None, {}, name_needed=False, system_path=nowhere).name == "Rob"


def test_the_system_file_is_read_unless_another_is_named(tmp_path: Path) -> None:
    system = tmp_path / "system.yaml"
    system.write_text("name: Bot\nteam: garden\n")
    assert load_settings(None, system_path=system).team == "garden"
    assert load_settings(None, {"name": "Rob"}, system_path=system).name == "Rob"
    own = tmp_path / "own.yaml"
    own.write_text("name: Rob\n")
    assert load_settings(own, system_path=system).team == "plant"


def test_options_stand_over_the_file_and_null_means_not_given(tmp_path: Path) -> None:
    settings = load(tmp_path, "name: Rob\nteam: a\naudio: {queue_s: 1}\n", team="garden", name=None)
    assert (settings.name, settings.team) == ("Rob", "garden")
    other = load_settings(tmp_path / "hvcpd.yaml", {"audio.input_device": "mic"})
    assert other.audio == AudioSettings(input_device="mic", queue_s=1.0)


def test_a_wrong_option_is_named_as_the_option(tmp_path: Path) -> None:
    (line,) = faults(tmp_path, "name: Rob\nmode: volunteer\n", mode="boss")
    assert line.startswith("--mode: ")
    (line,) = faults(tmp_path, "name: Rob\n", log_level="loud")
    assert line.startswith("--log-level: ")


def test_the_own_team_is_always_known(tmp_path: Path) -> None:
    assert load(tmp_path, "name: Rob\nteam: garden\n").teams == (*DEFAULT_TEAMS, "garden")
    assert load(tmp_path, "name: Rob\nteam: garden\nteams: [x, garden]\n").teams == ("x", "garden")
    assert load(tmp_path, "name: Rob\nteams: []\n").teams == ("plant",)


def test_file_names_are_relative_to_the_file_and_options_to_the_shell(tmp_path: Path) -> None:
    settings = load(tmp_path, "name: Rob\ntasks: a/t.yaml\nlexicon: more.txt\nstate_dir: ~/state\n")
    assert settings.tasks == tmp_path / "a" / "t.yaml"
    assert settings.lexicon == tmp_path / "more.txt"
    assert settings.state_dir == Path.home() / "state"
    assert load(tmp_path, "name: Rob\ntasks: a/t.yaml\n", tasks="b.yaml").tasks == Path("b.yaml")


def test_a_home_that_there_is_not_is_told_at_its_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A user of a container may have none; it was a traceback."""
    monkeypatch.delenv("HOME", raising=False)
    monkeypatch.setattr(os, "getuid", lambda: 54_321)  # as whom only root could start a process
    with pytest.raises(ConfigError, match=r"yaml:2: state_dir: this user has no home directory for the ~; write the "):
        load(tmp_path, "name: Rob\nstate_dir: ~/state\n")


@pytest.mark.parametrize("path", ["/", "."])
def test_a_control_socket_is_no_folder(path: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="is a folder; name a file in it"):
        load(tmp_path, f"name: Rob\ncontrol: {{socket: {path}}}\n")


def test_the_start_pose_in_radians() -> None:
    pose = StartSettings(1.0, 2.0, 90.0).pose
    assert (pose.x_m, pose.y_m) == (1.0, 2.0)
    assert pose.heading_rad == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(
    ("text", "place", "part"),
    [
        ("name: Rob\ntaem: a\n", "F:2", "unknown key 'taem'; did you mean 'team'?"),
        ("name: Rob\nqwertz: a\n", "F:2", "known are: name, team, teams"),
        ("name: Rob\naudio:\n  inputdevice: x\n", "F:3", "did you mean 'input_device'?"),
        ("name: Rob\nwheels:\n  baud-rate: 57600\n", "F:3", "did you mean 'baud_rate'?"),
        ("name: Rob\naudio.input_device: x\n", "F:2", "it belongs into the group `audio`: `audio: {input_device: …}`"),
        ("name: Rob\ninput_device: x\n", "F:2", "it belongs into the group `audio`: `audio: {input_device: …}`"),
        ("name:\n", "F:1", "expected text, found nothing; write one, or remove the line"),
        ("name: Rob\nteam:\n", "F:2", "expected text, found nothing; write one, or remove the line"),
        ("name: Rob\nteam: no\n", "F:2", "expected text, found yes/no (false); put it in quotes"),
        ("name: 5\n", "F:1", "expected text, found the number 5"),
        ("name: yes\n", "F:1", "found yes/no (true)"),
        ("name: Rob\nteams: plant\n", "F:2", "expected a list, found the text 'plant'; write it as [a, b]"),
        ("name: Rob\nteams: [plant, 5]\n", "F:2", "expected text, found the number 5"),
        ("name: Rob\nteams: [plant, Plant]\n", "F:2", "is not one word of 1 to 16 letters a-z"),
        ("name: Rob\nteams: [a, b, a]\n", "F:2", "the team 'a' is given twice"),
        (f"name: Rob\nteams: [{', '.join('abcdefghijklmnop')}]\n", "F:2", f"at most {MAX_TEAMS} teams"),
        ("name: Rob\nlexicon: ''\n", "F:2", "expected a file name"),
        ("name: Rob\nlexicon: [a]\n", "F:2", "expected a file name, found a list"),
        ("name: Rob\naudio: {queue_s: '2'}\n", "F:2", "expected a number, found the text '2'"),
        ("name: Rob\naudio: {queue_s: .nan}\n", "F:2", "expected a finite number"),
        ("name: Rob\naudio: {queue_s: 1.0e+400}\n", "F:2", "expected a finite number"),
        ("name: Rob\naudio: {block_ms: 10.5}\n", "F:2", "expected a whole number"),
        ("name: Rob\naudio: {block_ms: true}\n", "F:2", "expected a whole number, found yes/no"),
        ("name: Rob\naudio: {block_ms: 4}\n", "F:2", "give a number from 5 to 100"),
        ("name: Rob\naudio: 7\n", "F:2", "expected a group of keys (input_device"),
        ("name: Rob\nwheels: {left_id: 253}\n", "F:2", "from 0 to 252"),
        ("name: Rob\nwheels: {baud_rate: 1200}\n", "F:2", "not one of the choices"),
        ("name: Rob\nwheels: {driver: dynamixal}\n", "F:2", "did you mean 'dynamixel'?"),
        ("name: Rob\nmode: folow\n", "F:2", "did you mean 'follow'?"),
        ("name: Rob\nseed: -1\n", "F:2", "from 0 to 4294967295"),
        ("name: Rob\nseed: 4294967296\n", "F:2", "from 0 to 4294967295"),
        ("name: Rob\nstart: {x_m: 51}\n", "F:2", "from -50 to 50"),
        ("name: Rob\nwaits: {absent_s: 60}\n", "F:2", "from 120 to 86400"),
        ("name: Rob\nnames: [Rob, rob]\n", "F:2", "are the same aloud"),
        ("name: Rob\nnames: [R2-D2, Rob, A b]\n", "F:2", "write for example 'R2D2'; the name 'A b' is not"),
        ("name: R2-D2\n", "F:1", "not a letter followed by letters and digits"),
        ("name: ''\n", "F:1", "has 1 to 16 letters"),
        ("name: Abcdefghijklmnopq\n", "F:1", "has 17"),
        ("name: Rob\ntimbre: 90\n", "F:2", "unknown key 'timbre'"),
        ("team: plant\n", "F:1", "the robot has no name"),
        (f"name: Rob\nnames: [{', '.join(f'N{number}' for number in range(13))}]\n", "F:2", "at most 12 names"),
    ],
)
def test_faults(text: str, place: str, part: str, tmp_path: Path) -> None:
    (line,) = faults(tmp_path, text)
    assert line.startswith(f"{place}: ")
    assert part in line


def test_all_faults_are_told_at_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    text = "name: 5\nteam: Plant\nbogus: 1\naudio:\n  queue_s: 99\n  block_ms: x\nwheels: {left_id: -1}\nmode: boss\n"
    lines = faults(tmp_path, text)
    assert [line.split(": ")[0] for line in lines] == ["F:1", "F:2", "F:3", "F:5", "F:6", "F:7", "F:8"]


def test_a_reserved_name_is_a_fault_in_its_place(tmp_path: Path) -> None:
    path = tmp_path / "hvcpd.yaml"
    path.write_text("name: Stop\nnames:\n- Rob\n- Hello\n")
    with pytest.raises(ConfigError) as error:
        load_settings(path, reserved=lambda *_: lambda name: "reserved" if name in ("Stop", "Hello") else None)
    assert [line.split(":")[1] for line in str(error.value).splitlines()] == ["1", "4"]


def test_names_are_checked_as_the_settings_pronounce_them(tmp_path: Path) -> None:
    path = tmp_path / "hvcpd.yaml"
    path.write_text("name: Tu\nnames: [Tu, Bot]\nlexicon: own.txt\n")
    own = tmp_path / "own.txt"
    own.write_text("tu T UW1 L\n")
    assert load_settings(path, reserved=name_check).name == "Tu"
    own.write_text("bot L EH1 F T\n")
    with pytest.raises(ConfigError) as error:
        load_settings(path, reserved=name_check)
    faults = str(error.value).splitlines()
    assert ["'Tu' sounds like the phrasebook's word 'do'" in line for line in faults] == [True, True, False]
    assert "'Bot' sounds like the phrasebook's word 'left'" in faults[2]
    own.write_text("tu T UW\n")
    with pytest.raises(ConfigError, match="'Tu' sounds like"):  # what is wrong with the file is told where it is used
        load_settings(path, reserved=name_check)


def test_the_documented_file_is_valid_and_its_comments_are_the_defaults(tmp_path: Path) -> None:
    """Every commented key of etc/hvcpd.yaml, taken at its word, makes exactly the defaults; none is missing."""
    text = (ETC / "hvcpd.yaml").read_text()
    assert load(tmp_path, text) == Settings(name="Rob")
    lines = [line[2:] for line in text.splitlines() if line.startswith("# ")]
    groups = {"speech", "waits", "quiet", "start", "audio", "wheels", "stop_button", "control", "clips", "security"}
    keys = {field.name for field in dataclasses.fields(Settings)}
    kept = []
    for line in lines:
        key = line.strip().split(":")[0]
        inside = line.startswith("  ") and not line.strip().startswith("#") and ":" in line and "Z OW1" not in line
        if inside or (key in keys and (": " in line or (key in groups and line.endswith(":")))):
            kept.append(line)
    whole = "name: Rob\n" + "\n".join(line for line in kept if not line.startswith("tasks:")) + "\n"
    read = load(tmp_path, whole)
    assert read == Settings(name="Rob")
    written = yaml.safe_load(whole)
    assert set(written) == keys - {"tasks"}
    for group, type_ in (
        ("waits", WaitSettings),
        ("start", StartSettings),
        ("audio", AudioSettings),
        ("wheels", WheelSettings),
        ("stop_button", StopButtonSettings),
        ("control", ControlSettings),
        ("clips", ClipSettings),
    ):
        assert set(written[group]) == {field.name for field in dataclasses.fields(type_)}


def test_voices_are_chosen_for_the_robot_and_its_peers(tmp_path: Path) -> None:
    settings = load(
        tmp_path,
        "name: Rob\nvoice: oak\npeers: {Bot: {voice: lark}, Max: {voice_folder: max}}\nnames: [Rob, bot, Max]\n",
    )
    assert settings.voice == "oak"
    assert settings.peers == {"Bot": PeerSettings(voice="lark"), "Max": PeerSettings(voice_folder=tmp_path / "max")}
    assert load(tmp_path, "name: Rob\nvoice_folder: mine\n").voice_folder == tmp_path / "mine"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("voice: oka", "F:2: voice: the text 'oka' is not one of the choices; did you mean 'oak'?"),
        ("accent: british", "F:2: accent: the text 'british' is not one of the choices; known are: us, gb"),
        ("peers: {Bot: {voice: cedr}}", "F:2: voice: the text 'cedr' is not one of the choices; did you mean 'cedar'?"),
        ("pace: 0.9", "F:2: unknown key 'pace'; did you mean 'rate'?"),
        ("peers: {Bot: {Pace: 0.9}}", "F:2: unknown key 'Pace'; did you mean 'rate'?"),
        ("peers: {Bot: {voce: oak}}", "F:2: unknown key 'voce'; did you mean 'voice'?"),
        ("peers: {Bott: {voice: oak}}", "F:2: 'Bott' is not one of `names`; did you mean 'Bot'?"),
        (
            "peers: {rob: {voice: oak}}",
            "F:2: 'rob' is this robot itself; set its own `voice`, `pitch` and so on instead",
        ),
        (
            "names: [Bot, Max]\npeers: {Bot: {}, bot: {voice: oak}, Max: {}}",
            "F:3: the names 'Bot' and 'bot' are the same aloud; keep one",
        ),
        ("peers: [Bot]", "F:2: peers: expected a group of keys, found a list; write `name: ...`"),
        ("peers: {5: {voice: oak}}", "F:2: a key must be text; put it in quotes"),
        ("voice_folder: 3", "F:2: voice_folder: expected a file name, found the number 3; write the path"),
    ],
)
def test_a_wrong_voice_is_told_with_what_was_meant(tmp_path: Path, text: str, expected: str) -> None:
    assert faults(tmp_path, f"name: Rob\n{text}\n") == [expected]


def test_how_it_speaks_is_a_rate_and_how_often(tmp_path: Path) -> None:
    assert load(tmp_path, "name: Rob\nspeech: {rate: slow, repeat: 2}\n").speech == SpeechSettings("slow", 2)
    assert "F:2" in faults(tmp_path, "name: Rob\nspeech: {rate: slw}\n")[0]
    assert "F:2" in faults(tmp_path, "name: Rob\nspeech: {repeat: 3}\n")[0]


def test_what_a_robot_cannot_do_is_a_list_of_numbers(tmp_path: Path) -> None:
    assert load(tmp_path, "name: Rob\nunable: [2, 3]\n").unable == (2, 3)
    assert "F:2" in faults(tmp_path, "name: Rob\nunable: [two]\n")[0]


@pytest.mark.parametrize(
    ("wheels", "line"), [("{left_id: 2}", 2), ("{left_id: 7, right_id: 7}", 2), ("{right_id: 1}", 2)]
)
def test_two_wheels_need_two_identifiers(tmp_path: Path, wheels: str, line: int) -> None:
    path = tmp_path / "hvcpd.yaml"
    path.write_text(f"name: Rob\nwheels: {wheels}\n")
    with pytest.raises(ConfigError, match="both wheels have the identifier") as raised:
        load_settings(path)
    assert f"{path}:{line}: " in str(raised.value)
