"""Who takes part in a duet, and with which settings."""

from __future__ import annotations

from pathlib import Path

import pytest

from hvcpd.config.settings import Settings
from hvcpd.control.cli import main, make_parser
from hvcpd.control.duet.cast import cast_of, rereading_of

TEAM = """\
name: Ida
team: garden
names: [Max, Ida, Zoe]
voice: oak
pitch: 1.1
peers: {max: {voice: lark}, Zoe: {rate: 0.9}}
unable: [2]
clock: false
talk: terse
wheels: {driver: none, separation_m: 0.3}
stop_button: {pin: 17}
control: {enabled: false}
"""


def settings_of(tmp_path: Path, *options: str) -> dict[str, Settings]:
    """Each robot's, in the order in which they stand in the room."""
    given = make_parser().parse_args(["duet", "--pipe", *options])
    cast = cast_of(given)
    folder = tmp_path / f"folder-{len(list(tmp_path.iterdir()))}"
    folder.mkdir()
    return {name: rereading_of(given, cast, folder, name, k).load().settings for k, name in enumerate(cast.robots)}


@pytest.fixture
def team(tmp_path: Path) -> str:
    path = tmp_path / "team.yaml"
    path.write_text(TEAM)
    return str(path)


def test_a_settings_file_names_the_robots(tmp_path: Path, team: str) -> None:
    """They were Rob and Bot, whoever the team was."""
    assert list(settings_of(tmp_path)) == ["Rob", "Bot"]
    assert list(settings_of(tmp_path, "--config", team)) == ["Ida", "Max"]
    assert list(settings_of(tmp_path, "--config", team, "--names", "Zoe,Max")) == ["Zoe", "Max"]
    assert list(settings_of(tmp_path, "--config", team, "--as", "zoe")) == ["zoe", "Ida"]
    assert list(settings_of(tmp_path, "--as", "Zed")) == ["Zed", "Rob"]


def test_settings_of_one_robot_are_those_of_the_robot_that_the_file_names(tmp_path: Path, team: str) -> None:
    """A file with `peers` was refused, and its voice, its wheels and its stop button were those of both robots."""
    ida, bot = settings_of(tmp_path, "--config", team).values()
    assert (ida.voice, ida.pitch, ida.unable, ida.clock, ida.stop_button.pin) == ("oak", 1.1, (2,), False, 17)
    assert (bot.voice, bot.pitch, bot.unable, bot.clock, bot.stop_button.pin) == ("lark", 1.0, (), True, None)
    assert (ida.wheels.driver, bot.wheels.driver) == ("none", "auto")
    assert ida.wheels.separation_m == bot.wheels.separation_m == 0.16, "those of the simulated wheels"
    assert {name: peer.voice for name, peer in ida.peers.items()} == {"Max": "lark"}
    assert {name: (peer.voice, peer.pitch) for name, peer in bot.peers.items()} == {"Ida": ("oak", 1.1)}
    assert ida.talk == bot.talk == "terse"
    assert ida.team == bot.team == "garden"
    assert ida.control.enabled, "or the terminal would have nothing to show"
    zoe, _ = settings_of(tmp_path, "--config", team, "--names", "Zoe,Max").values()
    assert (zoe.voice, zoe.rate, list(zoe.peers)) == (None, 0.9, ["Max"])


@pytest.mark.parametrize(
    ("own", "modes"),
    [
        ("volunteer", ["volunteer", "volunteer", "volunteer"]),
        ("coordinate", ["coordinate", "follow", "follow"]),
        ("follow", ["follow", "follow", "coordinate"]),
    ],
)
def test_one_robot_gives_the_orders_where_the_file_says_so(tmp_path: Path, own: str, modes: list[str]) -> None:
    """All did, or none."""
    path = tmp_path / "hvcpd.yaml"
    path.write_text(f"name: Rob\nmode: {own}\n")
    options = ["--config", str(path), "--names"]
    assert [each.mode for each in settings_of(tmp_path, *options, "Rob,Bot,Max").values()] == modes
    assert {each.mode for each in settings_of(tmp_path, *options, "Bot,Max").values()} == {"volunteer"}


def test_the_visitor_has_a_name_of_her_own(tmp_path: Path) -> None:
    """A robot called Anna had the visitor's name and voice."""
    assert settings_of(tmp_path)["Rob"].names == ("Rob", "Bot", "Anna")
    for robot in ("anna", "Ana"):
        assert settings_of(tmp_path, "--names", f"{robot},Bob")[robot].names == (robot, "Bob", "Adam")


def test_a_name_that_cannot_be_used_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    """It was told twice, first as that of an option which `duet` does not have."""
    assert main(["duet", "--pipe", "--names", "Stop,Bot"]) == 2
    assert capsys.readouterr().err.startswith("hvcpctl: the name 'Stop' sounds like the phrasebook's word 'stop'; take")
    assert main(["duet", "--pipe", "--names", "Rob,Robb"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
