"""The launch files for ROS 2, run by a second launcher: play_launch, which reads them as `ros2 launch` does.

ROS's own launch and launch_ros are neither in Debian nor on PyPI. `make parts` installs play_launch beside ROS 2.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sysconfig
from collections.abc import Mapping
from contextlib import ExitStack
from ctypes.util import find_library
from pathlib import Path
from typing import Any

import pytest
import yaml

from hil_fakes.sound_server import wait_until
from tests.e2e.ros_robot import read_record
from tests.ros.live import bridge_to, daemon_at, running
from tests.ros.talk import HEARD
from tests.ros.test_ros1_live import PACKAGES
from tests.ros.test_ros2_live import ENVIRONMENT, OURS, PYTHON, WAIT_S

SITE = Path(sysconfig.get_path("purelib", vars={"base": str(OURS)}))
LAUNCHER = SITE / "play_launch" / "bin" / "play_launch"
LIBPYTHON = Path(str(sysconfig.get_config_var("LIBDIR")), str(sysconfig.get_config_var("INSTSONAME")))
MISSING = [
    *(str(path) for path in (LAUNCHER, LIBPYTHON) if not path.exists()),
    *(name for name in ("cc", "setpriv") if shutil.which(name) is None),
    *(name for name in ("libz3",) if find_library(name.removeprefix("lib")) is None),
]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(MISSING), reason=f"missing: {', '.join(MISSING)}; `make parts` installs what it can"),
]
SERVICES = "rosidl_typesupport_c__get_service_type_support_handle__composition_interfaces__srv__"
UNUSED = (
    *(f"composition_interfaces__srv__{each}__init" for each in ("ListNodes_Request", "ListNodes_Response")),
    *(f"composition_interfaces__srv__{each}_Response__init" for each in ("LoadNode", "UnloadNode")),
    *(SERVICES + each for each in ("ListNodes", "LoadNode", "UnloadNode")),
)
"""Of libraries that PyPI does not have, and that are called only for nodes within one process."""
THEIRS = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    parameters = [{"map": LaunchConfiguration("map")}]
    node = Node(package="hvcpd", executable="bridge", name="NAME", parameters=parameters)
    return LaunchDescription([DeclareLaunchArgument("map", default_value=""), node])
"""
"""Stands in for a launch file of a TurtleBot3's."""


@pytest.fixture
def installed(tmp_path: Path) -> dict[str, str]:
    """The package as colcon installs it, stand-ins for a TurtleBot3's, and an environment that finds them."""
    share, program = tmp_path / "share", tmp_path / "lib" / "hvcpd" / "bridge"
    program.parent.mkdir(parents=True)
    shutil.copy(PACKAGES / "hvcpd" / "scripts" / "bridge", program)
    shutil.copytree(PACKAGES / "hvcpd" / "launch", share / "hvcpd" / "launch")
    for package, name in (("turtlebot3_bringup", "robot"), ("turtlebot3_navigation2", "navigation2")):
        (share / package / "launch").mkdir(parents=True)
        (share / package / "launch" / f"{name}.launch.py").write_text(THEIRS.replace("NAME", name))
    index = share / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True)
    for package in ("hvcpd", "turtlebot3_bringup", "turtlebot3_navigation2"):
        (index / package).touch()
    hvcpctl = tmp_path / "bin" / "hvcpctl"
    hvcpctl.parent.mkdir()
    hvcpctl.write_text(f'#!/bin/sh\nexec {PYTHON} -m hvcpd.control.cli "$@"\n')
    hvcpctl.chmod(0o755)
    libraries = [SITE / "play_launch" / "lib", OURS / "lib", *SITE.glob("*.libs"), stand_ins(tmp_path / "stand-ins")]
    return {
        **ENVIRONMENT,
        "AMENT_PREFIX_PATH": str(tmp_path),
        "LD_LIBRARY_PATH": os.pathsep.join(map(str, libraries)),
        "NROS_PYTHON": PYTHON,
        "PATH": os.pathsep.join((str(hvcpctl.parent), os.environ["PATH"])),
    }


