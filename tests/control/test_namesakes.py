"""Which robot `hvcpctl` asks: where two users of one computer each have one of the same name, or one is named."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from hvcpd.control.cli import main
from hvcpd.coordination.states import State
from hvcpd.daemon.control_socket import SYSTEM_FOLDER
from tests.daemon.running import RunningRobot


@pytest.fixture
def namesakes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[RunningRobot, RunningRobot]]:
    """Two robots called Rob: the socket of the one is in the user's folder, that of the other in `state_dir`."""
    if any(SYSTEM_FOLDER.glob("*.sock")):
        pytest.skip("another robot runs on this computer")
    folders = tmp_path / "a", tmp_path / "b"
    for folder in folders:
        folder.mkdir()
    (tmp_path / "hvcpd").symlink_to(folders[0] / "state")
    for variable in ("RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR"):
        monkeypatch.delenv(variable, raising=False)
    with RunningRobot(folders[0]) as one, RunningRobot(folders[1]) as other:
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
        monkeypatch.setenv("HVCPD_STATE_DIR", str(folders[1] / "state"))
        yield one, other


@pytest.mark.parametrize("named", [(), ("--name", "Rob")])
def test_a_stop_stops_both(named: tuple[str, ...], namesakes: tuple[RunningRobot, RunningRobot]) -> None:
    assert main(["stop", *named]) == 0
    assert [robot.state for robot in namesakes] == [State.STOPPED, State.STOPPED]


@pytest.mark.parametrize("setting", ["name: Bot", "name: Rob", "control: {{socket: {0}/a/state/rob.sock}}"])
def test_the_systems_settings_spare_nobody_a_stop(
    setting: str,
    namesakes: tuple[RunningRobot, RunningRobot],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Of several robots on a bench, the one that they name was stopped, and the others drove on; settings that are
    given with the command choose one."""
    file = tmp_path / "hvcpd.yaml"
    file.write_text(setting.format(tmp_path))
    monkeypatch.setenv("HVCPD_CONFIG", str(file))
    assert main(["stop"]) == 0
    assert [robot.state for robot in namesakes] == [State.STOPPED, State.STOPPED]
    if "Bot" in setting:
        assert main(["stop", "--config", str(file)]) == 3
        assert "Bot does not run here" in capsys.readouterr().err


@pytest.mark.parametrize("named", [(), ("--name", "Rob")])
@pytest.mark.usefixtures("namesakes")
def test_anything_else_is_for_one_of_them_by_its_socket(
    named: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Their name did not tell them apart, and one of the two obeyed."""
    assert main(["resume", *named]) == 2
    told = capsys.readouterr().err
    assert "choose one with --socket FILE" in told
    sockets = tmp_path / "hvcpd" / "rob.sock", tmp_path / "b" / "state" / "rob.sock"
    assert all(str(path) in told for path in sockets)
    assert [main(["resume", "--socket", str(path)]) for path in sockets] == [0, 0]


def test_one_socket_in_two_folders_is_one_robot(
    namesakes: tuple[RunningRobot, RunningRobot], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HVCPD_STATE_DIR", str(namesakes[0].directory / "state"))
    assert main(["resume", "--name", "Rob"]) == 0


@pytest.fixture(scope="module")
def lone(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningRobot]:
    """One robot, Rob."""
    with RunningRobot(tmp_path_factory.mktemp("robot")) as running:
        yield running


@pytest.mark.parametrize("command", ["status", "stop", "resume", "tasks", "reload"])
def test_another_robot_than_the_named_one_is_not_asked(
    command: str, lone: RunningRobot, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`stop --name Bot` stopped Rob, whose socket the settings name, and Bot drove on."""
    config = tmp_path / "hvcpd.yaml"
    config.write_text(f"name: Rob\ncontrol: {{socket: {lone.bench.path}}}\n")
    for which in (["--config", str(config)], ["--socket", str(lone.bench.path)]):
        assert main([command, *which, "--name", "Bot"]) == 3
        assert "this is Rob's socket, not Bot's" in capsys.readouterr().err
        assert lone.state is not State.STOPPED
        assert main(["tasks", *which, "--name", "rob"]) == 0


def test_the_transcript_is_that_of_the_named_robot(
    lone: RunningRobot, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "hvcpd.yaml"
    config.write_text(f"name: Rob\nstate_dir: {tmp_path}\ncontrol: {{socket: {lone.bench.path}}}\n")
    assert main(["transcript", "--config", str(config), "--name", "Bot"]) == 2
    assert f"{tmp_path}/bot.sqlite3: there is no robot's memory here" in capsys.readouterr().err


def test_the_help_of_stop_tells_that_it_stops_every_robot(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["stop", "--help"])
    assert "Without --name, --socket and --config: every robot that runs" in " ".join(capsys.readouterr().out.split())
