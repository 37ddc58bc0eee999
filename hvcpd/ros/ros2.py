"""Which way to ROS 2 there is: rclpy, or else Cyclone DDS."""

from __future__ import annotations

from importlib.util import find_spec

from hvcpd.errors import ConfigError, how_to_install
from hvcpd.ros.port import Report, RosPort, Wanted


def make_ros2_port(wanted: Wanted, report: Report) -> RosPort:
    """A node, or the topics of one. Raises ConfigError if there is neither rclpy nor cyclonedds."""
    if find_spec("rclpy") is not None:
        from hvcpd.ros.ros2_rclpy import RclpyPort

        return RclpyPort(wanted, report)
    if find_spec("cyclonedds") is not None:
        from hvcpd.ros.ros2_dds import DdsPort

        return DdsPort(wanted, report)
    raise ConfigError(f"no ROS 2 is here: source its setup.bash, or {how_to_install('cyclonedds')}")
