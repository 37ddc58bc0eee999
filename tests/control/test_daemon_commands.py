"""The commands that ask a running daemon, over a real socket, as people type them."""

from __future__ import annotations

import contextlib
import io
import json
import os
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import structlog

from hvcpd.config.tasks import Forward, GoTo, Place, Tend, Wait
from hvcpd.control.cli import main, make_parser
from hvcpd.control.live import status
from hvcpd.control.live.daemon_client import permission_fault
from hvcpd.control.live.short_commands import result_lines
from hvcpd.control.live.status_screen import duration
from hvcpd.coordination.states import State
from hvcpd.daemon.control_socket import SYSTEM_FOLDER
from hvcpd.daemon.logging import set_up_logging
from hvcpd.language.messages import Seal
from hvcpd.robot.sealing import Sealing
from hvcpd.security.guard import Guard
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey
from tests.control.conftest import Ran, Refuse
from tests.daemon.running import RunningRobot


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningRobot]:
    set_up_logging("info", io.StringIO())
    with RunningRobot(tmp_path_factory.mktemp("robot")) as running:
        yield running
    structlog.reset_defaults()


Ctl = Callable[..., str]


@pytest.fixture
def ctl(robot: RunningRobot, capsys: pytest.CaptureFixture[str]) -> Ctl:
    """Run `hvcpctl` on the settings of that robot, successfully; what it printed."""
    config = robot.directory / "hvcpd.yaml"
    config.write_text("name: Rob\ntasks: tasks.yaml\nstate_dir: state\n")

    def call(*arguments: str, status: int = 0) -> str:
        assert main([*arguments, "--config", str(config)]) == status, capsys.readouterr().err
        out, err = capsys.readouterr()
        return err if status else out

    return call


def test_status_for_people_and_for_programs(ctl: Ctl) -> None:
    screen = ctl("status")
    assert screen.startswith("Rob  team plant, volunteer")
    assert all(len(line) <= 80 for line in screen.splitlines())
    assert "11.9 V" in screen
    status = json.loads(ctl("status", "--json"))
    assert (status["name"], status["sound"]["level_dbfs"]) == ("Rob", -20.0)
    assert 'hvcpd_battery_volts{robot="Rob"} 11.9' in ctl("status", "--prometheus").splitlines()


class _EnoughError(Exception):
    """Ends the watching."""


@pytest.mark.parametrize("as_json", [False, True])
def test_watching_shows_it_again_and_again(
    as_json: bool, robot: RunningRobot, capsys: pytest.CaptureFixture[str]
) -> None:
    screens = []

    def wait(_s: float) -> None:
        screens.append(capsys.readouterr().out)
        if len(screens) == 3:
            raise _EnoughError

    options = make_parser().parse_args(["status", "--watch", "--socket", str(robot.bench.path)])
    options.json = as_json
    with pytest.raises(_EnoughError):
        status.run(options, wait)
    assert all(screen.count("plant") == 1 for screen in screens), "one whole look each time"


def test_the_board(ctl: Ctl) -> None:
    assert "water the green rose" in ctl("tasks")
    assert json.loads(ctl("tasks", "--json"))["tasks"][0]["number"] == 1


def test_stop_and_resume(ctl: Ctl, robot: RunningRobot) -> None:
    assert "stands still" in ctl("stop")
    assert robot.state is State.STOPPED
    assert "STOPPED" in ctl("status")
    assert "already" in ctl("stop")
    resumed = {"name": "Rob", "stopped": False, "before": True, "kept": True, "reason": None, "untold": None}
    assert json.loads(ctl("resume", "--json")) == resumed
    assert robot.state is not State.STOPPED
    assert "was not stopped" in ctl("resume")


def test_a_task_is_left_out_and_wanted_again(ctl: Ctl) -> None:
    assert ctl("task", "skip", "1") == "task 1, water the green rose, is left out this time: Rob tells the others\n"
    assert "left out: nobody has done it" in ctl("tasks")
    assert "1 left out" in ctl("status")
    assert json.loads(ctl("task", "again", "1", "--json"))["do"] == "again"
    assert "left out" not in ctl("tasks")
    assert "there is no task 77" in ctl("task", "skip", "77", status=2), "as `task remove 77`"


