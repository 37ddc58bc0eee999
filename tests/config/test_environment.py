"""Settings from the environment: over the file, under the options, as strict as both."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import settings as examples
from hypothesis import strategies as st

from hvcpd.config.settings import AudioSettings, PeerSettings, Settings
from hvcpd.config.settings_file import DEFAULT, load_settings, load_with_sources
from hvcpd.config.whereabouts import whereabouts
from hvcpd.errors import ConfigError


def of(environment: dict[str, str], path: Path | None = None, **options: object) -> Settings:
    return load_settings(path, options, system_path=Path("/nonexistent/hvcpd.yaml"), environment=environment)


def faults(environment: dict[str, str], path: Path | None = None) -> list[str]:
    with pytest.raises(ConfigError) as error:
        of(environment, path)
    return str(error.value).splitlines()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "hvcpd.yaml"
    path.write_text("name: Rob\nmode: follow\naudio: {block_ms: 10, queue_s: 3}\n")
    return path


def test_option_over_environment_over_file_over_default(file: Path) -> None:
    environment = {"HVCPD_MODE": "coordinate", "HVCPD_NAME": "Bot", "HVCPD_AUDIO__BLOCK_MS": "20"}
    settings = of(environment, file, name="Max")
    assert (settings.name, settings.mode, settings.pick) == ("Max", "coordinate", "nearest")
    assert settings.audio == AudioSettings(block_ms=20, queue_s=3.0)


def test_each_value_is_told_with_its_source(file: Path) -> None:
    loaded = load_with_sources(
        file, {"name": "Max"}, environment={"HVCPD_UNABLE": "[2]"}, system_path=Path("/nonexistent/x.yaml")
    )
    told = {each.key: (each.value, each.source) for each in loaded.sources}
    assert told["name"] == ("Max", "--name")
    assert told["unable"] == ([2], "HVCPD_UNABLE")
    assert told["mode"] == ("follow", f"{file}:2")
    assert told["audio.block_ms"] == (10, f"{file}:3")
    assert told["audio.watchdog_s"] == (1.0, "default")
    assert told["peers"] == ({}, "default")
    assert next(iter(told)) == "name"


def test_a_default_takes_the_place_of_file_and_environment(file: Path) -> None:
    """Of one value or a whole group, without a trace of where that stood."""
    given = {"mode": DEFAULT, "audio": DEFAULT, "pick": DEFAULT}
    loaded = load_with_sources(file, given, environment={"HVCPD_MODE": "coordinate"}, system_path=Path("/none.yaml"))
    assert (loaded.settings.mode, loaded.settings.audio) == ("volunteer", AudioSettings())
    assert {each.source for each in loaded.sources if each.key != "name"} == {"default"}


def test_text_is_taken_as_it_stands_and_the_rest_as_in_the_file() -> None:
    settings = of(
        {
            "HVCPD_NAME": "No",
            "HVCPD_AUDIO__INPUT_DEVICE": "null",
            "HVCPD_AUDIO__OUTPUT_DEVICE": "USB: 1, #2",
            "HVCPD_NAMES": '["No", Bot]',
            "HVCPD_PEERS": "{Bot: {voice: oak}}",
            "HVCPD_SPEECH__REPEAT": "2",
            "HVCPD_STATE_DIR": "state",
            "HVCPD_SEED": "null",
            "HVCPD_CONTROL__ENABLED": "false",
        }
    )
    assert settings.name == "No"
    assert settings.audio == AudioSettings(None, "USB: 1, #2")
    assert settings.names == ("No", "Bot")
    assert settings.peers == {"Bot": PeerSettings(voice="oak")}
    assert settings.speech.repeat == 2
    assert settings.state_dir == Path("state")
    assert settings.seed is None
    assert not settings.control.enabled


def test_a_variable_names_the_file(file: Path) -> None:
    assert of({"HVCPD_CONFIG": str(file)}).mode == "follow"
    assert "no such file" in faults({"HVCPD_CONFIG": str(file.parent / "none.yaml")})[0]


def test_all_faults_of_file_and_variables_at_once(file: Path) -> None:
    file.write_text("name: Rob\nmod: follow\n")
    found = faults(
        {
            "HVCPD_MOED": "follow",
            "HVCPD_AUDIO__BLOCK_MS": "1000",
            "HVCPD_PACE": "0.9",
            "HVCPD_SEED": "[",
            "HVCPD_WHEELS__LEFT_ID": "one",
            "HVCPD_NAMES": "{a: 1, a: 2}",
            "HVCPD_PEERS": "{Bot: {vioce: oak}}",
            "HVCPD_NAME": "R2-D2",
            "HVCPD_UNABLE": "[two]",
            "HVCPD_SKILLS": "{wave: 3}",
        },
        file,
    )
    told = "\n".join(found)
    assert f"{file}:2: unknown key 'mod'; did you mean 'mode'?" in told
    assert "HVCPD_MOED: no setting has this variable; did you mean 'HVCPD_MODE'?" in told
    assert "HVCPD_PACE: no setting has this variable; did you mean 'HVCPD_RATE'?" in told
    assert "HVCPD_AUDIO__BLOCK_MS: the number 1000 is out of range; give a number from 5 to 100" in told
    assert "HVCPD_SEED: not valid YAML" in told
    assert "HVCPD_WHEELS__LEFT_ID: expected a whole number, found the text 'one'" in told
    assert "HVCPD_NAMES: the key 'a' is given twice" in told
    assert "HVCPD_PEERS: unknown key 'vioce'; did you mean 'voice'?" in told
    assert "HVCPD_NAME: the name 'R2-D2'" in told
    assert "HVCPD_UNABLE: expected a whole number" in told
    assert "HVCPD_SKILLS: wave: expected a group" in told
    assert len(found) == 11


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("- Rob\n", "hvcpd.yaml:1: "),
        ("Rob\n", "hvcpd.yaml:1: "),
        ("mode: follow\naudio: 20\n", "hvcpd.yaml:2: audio: "),
    ],
)
def test_a_file_that_is_no_group_of_keys_is_told_though_a_value_is_given_over_it(
    text: str, place: str, file: Path
) -> None:
    file.write_text(text)
    (fault,) = faults({"HVCPD_NAME": "Rob", "HVCPD_AUDIO__BLOCK_MS": "20"}, file)
    assert f"{place}expected a group of keys" in fault
    with pytest.raises(ConfigError, match="expected a group of keys"):
        load_settings(file, {"audio.block_ms": 20}, name_needed=False, environment={})


def test_other_programs_variables_are_left_alone() -> None:
    assert of({"HVCPD_NAME": "Rob", "HVCP_X": "1", "hvcpd_name": "Bot", "PATH": "/bin"}) == Settings(name="Rob")


@given(
    st.dictionaries(
        st.sampled_from(
            ["HVCPD_SEED", "HVCPD_NAMES", "HVCPD_PEERS", "HVCPD_TEAM", "HVCPD_WHEELS__BAUD_RATE", "HVCPD_"]
        ),
        st.text(st.characters(blacklist_characters="\0"), max_size=20),
    )
)
@examples(max_examples=40)
def test_any_value_gives_settings_or_a_config_error_that_names_a_variable(environment: dict[str, str]) -> None:
    try:
        of(environment | {"HVCPD_NAME": "Rob"})
    except ConfigError as error:
        lines = str(error).splitlines()
    else:
        lines = []
    assert all(line.startswith("HVCPD_") for line in lines)


def test_a_robot_is_found_by_settings_with_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """~ was the name of a folder beside the file there, and variables did not count: `hvcpctl stop` found no robot."""
    monkeypatch.setenv("HOME", "/home/anna")
    path = tmp_path / "hvcpd.yaml"
    path.write_text("mdoe: follow\nname: Rob\nstate_dir: ~/state\ncontrol: {socket: rob.sock}\n")
    found = whereabouts(path, None, {})
    assert (found.state_dir, found.socket) == (Path("/home/anna/state"), tmp_path / "rob.sock")
    assert found.name == "Rob"
    found = whereabouts(path, None, {"HVCPD_NAME": "Zoe", "HVCPD_CONTROL__SOCKET": "/run/zoe.sock"})
    assert (found.socket, found.name) == (Path("/run/zoe.sock"), "Zoe")
    assert whereabouts(path, "Bot", {"HVCPD_CONTROL__SOCKET": "null"}).socket is None
    path.write_text("\t: [")
    found = whereabouts(None, None, {"HVCPD_CONFIG": str(path), "HVCPD_STATE_DIR": "/var/lib/zoe"})
    assert (found.state_dir, found.socket, found.name) == (Path("/var/lib/zoe"), None, None)
