"""`hvcpctl mqtt` between a robot's real socket and a real broker."""

from __future__ import annotations

import json
import os
import queue
import shutil
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from hil_fakes.sound_server import wait_until
from hvcpd.control.cli import main
from hvcpd.control.live.mqtt import Commands
from hvcpd.coordination.states import State
from tests.daemon.running import RunningRobot

client = pytest.importorskip("paho.mqtt.client")
MOSQUITTO = shutil.which("mosquitto", path=f"{os.environ.get('PATH', '')}:/usr/sbin")
PATIENCE_S = 20.0


@contextmanager
def broker_of(folder: Path, anonymous: bool = True) -> Iterator[int]:
    """The port of a broker on this computer only."""
    if MOSQUITTO is None:
        pytest.skip("mosquitto is missing: `make parts`")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        number = int(probe.getsockname()[1])
    settings = folder / "mosquitto.conf"
    settings.write_text(f"listener {number} 127.0.0.1\nallow_anonymous {str(anonymous).lower()}\n")
    broker = subprocess.Popen([MOSQUITTO, "-c", str(settings)], stderr=subprocess.DEVNULL)
    try:
        wait_until(lambda: _answers(number), PATIENCE_S, "the broker listens")
        yield number
    finally:
        broker.terminate()
        broker.wait()


@pytest.fixture
def port(tmp_path: Path) -> Iterator[int]:
    with broker_of(tmp_path) as number:
        yield number


def bridge_of(folder: Path, port: int, *more: str) -> subprocess.Popen[str]:
    """`hvcpctl mqtt` for the robot whose socket is in that folder."""
    config = folder / "hvcpd.yaml"
    config.write_text("name: Rob\ntasks: tasks.yaml\nstate_dir: state\n")
    options = ["--config", str(config), "--host", "127.0.0.1", "--port", str(port), *more]
    command = [sys.executable, "-m", "hvcpd.control.cli", "mqtt", *options]
    # Whoever starts the tests in the background may have SIGINT ignored, which programs inherit.
    obeys = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=obeys)


