"""The packages for ROS 1 are built and installed by Debian's catkin, and roslaunch finds what they install."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.ros.test_ros1_live import PACKAGES

TOP = Path("/usr/share/catkin/cmake/toplevel.cmake")
PARTS = [
    *(TOP, Path("/usr/bin/cmake"), Path("/usr/bin/roslaunch")),
    *(Path(f"/usr/share/{name}/package.xml") for name in ("message_generation", "std_msgs", "geometry_msgs")),
]
MISSING = [str(path) for path in PARTS if not path.exists()]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(MISSING), reason="apt install catkin ros-message-generation ros-geometry-msgs"),
]
SETTINGS = ("PYTHON_EXECUTABLE=/usr/bin/python3", "CATKIN_ENABLE_TESTING=OFF", "CATKIN_BLACKLIST_PACKAGES=")


def test_both_packages_build_and_roslaunch_starts_the_bridge_by_them(tmp_path: Path) -> None:
    source, build, installed = (tmp_path / name for name in ("src", "build", "install"))
    for name in ("hvcpd", "hvcpd_msgs"):
        shutil.copytree(PACKAGES / name, source / name)
    shutil.copyfile(TOP, source / "CMakeLists.txt")
    environment = {**os.environ, "ROS_VERSION": "1"}
    places = (f"CATKIN_DEVEL_PREFIX={tmp_path / 'devel'}", f"CMAKE_INSTALL_PREFIX={installed}")
    options = [f"-D{each}" for each in (*SETTINGS, *places)]
    for command in (["cmake", "-S", source, "-B", build, *options], ["make", "-C", build, "install"]):
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    script = (
        f". {installed}/setup.bash && roslaunch --args /hvcpd hvcpd hvcpd.launch robot:=Rob && "
        "/usr/bin/python3 -c 'import hvcpd_msgs.msg as own; print(own.Sentence._type)'"
    )
    told = subprocess.run(["bash", "-c", script], check=True, capture_output=True, text=True).stdout
    assert f"{installed}/lib/hvcpd/bridge --ros 1 --name Rob" in told
    assert "hvcpd_msgs/Sentence" in told
