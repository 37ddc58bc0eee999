"""Command lines of ROS 2 as they are understood without rclpy."""

from __future__ import annotations

from pathlib import Path

import pytest

from hvcpd.errors import ConfigError
from hvcpd.ros.ros_arguments import parse_ros_arguments, ros2_words


def test_names_and_parameters() -> None:
    words = "--ros-args -r __ns:=/lab/rob -r __node:=voice -r heard:=ears -r /tf:=/rob/tf -p publish_tf:=false --"
    found = parse_ros_arguments([*words.split(), "-p", "base_frame:=base_footprint"], "hvcpd")
    assert (found.node, found.namespace) == ("voice", "/lab/rob")
    assert found.resolve("heard") == "/lab/rob/ears"
    assert found.resolve("heard/json") == "/lab/rob/heard/json"
    assert found.resolve("/tf") == "/rob/tf"
    assert found.resolve("/diagnostics") == "/diagnostics"
    assert found.resolve("~/x") == "/lab/rob/voice/x"
    assert found.parameters == {"publish_tf": False, "base_frame": "base_footprint"}


def test_without_any_names_are_global() -> None:
    assert parse_ros_arguments([], "hvcpd").resolve("heard") == "/heard"


def test_a_file_of_parameters_counts_for_this_node_and_for_all(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(
        "/**: {ros__parameters: {odom_frame: o, use_sim_time: false}}\n"
        "hvcpd: {ros__parameters: {base_frame: b}}\nother: {ros__parameters: {map_frame: m}}\n"
    )
    found = parse_ros_arguments(["--ros-args", "--params-file", str(file), "-p", "base_frame:=c"], "hvcpd")
    assert found.parameters == {"odom_frame": "o", "base_frame": "c"}


@pytest.mark.parametrize(
    "words", [["--enable-stdout-logs"], ["--log-config-file", "x"], ["-e", "/x"], ["-p", "use_sim_time:=true"]]
)
def test_what_every_node_may_be_given_is_no_fault(words: list[str]) -> None:
    assert parse_ros_arguments(["--ros-args", *words], "hvcpd").parameters == {}


@pytest.mark.parametrize("words", [["-r"], ["-r", "heard"], ["--remap", ":=x"], ["heard:=x"], ["-p", "x:={"]])
def test_what_cannot_be_understood_is_told(words: list[str]) -> None:
    with pytest.raises(ConfigError, match="--ros-args"):
        parse_ros_arguments(["--ros-args", *words], "hvcpd")


def test_ros_1s_way_of_writing_is_taken_for_ros_2_too() -> None:
    words = ros2_words(["heard:=ears", "__ns:=/rob", "_publish_tf:=false"], ["-p", "odom_frame:=o"])
    found = parse_ros_arguments(words, "hvcpd")
    assert found.resolve("heard") == "/rob/ears"
    assert found.parameters == {"publish_tf": False, "odom_frame": "o"}
    assert ros2_words([], []) == []
