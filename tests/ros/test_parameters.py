"""Parameters and the command: what is asked of ROS, and which ROS."""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import hvcpd
from hvcpd.control.cli import main, make_parser
from hvcpd.control.live import ros
from hvcpd.errors import EX_OK, EX_USER, ConfigError
from hvcpd.ros.command import choose_ros, obey_signals, wait_for_master, wanted_by
from hvcpd.ros.parameters import Parameters, parameters_from
from hvcpd.ros.port import Wanted


def test_parameters_are_taken_and_every_fault_is_told() -> None:
    assert parameters_from({"base_frame": "base_footprint", "publish_tf": False}) == Parameters(
        base_frame="base_footprint", publish_tf=False
    )
    with pytest.raises(ConfigError) as error:
        parameters_from({"base_frme": "x", "publish_tf": "yes", "odom_frame": "/odom"})
    text = str(error.value)
    assert "did you mean 'base_frame'?" in text
    assert "publish_tf: expected true or false, found 'yes'" in text
    assert "odom_frame" in text


def test_ros_is_the_one_asked_for_or_the_one_sourced() -> None:
    assert choose_ros("2", {"ROS_VERSION": "1"}) == "ros2"
    assert choose_ros(None, {"ROS_VERSION": "1"}) == "ros1"
    assert choose_ros(None, {"ROS_VERSION": "2"}) == "ros2"


def test_a_sourced_ros_2_is_seen_by_the_packages_isolated_python_before_its_own_libraries(tmp_path: Path) -> None:
    """The messages of a ROS are built for the system's NumPy; the package has another in its own folder."""
    for folder, module in (("ros", "rclpy"), ("ros", "numpy"), ("own", "numpy")):
        (tmp_path / folder / module).mkdir(parents=True)
        (tmp_path / folder / module / "__init__.py").touch()
    program = f"""
import sys
sys.path[:0] = [{str(tmp_path / "own")!r}, {str(Path(hvcpd.__file__).parents[1])!r}]
from hvcpd.ros.command import see_sourced
see_sourced({str(tmp_path / "own")!r})
import numpy, rclpy
print(numpy.__file__)
"""
    environment = {**os.environ, "PYTHONPATH": f":{tmp_path / 'ros'}"}
    command = [sys.executable, "-I", "-c", program]
    told = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout
    assert told == f"{tmp_path / 'ros/numpy/__init__.py'}\n"


@pytest.mark.parametrize(
    ("driver", "mode", "wanted"),
    [
        ("ros", "cmd_vel", Wanted(True, False)),
        ("ros", "goal", Wanted(True, True)),
        ("opencr", "goal", Wanted(False, False)),
    ],
)
def test_the_settings_say_who_drives(driver: str, mode: str, wanted: Wanted) -> None:
    settings = [{"key": "wheels.driver", "value": driver}, {"key": "wheels.ros_mode", "value": mode}]
    assert wanted_by(settings) == wanted


def test_arguments_of_both_kinds_are_understood() -> None:
    first = make_parser().parse_args(["ros", "--name", "Rob", "heard:=ears", "_publish_tf:=false"])
    assert first.remap == ["heard:=ears", "_publish_tf:=false"]
    second = make_parser().parse_args(
        ["ros", "--ros", "2", "--ros-args", "-r", "__ns:=/rob", "-p", "publish_tf:=false"]
    )
    assert second.ros_args == ["-r", "__ns:=/rob", "-p", "publish_tf:=false"]


def test_other_commands_leave_the_wheels_to_ros(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = tmp_path / "hvcpd.yaml"
    settings.write_text("name: Rob\nwheels: {driver: ros}\n")
    assert main(["drive", "forward", "1", "--config", str(settings)]) == EX_USER
    assert "hvcpctl stop" in capsys.readouterr().err
    assert main(["doctor", "--only", "wheels", "--config", str(settings)]) == EX_OK
    assert "ROS has them" in capsys.readouterr().out


def test_what_is_no_remapping_is_bad_input() -> None:
    options = argparse.Namespace(remap=["heard"], ros_args=None, ros="1")
    with pytest.raises(ConfigError, match="heard"):
        ros.run(options)


def test_it_waits_until_there_is_a_master(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answers: list[OSError | int] = [ConnectionRefusedError(111, "refused"), 5]

    def ask(_: str) -> int:
        answer = answers.pop(0)
        if isinstance(answer, OSError):
            raise answer
        return answer

    wait_for_master(tmp_path / "nobody.sock", True, ask)
    assert answers == []
    assert capsys.readouterr().err.count("waiting for a ROS master") == 1


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_an_interrupt_that_ros_swallows_ends_the_bridge_nevertheless(number: signal.Signals) -> None:
    before = {each: signal.getsignal(each) for each in (signal.SIGTERM, signal.SIGINT)}
    is_interrupted = obey_signals()
    try:
        assert not is_interrupted()
        with contextlib.suppress(KeyboardInterrupt):  # as a bare `except` of rospy's
            signal.raise_signal(number)
        assert is_interrupted()
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
