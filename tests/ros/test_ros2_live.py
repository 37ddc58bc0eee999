"""The real bridge and a real ROS 2 node, on this computer only.

ROS 2 is in no Debian: `make parts` installs one from PyPI into .ros2. ROS2_PYTHON names another Python, of our
version, that has rclpy and the messages; there `release/ros/hvcpd_msgs` is built or not.
"""

from __future__ import annotations

import json
import os
import subprocess
import sysconfig
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from hil_fakes.sound_server import wait_until
from hvcpd.errors import EX_FAILURE, EX_USER
from tests.e2e.ros_robot import read_record
from tests.ros.live import SocketDaemon, bridge_to, daemon_at, running
from tests.ros.talk import HEARD, moving

VARIABLE = "ROS2_PYTHON"
ROOT = Path(__file__).parents[2]
OURS = ROOT / ".ros2"
PYTHON = os.environ.get(VARIABLE) or (str(OURS / "bin" / "python") if (OURS / "complete").exists() else "")
PATHS = os.pathsep.join((str(ROOT), sysconfig.get_path("purelib"), os.environ.get("PYTHONPATH", "")))
"""Where that Python, which is of our version, finds hvcpd and what hvcpd needs."""
ENVIRONMENT = {
    "PYTHONPATH": PATHS,
    "ROS_DOMAIN_ID": str(50 + os.getpid() % 40),
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
}
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not PYTHON, reason=f"no ROS 2 here: `make parts`, or name a Python that has rclpy in {VARIABLE}"
    ),
]
WAIT_S = 30.0
COMMAND = [PYTHON, "-m", "hvcpd.control.cli", "ros", "--ros", "2"]
IMPORT = [PYTHON, "-c", "import hvcpd_msgs.msg"]
TYPED = (
    bool(PYTHON)
    and subprocess.run(IMPORT, env={**os.environ, **ENVIRONMENT}, stderr=subprocess.DEVNULL, check=False).returncode
    == 0
)
CONFIGURE, CLEAN_UP, ACTIVATE, DEACTIVATE, SHUT_DOWN = range(1, 6)
"""Transitions of lifecycle_msgs/Transition; the last is that of a node that is not configured."""


@dataclass
class Scene:
    """A daemon, the bridge, and a node of ROS 2 whose record is kept."""

    daemon: SocketDaemon
    bridge: subprocess.Popen[bytes]
    node: subprocess.Popen[str]
    record: Path

    def seen(self, kind: str) -> list[Any]:
        return [value for _, value in read_record(self.record, kind)]

    def order(self, name: str, value: object) -> None:
        assert self.node.stdin is not None
        self.node.stdin.write(json.dumps([name, value]) + "\n")
        self.node.stdin.flush()

    def change(self, transition: int) -> None:
        """Have the bridge's node go through this transition."""
        self.order("transition", transition)
        wait_until(lambda: [transition, True] in self.seen("transition"), WAIT_S, f"transition {transition}")


@contextmanager
def on_stage(folder: Path, *arguments: str) -> Iterator[Scene]:
    record = folder / "ros2.jsonl"
    peer = [PYTHON, str(Path(__file__).with_name("ros2_peer.py")), str(record)]
    command = [*COMMAND, "--socket", str(folder / "d.sock"), *arguments]
    with ExitStack() as stack:
        daemon = stack.enter_context(daemon_at(folder / "d.sock", "cmd_vel"))
        node = stack.enter_context(running(peer, ENVIRONMENT, folder / "peer.log"))
        bridge = stack.enter_context(bridge_to(daemon, ENVIRONMENT, command))
        yield Scene(daemon, bridge, node, record)


def test_topics_of_the_bridge_and_of_a_ros_2_node_meet(tmp_path: Path) -> None:
    with on_stage(tmp_path) as scene:
        daemon, seen = scene.daemon, scene.seen

        def keep_telling() -> bool:
            daemon.tell(HEARD)
            daemon.tell(moving(0.15))
            return bool(seen("heard")) and [0.15, 0.5] in seen("cmd_vel") and bool(seen("/diagnostics"))

        wait_until(keep_telling, WAIT_S, "ROS 2 hears it, and its base is driven")
        assert seen("heard")[0] == HEARD["text"]
        if TYPED:
            wait_until(lambda: bool(seen("heard/sentence")), WAIT_S, "the sentence comes with its words")
            assert seen("heard/sentence")[0] == ["Bot", 0.93, ["hi", "four"]]
            wait_until(lambda: [[1, "open"]] in seen("tasks"), WAIT_S, "the board comes")
        assert seen("estop/state") == [False]
        wait_until(lambda: any("x_m" in each for each in daemon.arguments("base")), WAIT_S, "odometry arrives")
        odometry = next(each for each in daemon.arguments("base") if "x_m" in each)
        assert (odometry["x_m"], odometry["y_m"], odometry["linear_m_s"]) == (1.5, -0.5, 0.125)
        scene.order("say", "Hi all, I am Rob, who is here")
        scene.order("estop", True)
        wait_until(lambda: bool(daemon.arguments("stop")), WAIT_S, "it is to stop")
        assert daemon.arguments("say")[0]["text"] == "Hi all, I am Rob, who is here"


def test_the_node_has_the_life_cycle_of_managed_nodes(tmp_path: Path) -> None:
    with on_stage(tmp_path, "--ros-args", "-p", "autostart:=false") as scene:
        daemon, seen = scene.daemon, scene.seen
        wait_until(lambda: bool(daemon.arguments("base")), WAIT_S, "the daemon is told why there is no base")
        assert "deactivated" in daemon.arguments("base")[0]["fault"]
        scene.change(CONFIGURE)
        scene.change(ACTIVATE)

        def drives() -> bool:
            daemon.tell(HEARD)
            daemon.tell(moving(0.15))
            return bool(seen("heard")) and [0.15, 0.5] in seen("cmd_vel")

        wait_until(drives, WAIT_S, "an active node passes what is heard, and drives the base")
        scene.change(DEACTIVATE)
        wait_until(lambda: seen("cmd_vel")[-1] == [0.0, 0.0], WAIT_S, "an inactive node's base stands")
        count = len(daemon.arguments("base"))
        for _ in range(20):
            daemon.tell(moving(0.15))
        scene.order("estop", True)
        wait_until(lambda: bool(daemon.arguments("stop")), WAIT_S, "a stop passes")
        assert seen("cmd_vel")[-1] == [0.0, 0.0]
        assert not [each for each in daemon.arguments("base")[count:] if "x_m" in each]
        scene.change(CLEAN_UP)
        scene.order("transition", SHUT_DOWN)
        wait_until(lambda: scene.bridge.poll() is not None, WAIT_S, "a node that is shut down ends")
        assert scene.bridge.returncode == EX_FAILURE


@pytest.mark.parametrize("wrong", [("-p", "base_frame:=5"), ("-r", "heard:=9//ears"), ("-r", "heard")], ids=" ".join)
def test_a_wrong_argument_ends_the_bridge_with_the_reason(tmp_path: Path, wrong: tuple[str, str]) -> None:
    with daemon_at(tmp_path / "d.sock", "cmd_vel") as daemon:
        ended = subprocess.run(
            [*COMMAND, "--socket", str(daemon.path), "--ros-args", *wrong],
            env={**os.environ, **ENVIRONMENT},
            capture_output=True,
            text=True,
            timeout=WAIT_S,
            check=False,
        )
    assert ended.returncode == EX_USER, ended.stderr
    assert wrong[1].split(":=")[0] in ended.stderr
    assert "Traceback" not in ended.stderr