def test_a_task_is_added_and_removed(ctl: Ctl, robot: RunningRobot) -> None:
    robot.bench.body.retask = lambda _tasks, then: then()
    tulip = ("water the red tulip", "--number", "11", "--place=-1.2,0.5", "--action", "water=5", "--after", "1")
    lines = ctl("task", "add", *tulip).splitlines()
    assert lines[0] == "task 11, water the red tulip: new"
    assert "give each the same command" in lines[1]
    (_, task) = robot.bench.body.wiring.tasks.tasks
    assert task.actions == (GoTo(Place(-1.2, 0.5)), Tend(5.0))
    assert task.after == {1}
    assert "there already is a task 11" in ctl("task", "add", *tulip, status=2)
    assert "give a place, or an action" in ctl("task", "add", "water the red tulip", "--number", "12", status=2)
    assert "unknown action 'dance'" in ctl("task", "add", *tulip, "--number", "12", "--action", "dance=5", status=2)
    asked = ("task", "add", "look at the gate", "--number", "12", "--action")
    assert "write {wait: 5}" in ctl(*asked, "wait 5", status=2), "refused, too, in the form that this has"
    assert "found the text '2026-01-01'" in ctl(*asked, "wait=2026-01-01", status=2), "a traceback"
    assert "task 12, look at the gate: new" in ctl(*asked, "{wait: 5}", "--action", "forward: -0.5")
    assert robot.bench.body.wiring.tasks.tasks[-1].actions == (Wait(5.0), Forward(-0.5))
    assert json.loads(ctl("task", "remove", "11", "--json"))["changed"][0]["before"] == "water the red tulip"
    assert "there is no task 11" in ctl("task", "remove", "11", status=2)


def test_say_goes_through_the_robot_whose_name_is_in_it(ctl: Ctl) -> None:
    assert ctl("say", "hi bot i am rob what are you doing") == "Rob says: Hi Bot, I am Rob, what are you doing\n"
    assert json.loads(ctl("say", "stop", "--json"))["text"] == "Stop"
    told = "Rob says: Hi all, I am Rob, skip task one, change "
    assert ctl("say", "Hi Bot, I am Rob, skip task one").startswith(told), "a change has a number, and is for all"
    assert "task one again, change " in ctl("say", "Hi all, I am Rob, task one again")
    assert "only when it is so" in ctl("say", "Hi all, I am Rob, task one complete", status=1)
    assert "not in the phrasebook" in ctl("say", "Hi Bot, I am Rob, dance", status=2)
    assert "this robot is Rob" in ctl("say", "Hi Rob, I am Bot, stop", "--name", "Rob", status=1)


