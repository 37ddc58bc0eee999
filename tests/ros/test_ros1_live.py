"""The real bridge on a real roscore, with a fake base and a fake move_base: what passes, and what stops the base."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from hil_fakes.sound_server import wait_until
from hvcpd.errors import EX_FAILURE
from tests.e2e import ros_robot
from tests.e2e.ros_robot import MOVES, Roscore, read_record
from tests.ros.live import BRIDGE, SocketDaemon, bridge_to, daemon_at, running
from tests.ros.talk import HEARD

MISSING = ros_robot.missing()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(MISSING), reason=MISSING)]
WAIT_S = 30.0
PACKAGES = Path(__file__).parents[2] / "release" / "ros"
STANDING = {"event": "drive", "at_s": 1.0, "linear_m_s": 0.0, "angular_rad_s": 0.0, "stopped": False, "goal": None}
FORWARD = STANDING | {"linear_m_s": 0.2}
STOPPED = STANDING | {"stopped": True}


@dataclass
class Scene:
    """A daemon, and a base whose record is kept."""

    daemon: SocketDaemon
    record: Path
    base: Any
    core: Roscore
    bridge: subprocess.Popen[bytes]

    def seen(self, kind: str) -> list[Any]:
        return [value for _, value in read_record(self.record, kind)]

    @property
    def speed(self) -> float:
        """Of the base just now, m/s or rad/s, the larger; 0 before its first message."""
        return max((abs(value) for pose in self.seen("pose")[-1:] for value in pose[3:]), default=0.0)

    def command(self, topic: str, value: object) -> None:
        self.base.stdin.write(json.dumps([topic, value]) + "\n")
        self.base.stdin.flush()

    def keep_telling(self, event: dict[str, Any], until: Any, what: str) -> None:
        """Tell an event again and again, as a daemon does, until something holds."""

        def holds() -> bool:
            self.daemon.tell(event)
            return bool(until())

        wait_until(holds, WAIT_S, what)

    def base_told(self, key: str) -> list[Any]:
        return [each[key] for each in self.daemon.arguments("base") if key in each]


@contextmanager
def on_stage(folder: Path, mode: str, launch: bool = False, driver: str = "ros") -> Iterator[Scene]:
    """`launch`: the bridge is started by the launch file, from the package for ROS users."""
    record = folder / "ros.jsonl"
    with ExitStack() as stack:
        core = Roscore(folder, "core")
        stack.callback(core.close)
        daemon = stack.enter_context(daemon_at(folder / "d.sock", mode, driver))
        command = [sys.executable, "-m", "tests.e2e.ros_base", "--record", str(record)]
        base = stack.enter_context(running(command, core.environment, folder / "base.log"))
        wait_until(core.answers, WAIT_S, "there is a master")  # roslaunch would start one of its own
        how = ("roslaunch", "hvcpd", "hvcpd.launch", f"socket:={daemon.path}") if launch else BRIDGE
        options = () if launch else ("--socket", str(daemon.path), "--ros", "1", "_base_frame:=base_footprint")
        places = {"ROS_PACKAGE_PATH": str(PACKAGES), "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
        bridge = stack.enter_context(bridge_to(daemon, {**core.environment, **places}, (*how, *options)))
        scene = Scene(daemon, record, base, core, bridge)
        if driver == "ros":
            wait_until(lambda: bool(scene.base_told("x_m")), WAIT_S, "odometry reaches the daemon")
        yield scene


def test_speech_speed_and_stop_pass_and_a_dead_master_or_daemon_stops_the_base(tmp_path: Path) -> None:
    with on_stage(tmp_path, "cmd_vel") as scene:
        scene.keep_telling(HEARD, lambda: scene.seen("heard"), "ROS hears it")
        assert scene.seen("heard")[0] == HEARD["text"]
        scene.command("say", "Hi all, I am Rob, who is here")
        wait_until(lambda: bool(scene.daemon.arguments("say")), WAIT_S, "the daemon is to say it")
        wait_until(lambda: bool(scene.seen("tasks")), WAIT_S, "the board is latched")

        scene.keep_telling(FORWARD, lambda: scene.base_told("x_m")[-1] > 0.05, "the base drives, and tells so")
        wait_until(lambda: scene.speed < MOVES, WAIT_S, "a silent daemon stops it")

        scene.keep_telling(FORWARD, lambda: scene.speed > MOVES, "it drives again")
        scene.command("estop", True)
        wait_until(lambda: bool(scene.daemon.arguments("stop")), WAIT_S, "the daemon is told to stop")
        count = len(scene.seen("cmd_vel"))
        scene.keep_telling(STOPPED, lambda: len(scene.seen("cmd_vel")) > count + 20, "it is held")
        assert set(map(tuple, scene.seen("cmd_vel")[count + 1 :])) == {(0.0, 0.0)}
        assert scene.speed < MOVES

        scene.keep_telling(FORWARD, lambda: scene.speed > MOVES, "it drives once more")
        scene.core.kill_master()
        scene.keep_telling(FORWARD, lambda: scene.speed < MOVES, "a dead master stops it, whatever the daemon wants")
        wait_until(lambda: bool(scene.base_told("fault")), WAIT_S, "the daemon is told why")
        assert "no ROS master" in scene.base_told("fault")[-1]
        scene.core.start()
        wait_until(lambda: "/hvcpd" in scene.core.nodes(), WAIT_S, "the bridge is back when its master is")


def test_a_node_that_is_killed_by_ros_stops_the_base_and_does_not_come_back(tmp_path: Path) -> None:
    with on_stage(tmp_path, "cmd_vel") as scene:
        scene.keep_telling(FORWARD, lambda: scene.speed > MOVES, "it drives")
        scene.core.kill_node("/hvcpd")
        wait_until(lambda: scene.bridge.poll() is not None, WAIT_S, "the bridge ends")
        assert scene.bridge.returncode == EX_FAILURE
        assert "ROS has ended the bridge: user request" in scene.daemon.path.with_suffix(".log").read_text()
        wait_until(lambda: scene.speed < MOVES, WAIT_S, "the base stands")


def test_a_goal_is_reached_with_feedback_and_another_one_cancelled_by_stop(tmp_path: Path) -> None:
    with on_stage(tmp_path, "goal", launch=True) as scene:
        near = STANDING | {"goal": {"number": 1, "x_m": 0.15, "y_m": 0.0}}
        scene.keep_telling(near, lambda: scene.base_told("goal"), "the goal has ended")
        (ended,) = [each for each in scene.daemon.arguments("base") if "goal" in each]
        assert (ended["goal"], ended["arrived"]) == (1, True)
        assert scene.seen("pose")[-1][0] == pytest.approx(0.15, abs=0.03)
        far = STANDING | {"goal": {"number": 2, "x_m": 5.0, "y_m": 0.0}}
        scene.keep_telling(far, lambda: scene.seen("pose")[-1][0] > 0.3, "it is under way")
        scene.keep_telling(
            far, lambda: "distance to the goal" in str(scene.seen("/diagnostics")[-1]), "its feedback is diagnosed"
        )
        scene.keep_telling(STOPPED, lambda: scene.speed < MOVES, "stop cancels it")
        assert [each[0] for each in scene.seen("move_base")] == ["goal", "goal", "cancel"]
        assert scene.base_told("goal") == [1], "a goal that was withdrawn matters no more"
        assert scene.seen("pose")[-1][0] < 4.0


def test_a_robot_with_wheels_of_its_own_tells_where_it_is_and_obeys_no_cmd_vel(tmp_path: Path) -> None:
    with on_stage(tmp_path, "cmd_vel", driver="opencr") as scene:
        odom = {"event": "odom", "at_s": 1.0, "x_m": 2.5, "y_m": -1.0, "heading_rad": 0.0}
        odom |= {"linear_m_s": 0.1, "angular_rad_s": 0.0}
        scene.keep_telling(odom, lambda: scene.seen("/tf"), "tf is told")
        assert scene.seen("/tf")[0] == [["odom", "base_footprint", [2.5, -1.0]]]
        subscribers = {topic for topic, nodes in scene.core.subscribers().items() if "/hvcpd" in nodes}
        assert subscribers == {"/say", "/estop", "/task"}