def _answers(number: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", number)) == 0


class Home:
    """Another client of the broker, as Home Assistant is one."""

    def __init__(self, port: int) -> None:
        self._heard: queue.Queue[tuple[str, str]] = queue.Queue()
        self._client = client.Client(client.CallbackAPIVersion.VERSION2)
        subscribed = threading.Event()
        self._client.on_message = lambda _c, _d, message: self._heard.put((message.topic, message.payload.decode()))
        self._client.on_subscribe = lambda *_: subscribed.set()
        self._client.connect("127.0.0.1", port)
        self._client.loop_start()
        self._client.subscribe("#", 1)
        assert subscribed.wait(PATIENCE_S)

    def close(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()

    def tell(self, topic: str, text: str, retain: bool = False) -> None:
        self._client.publish(topic, text, 1, retain).wait_for_publish(PATIENCE_S)

    def wait_for(self, topic: str, holds: Callable[[str], bool] = lambda _: True) -> str:
        """The first message with that topic for which it holds."""
        while True:
            at, text = self._heard.get(timeout=PATIENCE_S)
            if at == topic and holds(text):
                return text


def test_home_assistant_finds_the_robot_and_can_stop_it(tmp_path: Path, port: int) -> None:
    with RunningRobot(tmp_path) as robot:
        home, bridge = Home(port), bridge_of(tmp_path, port)
        device = json.loads(home.wait_for("homeassistant/device/hvcpd_rob/config"))
        assert device["dev"]["name"] == "Rob"
        topics = {entity.get("state_topic") for entity in device["cmps"].values()} - {None}
        assert topics == {"hvcpd/rob/status", "hvcpd/rob/heard"}
        status = json.loads(home.wait_for("hvcpd/rob/status"))
        assert (status["name"], status["stopped"]) == ("Rob", False)
        home.wait_for("hvcpd/rob/available", "online".__eq__)
        home.tell(device["cmps"]["stop"]["command_topic"], device["cmps"]["stop"]["payload_press"])
        home.wait_for("hvcpd/rob/statechanged", lambda text: json.loads(text)["state"] == "stopped")
        home.tell("hvcpd/rob/command", "resume")
        assert bridge.stderr is not None
        assert "'resume' is obeyed only with --commands" in bridge.stderr.readline()
        assert robot.state is State.STOPPED
        bridge.send_signal(signal.SIGINT)
        assert bridge.wait(PATIENCE_S) == 130
        home.wait_for("hvcpd/rob/available", "offline".__eq__)
        home.close()


def test_a_broker_that_goes_is_told(tmp_path: Path) -> None:
    """Nothing was told, and a stop did not arrive."""
    with RunningRobot(tmp_path):
        with broker_of(tmp_path) as port:
            home, bridge = Home(port), bridge_of(tmp_path, port)
            home.wait_for("hvcpd/rob/available", "online".__eq__)
            home.close()
        assert bridge.stderr is not None
        told = bridge.stderr.readline()
        bridge.send_signal(signal.SIGINT)
        assert bridge.wait(PATIENCE_S) == 130
    assert told == f"hvcpctl: MQTT: the broker at 127.0.0.1, port {port}, is gone; trying again\n"
    assert bridge.stderr.read() == "\n"


def test_two_bridges_of_one_robot_leave_each_other_connected(tmp_path: Path, port: int) -> None:
    """The broker disconnected each when the other connected, every second: a command reached one of them, or none."""
    with RunningRobot(tmp_path):
        home = Home(port)
        bridges = []
        for _ in range(2):
            bridges.append(bridge_of(tmp_path, port))
            home.wait_for("homeassistant/device/hvcpd_rob/config")
            home.wait_for("hvcpd/rob/status")
        home.tell("hvcpd/rob/command", "dance")
        for bridge in bridges:
            assert bridge.stderr is not None
            assert "MQTT: 'dance' is not obeyed" in bridge.stderr.readline()
            bridge.send_signal(signal.SIGINT)
            assert bridge.wait(PATIENCE_S) == 130
        home.close()


def test_a_command_that_the_broker_keeps_is_not_carried_out_at_each_connection(tmp_path: Path, port: int) -> None:
    with RunningRobot(tmp_path) as robot:
        home = Home(port)
        home.tell("hvcpd/rob/command", "stop", retain=True)
        bridge = bridge_of(tmp_path, port, "--commands")
        assert bridge.stderr is not None
        assert "retained commands are ignored" in bridge.stderr.readline()
        assert robot.state is not State.STOPPED
        home.wait_for("hvcpd/rob/available", "online".__eq__)  # from then on it follows the robot
        home.tell("hvcpd/rob/command", "Stop")
        home.wait_for("hvcpd/rob/statechanged", lambda text: json.loads(text)["state"] == "stopped")
        bridge.send_signal(signal.SIGINT)
        assert bridge.wait(PATIENCE_S) == 130
        home.close()


def test_a_stop_without_a_daemon_stops_the_next_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It was one line on the terminal of the bridge."""
    commands = Commands(tmp_path / "state" / "rob.sock", all_commands=True)
    commands.obey("stop")
    assert "it is stopped once it runs" in capsys.readouterr().err
    with RunningRobot(tmp_path) as robot:
        commands.make_good()
        assert robot.state is State.STOPPED
        commands.obey("resume")
        assert robot.state is not State.STOPPED
        commands.make_good()
        assert robot.state is not State.STOPPED, "it is made good once"
    commands.obey("stop")
    commands.obey("resume")
    with RunningRobot(tmp_path) as robot:
        commands.make_good()
        assert robot.state is not State.STOPPED


def test_what_is_not_obeyed_is_told_without_a_code_in_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    commands = Commands(tmp_path / "rob.sock", all_commands=False)
    for word in ("say", "Sy"):
        commands.obey(f"{word} Hi Bot, I am Anna, stand still, code one two three four five six")
    first, second = capsys.readouterr().err.splitlines()
    assert first == "hvcpctl: MQTT: 'say' is obeyed only with --commands"
    assert second == "hvcpctl: MQTT: 'sy' is not obeyed; see hvcpctl mqtt --help"


def test_a_broker_that_refuses_us_is_told(tmp_path: Path) -> None:
    with RunningRobot(tmp_path), broker_of(tmp_path, anonymous=False) as port:
        bridge = bridge_of(tmp_path, port)
        assert bridge.stderr is not None
        assert "the broker refuses us" in bridge.stderr.readline()
        bridge.send_signal(signal.SIGINT)
        assert bridge.wait(PATIENCE_S) == 130


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (["--port", "99999"], "'99999' is not a port"),
        (["--prefix", "a/#"], "--prefix 'a/#' is not a topic"),
        (["--password-file", "word"], "whose password is it? add --user NAME"),
    ],
)
def test_what_cannot_be_an_address_a_topic_or_a_login_is_refused(options: list[str], why: str, tmp_path: Path) -> None:
    with RunningRobot(tmp_path):
        bridge = bridge_of(tmp_path, 1883, *options)
        assert why in bridge.communicate(timeout=PATIENCE_S)[1]
        assert bridge.returncode in (1, 2)


def test_a_missing_library_is_told_as_this_installation_gets_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "paho.mqtt", None)
    config = tmp_path / "hvcpd.yaml"
    config.write_text("name: Rob\ntasks: tasks.yaml\nstate_dir: state\n")
    with RunningRobot(tmp_path):
        assert main(["mqtt", "--config", str(config), "--host", "127.0.0.1"]) == 2
    assert "the MQTT library is missing: pip install paho-mqtt" in capsys.readouterr().err