def test_say_knows_a_sealed_sentence_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It waited a minute for the sentence as it was typed, and then told that the robot could not say it."""
    order, code = "Hi Bot, I am Rob, water the green rose", "code one two three four five six"
    with RunningRobot(tmp_path, Sealing(Guard("Rob", KeyRing(TeamKey(bytes(KEY_BYTES)))))) as robot:
        book = robot.bench.bench.robot.phrasebook
        seal_of_another_time = book.write(replace(book.parse_text(order), mark=Seal(12345)))
        for text in (order, f"{order}, {code}", seal_of_another_time):
            assert main(["say", text, "--socket", str(robot.bench.path)]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith("Rob says")]
    assert told == [f"Rob says: {order}"] * 3, "a code is shown to nobody"


@pytest.mark.slow
def test_say_with_an_output_or_in_another_name_makes_the_sound_itself(ctl: Ctl, tmp_path: Path) -> None:
    result_lines = json.loads(ctl("say", "Hi Bot, I am Rob, stop", "-o", str(tmp_path / "x.wav"), "--json"))
    assert (tmp_path / "x.wav").stat().st_size > 2 * 8000 * result_lines["duration_s"]
    assert result_lines["text"] == "Hi Bot, I am Rob, stop"
    assert "loudspeaker" in ctl("say", "Hi Rob, I am Bot, stop", status=2)
    assert "loudspeaker" in ctl("say", "Hi Bot, I am Rob, stop", "--local", status=2)


def test_the_transcript_is_the_daemons_where_one_runs(ctl: Ctl, robot: RunningRobot, tmp_path: Path, ran: Ran) -> None:
    ctl("say", "Hi Bot, I am Rob, what is left")
    (tmp_path / "hvcpd.yaml").write_text(f"state_dir: {tmp_path}\n")  # with no memory in it
    where = ("--config", tmp_path / "hvcpd.yaml", "--socket", robot.bench.path)
    assert "Hi Bot, I am Rob, what is left" in ran("transcript", *where)
    assert "Hi Bot, I am Rob, what is left" in ctl("transcript")
    assert json.loads(ctl("transcript", "--json").splitlines()[0])["number"] == 1
    assert ctl("transcript", "--since", "2999-01-01") == ""
    assert json.loads(ctl("audit", "--json"))["sentences"]["Rob"] > 0


def test_the_report_has_the_tasks_of_the_robot_that_runs(ctl: Ctl, tmp_path: Path) -> None:
    ctl("say", "Hi Bot, I am Rob, what is left")
    other, page = tmp_path / "other.yaml", tmp_path / "shift.html"
    other.write_text("tasks:\n- {number: 1, name: fetch the ball, actions: [dock]}\n", encoding="utf-8")
    ctl("report", "--tasks", str(other), "--html", str(page))
    text = page.read_text(encoding="utf-8")
    assert ("water the green rose" in text, "fetch the ball" in text) == (True, False)


def test_a_transcript_is_read_in_the_words_of_the_robot_that_runs(ctl: Ctl, tmp_path: Path) -> None:
    """It counted sentences about tasks that the settings here do not have as not in the phrasebook."""
    ctl("say", "Hi Bot, I am Rob, water the green rose")
    other = tmp_path / "other.yaml"
    other.write_text("tasks:\n- {number: 1, name: fetch the ball, actions: [dock]}\n", encoding="utf-8")
    assert "today's phrasebook" not in ctl("report", "--tasks", str(other))
    assert json.loads(ctl("audit", "--tasks", str(other), "--json"))["not_understood"] == 0


def test_settings_with_their_sources(ctl: Ctl, robot: RunningRobot) -> None:
    assert "hvcpd.yaml:1\n" in ctl("config", "--changed")
    running = [json.loads(line) for line in ctl("config", "--running", "--json").splitlines()]
    assert {"key": "name", "value": "Rob", "source": "--name"} in running
    assert len(running) == len(ctl("config").splitlines())
    assert list(map(json.loads, ctl("config", "--socket", str(robot.bench.path), "--json").splitlines())) == running


def test_a_name_that_nobody_gave_is_not_told_as_one(tmp_path: Path, ran: Ran) -> None:
    config = tmp_path / "hvcpd.yaml"
    config.write_text("mode: follow\n")
    name = json.loads(ran("config", "--config", config, "--json").splitlines()[0])
    assert name == {"key": "name", "value": None, "source": "default"}


def test_settings_with_a_name_that_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "hvcpd.yaml"
    config.write_text("name: Stop\n")
    assert main(["config", "--config", str(config)]) == 2
    assert "hvcpd.yaml:1: the name 'Stop' sounds like the phrasebook's word 'stop'" in capsys.readouterr().err


def test_no_daemon_is_status_3_and_says_who_does_run(ctl: Ctl, robot: RunningRobot, tmp_path: Path) -> None:
    text = ctl("status", "--name", "Bot", status=3)
    assert "Bot does not run here" in text
    assert "running here: rob" in text
    assert "no daemon answers" in ctl("stop", "--socket", str(tmp_path / "none.sock"), status=3)


@pytest.mark.parametrize("command", ["status", "stop"])
def test_how_to_start_a_robot_that_does_not_run_names_its_settings(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`hvcpd --name Rob` would have started another robot: one of the system's settings."""
    config = tmp_path / "greenhouse.yaml"
    config.write_text(f"name: Rob\nstate_dir: {tmp_path}\n")
    assert main([command, "--config", str(config)]) == 3
    assert f"start it with `hvcpd --config {config} --name Rob`" in capsys.readouterr().err


