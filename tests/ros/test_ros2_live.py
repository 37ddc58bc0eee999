"""The real bridge and a real ROS 2 node, on this computer only: by rclpy, and by Cyclone DDS alone.

ROS 2 is in no Debian and in no lock file: a Python that has rclpy and the messages (and, for the bridge, what hvcpd
needs) is named by HVCPD_ROS2_PYTHON, for example a virtual environment with `ros-rclpy[fastrtps]`, `ros-std-msgs`,
`ros-geometry-msgs`, `ros-nav-msgs` and `ros-diagnostic-msgs` from PyPI.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from hil_fakes.sound_server import wait_until
from hvcpd.errors import EX_USER
from tests.e2e.ros_robot import read_record
from tests.ros.live import bridge_to, daemon_at, running
from tests.ros.test_bridge import HEARD, moving

VARIABLE = "HVCPD_ROS2_PYTHON"
PYTHON = os.environ.get(VARIABLE, "")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not PYTHON, reason=f"no ROS 2 here: name a Python that has rclpy in {VARIABLE}"),
]
WAIT_S = 30.0


@pytest.mark.parametrize("bridge", [PYTHON, sys.executable], ids=["rclpy", "cyclonedds"])
def test_topics_of_the_bridge_and_of_a_ros_2_node_meet(tmp_path: Path, bridge: str) -> None:
    if bridge == sys.executable:
        pytest.importorskip("cyclonedds")
    record = tmp_path / "ros2.jsonl"
    domain = str(50 + os.getpid() % 40)
    environment = {"ROS_DOMAIN_ID": domain, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    peer = [PYTHON, str(Path(__file__).with_name("ros2_peer.py")), str(record)]
    command = [bridge, "-m", "hvcpd.control.cli", "ros", "--ros", "2"]
    with ExitStack() as stack:
        daemon = stack.enter_context(daemon_at(tmp_path / "d.sock", "cmd_vel"))
        node = stack.enter_context(running(peer, environment, tmp_path / "peer.log"))
        stack.enter_context(bridge_to(daemon, environment, [*command, "--socket", str(daemon.path)]))
        assert node.stdin is not None

        def seen(kind: str) -> list[Any]:
            return [value for _, value in read_record(record, kind)]

        def keep_telling() -> bool:
            daemon.tell(HEARD)
            daemon.tell(moving(0.15))
            return bool(seen("heard/json")) and [0.15, 0.5] in seen("cmd_vel") and bool(seen("/diagnostics"))

        wait_until(keep_telling, WAIT_S, "ROS 2 hears it, and its base is driven")
        assert seen("heard")[0] == HEARD["text"]
        assert json.loads(seen("heard/json")[0])["speaker"] == "Bot"
        assert json.loads(seen("tasks")[0])[0]["number"] == 1
        assert seen("estop/state") == [False]
        wait_until(lambda: any("x_m" in each for each in daemon.arguments("base")), WAIT_S, "odometry arrives")
        odometry = next(each for each in daemon.arguments("base") if "x_m" in each)
        assert (odometry["x_m"], odometry["y_m"], odometry["linear_m_s"]) == (1.5, -0.5, 0.125)
        for order in (["say", "Hi all, I am Rob, who is here"], ["estop", True]):
            node.stdin.write(json.dumps(order) + "\n")
            node.stdin.flush()
        wait_until(lambda: bool(daemon.arguments("stop")), WAIT_S, "it is to stop")
        assert daemon.arguments("say")[0]["text"] == "Hi all, I am Rob, who is here"


@pytest.mark.parametrize("bridge", [PYTHON, sys.executable], ids=["rclpy", "cyclonedds"])
def test_a_wrong_parameter_ends_the_bridge_with_the_reason(tmp_path: Path, bridge: str) -> None:
    environment = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    with daemon_at(tmp_path / "d.sock", "cmd_vel") as daemon:
        command = [bridge, "-m", "hvcpd.control.cli", "ros", "--ros", "2", "--socket", str(daemon.path)]
        ended = subprocess.run(
            [*command, "--ros-args", "-p", "base_frame:=5"],
            env=environment,
            capture_output=True,
            text=True,
            timeout=WAIT_S,
            check=False,
        )
    assert ended.returncode == EX_USER, ended.stderr
    assert "base_frame" in ended.stderr