def stand_ins(folder: Path) -> Path:
    """Libraries that the launcher is linked with and does not use here."""
    folder.mkdir()
    source = folder / "unused.c"
    source.write_text("".join(f"void {name}(void) {{ __builtin_trap(); }}\n" for name in UNUSED))
    for kind in ("typesupport", "generator"):
        library = folder / f"libcomposition_interfaces__rosidl_{kind}_c.so"
        subprocess.run(["cc", "-shared", "-fPIC", "-nostdlib", str(source), "-o", str(library)], check=True)
    (folder / "libpython3.10.so.1.0").symlink_to(LIBPYTHON)
    return folder


def nodes_of(folder: Path, environment: Mapping[str, str], *words: str) -> dict[str, Any]:
    """The nodes that a launch file of ours would start, by their names."""
    command = [str(LAUNCHER), "dump", "--output", "model.yaml", "launch", "hvcpd", *words]
    done = subprocess.run(
        command, cwd=folder, env={**os.environ, **environment}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    nodes: dict[str, Any] = yaml.safe_load((folder / "model.yaml").read_text())["structure"]["nodes"]
    return nodes


def test_it_starts_the_bridge(tmp_path: Path, installed: dict[str, str]) -> None:
    record = tmp_path / "ros2.jsonl"
    peer = [PYTHON, str(Path(__file__).with_name("ros2_peer.py")), str(record)]
    command = [str(LAUNCHER), "launch", "--log-dir", str(tmp_path / "log"), "--disable-all", "hvcpd", "hvcpd.launch.py"]
    with ExitStack() as stack:
        daemon = stack.enter_context(daemon_at(tmp_path / "d.sock", "cmd_vel"))
        stack.enter_context(running(peer, ENVIRONMENT, tmp_path / "peer.log"))
        stack.enter_context(bridge_to(daemon, installed, [*command, f"socket:={daemon.path}"]))

        def hears() -> bool:
            daemon.tell(HEARD)
            return bool(read_record(record, "heard"))

        wait_until(hears, WAIT_S, "a node of ROS 2 hears what the robot heard")


def test_arguments_of_the_launch_file_become_arguments_and_parameters_of_the_node(
    tmp_path: Path, installed: dict[str, str]
) -> None:
    (node,) = nodes_of(tmp_path, installed, "hvcpd.launch.py").values()
    assert (node["args"], node["lifecycle"]) == (["--ros", "2"], True)
    assert node["params"] == {
        "odom_frame": "odom",
        "base_frame": "base_link",
        "map_frame": "map",
        "publish_tf": True,
        "action": "",
        "autostart": True,
    }
    words = ("robot:=Rob", "publish_tf:=false", "base_frame:=base")
    (node,) = nodes_of(tmp_path, installed, "hvcpd.launch.py", *words).values()
    assert node["args"] == ["--ros", "2", "--name", "Rob"]
    assert (node["params"]["publish_tf"], node["params"]["base_frame"]) == (False, "base")


def test_a_turtlebot3_has_base_and_bridge_and_with_a_map_navigation(tmp_path: Path, installed: dict[str, str]) -> None:
    nodes = nodes_of(tmp_path, installed, "turtlebot3.launch.py")
    assert sorted(nodes) == ["/hvcpd", "/robot"]
    assert nodes["/hvcpd"]["params"]["base_frame"] == "base_footprint"
    nodes = nodes_of(tmp_path, installed, "turtlebot3.launch.py", "map:=/home/o'neil/room.yaml", "robot:=Bot")
    assert sorted(nodes) == ["/hvcpd", "/navigation2", "/robot"]
    assert nodes["/navigation2"]["params"]["map"] == "/home/o'neil/room.yaml"
    assert nodes["/hvcpd"]["args"] == ["--ros", "2", "--name", "Bot"]
