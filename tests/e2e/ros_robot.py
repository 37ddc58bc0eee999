"""One robot as four processes: `hvcpd`, `hvcpctl ros`, a roscore of its own, and a fake base. Seen from ROS only."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import xmlrpc.client
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from hil_fakes.sound_server import DIE_WITH_PARENT, wait_until
from hvcpd.errors import ConfigError
from hvcpd.ros.master import master_pid
from hvcpd.ros.ros1 import class_of, find_rospy
from tests.e2e.parts import PRIORITY
from tests.e2e.robot import END_S, Part, RobotProcess

END_WITH_PARENT = ("setpriv", "--pdeathsig", "TERM", "--")
"""A test that is killed leaves no roscore behind: told to end, it ends its children too (util-linux, setpriv(1))."""
MOVES = 0.02
"""m/s or rad/s; a base that is slower stands."""
PACKAGES = ("std_msgs/String", "geometry_msgs/Twist", "nav_msgs/Odometry", "diagnostic_msgs/DiagnosticArray")


def missing() -> str:
    """What is missing for a real roscore, as a reason to skip; empty if nothing is."""
    if shutil.which("roscore") is None or shutil.which("setpriv") is None:
        return "not installed: roscore, or setpriv (`make parts` installs them as root)"
    if not find_rospy():
        return "not installed for this Python: rospy (`make parts` installs it as root, for Debian's)"
    try:
        for each in (*PACKAGES, "tf2_msgs/TFMessage", "move_base_msgs/MoveBaseActionGoal"):
            class_of(each)
    except ConfigError as error:
        return str(error)
    return ""


class Roscore:
    """A real roscore on a port of its own; `environment` leads to it. Its files are in `folder`."""

    def __init__(self, folder: Path, name: str) -> None:
        self._log = folder / f"{name}-roscore.log"
        self._port = _free_port()
        self.uri = f"http://127.0.0.1:{self._port}"
        home = {"ROS_HOME": str(folder / "ros"), "ROS_LOG_DIR": str(folder / "ros")}
        self.environment = {"ROS_MASTER_URI": self.uri, "ROS_IP": "127.0.0.1", **home}
        self._process: subprocess.Popen[bytes] | None = None
        self.start()

    def start(self) -> None:
        """Start it, and once more if it gives up: on a busy machine its master may take longer than it waits."""
        for _ in range(2):
            with self._log.open("ab") as log:
                process = self._process = subprocess.Popen(
                    [*END_WITH_PARENT, "roscore", "-p", str(self._port)],
                    env={**os.environ, **self.environment},
                    stdout=log,
                    stderr=log,
                )
            wait_until(lambda: self.answers() or process.poll() is not None, END_S, "a master answers")  # noqa: B023
            if process.poll() is None:
                return
        raise AssertionError(f"roscore gave up twice: {self._log.read_text()}")

    def answers(self) -> bool:
        """Whether the master answers."""
        try:
            return master_pid(self.uri) > 0
        except OSError:
            return False

    def kill_master(self) -> None:
        """kill -9; roscore then ends too. Nodes live on, connected to each other."""
        master: Any = xmlrpc.client.ServerProxy(self.uri)
        _, _, pid = master.getPid("/hvcpd")  # `master_pid` does not wait for a busy computer
        os.kill(int(pid), signal.SIGKILL)
        self._end()

    def kill_node(self, name: str) -> None:
        """As `rosnode kill` does."""
        master: Any = xmlrpc.client.ServerProxy(self.uri)
        _, _, uri = master.lookupNode("/rosnode", name)
        xmlrpc.client.ServerProxy(str(uri)).shutdown("/rosnode", "user request")

    def close(self) -> None:
        """End it in order."""
        if self._process is not None:
            self._end()

    def nodes(self) -> set[str]:
        """All nodes that its master knows; none while there is none."""
        if not self.answers():
            return set()
        return {node for part in self._state() for _, nodes in part for node in nodes}

    def subscribers(self) -> dict[str, list[str]]:
        """Each topic with the nodes that listen to it."""
        return dict(self._state()[1])

    def _state(self) -> list[list[tuple[str, list[str]]]]:
        """Publishers, subscribers and services: names, each with its nodes."""
        master: Any = xmlrpc.client.ServerProxy(self.uri)
        _, _, state = master.getSystemState("/test")
        return cast(list[list[tuple[str, list[str]]]], state)

    def _end(self) -> None:
        process, self._process = self._process, None
        assert process is not None
        process.terminate()
        process.wait(END_S)


def read_record(path: Path, kind: str) -> list[tuple[float, Any]]:
    """All that a base has seen of one kind: when (monotonic, s), and what."""
    lines = path.read_text().splitlines() if path.exists() else []
    values = (json.loads(line) for line in lines if f'"kind": "{kind}"' in line and line.endswith("}"))
    return [(value["at_s"], value["value"]) for value in values]


class RosRobot(RobotProcess):
    """A robot whose base ROS has. Its files are in `folder`."""

    def __init__(self, part: Part, folder: Path, tasks: Path, environment: Mapping[str, str]) -> None:
        super().__init__(part, folder, tasks, environment)
        self.record = folder / f"{part.name}-ros.jsonl"
        self._pose = (part.start.x_m, part.start.y_m, 0.0)
        self._folder = folder
        self.core: Roscore | None = None
        self._base: subprocess.Popen[str] | None = None
        self.bridge: subprocess.Popen[bytes] | None = None

    def _wheels(self) -> str:
        return "{driver: ros}"

    # --- its processes ----------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Switch ROS on, then the daemon, then the bridge."""
        self.start_ros()
        self.start_daemon()
        wait_until(self.control_socket.exists, END_S, "the daemon has a control socket")
        command = [*PRIORITY, *DIE_WITH_PARENT, sys.executable, "-m", "hvcpd.control.cli", "ros", "--ros", "1"]
        with (self._folder / f"{self.name}-bridge.log").open("ab") as log:
            self.bridge = subprocess.Popen(
                [*command, "--socket", str(self.control_socket)], env=self._ros_environment(), stdout=log, stderr=log
            )

    def start_ros(self) -> None:
        """A roscore, and a base that stands where it stood."""
        if self.core is None:
            self.core = Roscore(self._folder, self.name)
        else:
            self.core.start()
        pose = ",".join(map(str, self._pose))
        with (self._folder / f"{self.name}-base.log").open("ab") as log:
            self._base = subprocess.Popen(
                [*PRIORITY, sys.executable, "-m", "tests.e2e.ros_base", "--record", str(self.record), f"--pose={pose}"],
                env=self._ros_environment(),
                stdin=subprocess.PIPE,
                stderr=log,
                text=True,
            )

    def restart_ros(self) -> None:
        """The base's node must register anew, so it ends too; the base itself stays where it is."""
        self._pose = tuple(self.seen("pose")[-1][1][:3])
        self._end_base()
        self.start_ros()

    def close(self) -> None:
        """End all."""
        if self.bridge is not None:
            self.bridge.terminate()
            self.bridge.wait(END_S)
        super().close()
        self._end_base()
        if self.core is not None:
            self.core.close()

    def _end_base(self) -> None:
        if self._base is not None:
            self._base.communicate(timeout=END_S)  # it ends with its input
            self._base = None

    def _ros_environment(self) -> dict[str, str]:
        assert self.core is not None
        return {**os.environ, **self.core.environment}

    # --- what ROS has seen ------------------------------------------------------------------------------------------

    def seen(self, kind: str) -> list[tuple[float, Any]]:
        """All of one topic: when (monotonic, s), and what."""
        return read_record(self.record, kind)

    def board(self) -> dict[int, tuple[str, str | None]]:
        """The tasks as last published: number to state and owner."""
        boards = self.seen("tasks")
        return {number: (state, owner or None) for number, state, owner in (boards[-1][1] if boards else [])}

    def happened(self, kind: str) -> list[tuple[float, dict[str, Any]]]:
        """The events of one kind."""
        events = ((at_s, json.loads(text)) for at_s, text in self.seen("events"))
        return [(at_s, event) for at_s, event in events if event["event"] == kind]

    @property
    def drives(self) -> bool:
        """Whether its base truly moves."""
        trail = self.seen("pose")
        return bool(trail) and max(map(abs, trail[-1][1][3:])) > MOVES


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