def test_what_is_no_socket_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It was "(Connection refused)", or "(None)"; and a daemon should be started."""
    assert main(["status", "--socket", str(tmp_path)]) == 3
    assert f"{tmp_path}: this is no socket" in capsys.readouterr().err
    assert main(["status", "--socket", str(tmp_path / ("x" * 200))]) == 3
    assert "(AF_UNIX path too long)" in capsys.readouterr().err


def test_faults_of_the_settings_keep_nobody_from_stopping(robot: RunningRobot, tmp_path: Path) -> None:
    config = tmp_path / "hvcpd.yaml"
    for text in ("mdoe: follow\nname: Rob\nstate_dir: {}\n", "control: {{socket: {}/rob.sock}}\nx: 1\n"):
        config.write_text(text.format(robot.directory / "state"))
        assert main(["stop", "--config", str(config)]) == 0
        assert robot.state is State.STOPPED
        assert main(["resume", "--config", str(config)]) == 0
    config.write_text("\t: [")
    assert main(["stop", "--config", str(config), "--socket", str(robot.bench.path)]) == 0
    assert main(["resume", "--config", str(config), "--socket", str(robot.bench.path)]) == 0


@pytest.mark.skipif(os.getuid() == 0, reason="root may ask every daemon")
def test_no_permission_is_status_4_and_names_the_group(ctl: Ctl, robot: RunningRobot) -> None:
    robot.bench.path.chmod(0)
    assert "usermod" in ctl("status", status=4)
    robot.bench.path.chmod(0o660)


def test_what_a_reload_changed_is_told_as_the_file_has_it() -> None:
    changed = [{"key": "clips.folder", "before": None, "now": "clips"}, {"key": "unable", "before": [], "now": [2]}]
    assert result_lines("reload", "Rob", {"changed": changed, "restart": []}) == [
        "clips.folder: null → clips",
        "unable: [] → [2]",
    ]


def test_tasks_that_a_reload_brings_or_takes_are_told_by_name() -> None:
    changed = [
        {"key": "task 1", "before": "water the rose", "now": "water the lily"},
        {"key": "task 3", "before": "count the chairs", "now": None},
        {"key": "task 4", "before": None, "now": "sweep the old kitchen"},
    ]
    assert result_lines("reload", "Rob", {"changed": changed, "restart": []}) == [
        "task 1: water the rose → water the lily",
        "task 3, count the chairs: gone",
        "task 4, sweep the old kitchen: new",
    ]


def test_a_user_without_a_name_is_told_the_group_too(tmp_path: Path) -> None:
    nameless = 987_654_321
    assert f"`sudo usermod -aG {tmp_path.group()} USER`" in permission_fault(tmp_path, nameless)


def test_without_a_name_the_only_robot_is_meant(robot: RunningRobot, tmp_path: Path, refused: Refuse, ran: Ran) -> None:
    config = tmp_path / "hvcpd.yaml"
    config.write_text(f"state_dir: {robot.directory / 'state'}\n")
    if any(SYSTEM_FOLDER.glob("*.sock")):
        pytest.skip("another robot runs on this computer")
    assert "water the green rose" in ran("tasks", "--config", config)
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(robot.directory / "state" / "bot.sock"))
        other.listen()
        text = refused("tasks", "--config", config)
    (robot.directory / "state" / "bot.sock").unlink()
    assert "choose one with --name" in text


def test_a_stop_that_names_no_robot_stops_all_that_run_here(
    robot: RunningRobot, tmp_path: Path, capsys: pytest.CaptureFixture[str], ran: Ran
) -> None:
    """Even if one of them is no robot."""
    config = tmp_path / "hvcpd.yaml"
    config.write_text(f"state_dir: {robot.directory / 'state'}\n")
    if any(SYSTEM_FOLDER.glob("*.sock")):
        pytest.skip("another robot runs on this computer")
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(robot.directory / "state" / "bot.sock"))
        other.listen()

        def answer() -> None:
            for _ in ("who is there?", "stop"):
                with other.accept()[0] as connection, contextlib.suppress(BrokenPipeError):
                    connection.sendall(b"SSH-2.0-OpenSSH\n")

        thread = threading.Thread(target=answer)
        thread.start()
        assert main(["stop", "--config", str(config)]) == 1
        thread.join()
    (robot.directory / "state" / "bot.sock").unlink()
    out, err = capsys.readouterr()
    assert "bot.sock is not hvcpd" in err
    assert "Rob stands still" in out
    assert robot.state is State.STOPPED
    assert "takes on tasks again" in ran("resume", "--config", config)


def test_a_daemon_that_does_not_answer_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket(socket.AF_UNIX) as silent:
        silent.bind(str(tmp_path / "s"))
        silent.listen()
        thread = threading.Thread(target=lambda: silent.accept()[0].close())
        thread.start()
        assert main(["status", "--socket", str(tmp_path / "s")]) == 3
        thread.join()
    assert "has ended" in capsys.readouterr().err


@pytest.mark.parametrize("line", [b"SSH-2.0-OpenSSH\n", b"[1]\n", b"7\n", b"\xff\n", b"[" * 9000 + b"\n"])
def test_another_program_behind_the_socket_is_told(
    line: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(tmp_path / "s"))
        other.listen()

        def greet() -> None:
            with other.accept()[0] as client:
                client.sendall(line)

        thread = threading.Thread(target=greet)
        thread.start()
        assert main(["status", "--socket", str(tmp_path / "s")]) == 1
        thread.join()
    assert "is not hvcpd" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.4, "0 s"),
        (59, "59 s"),
        (61, "1 min 1 s"),
        (3600, "1 h"),
        (7212, "2 h"),
        (3 * 3600 + 12 * 60 + 5, "3 h 12 min"),
        (90000, "1 d 1 h"),
    ],
)
def test_lengths_of_time(seconds: float, text: str) -> None:
    assert duration(seconds) == text
