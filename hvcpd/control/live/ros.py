"""`hvcpctl ros`: bridge a running robot to ROS, until interrupted."""

from __future__ import annotations

import argparse
from contextlib import closing

from hvcpd.control.live.daemon_client import find_daemon
from hvcpd.control.output import print_note
from hvcpd.errors import ConfigError
from hvcpd.ros.command import choose_ros, ros2_words, run_bridge, see_sourced, start_again, wanted_by


def run(options: argparse.Namespace) -> None:
    """Find the daemon and its settings, then bridge; restart whenever ROS's master has ended."""
    for each in options.remap:
        if ":=" not in each:
            raise ConfigError(f"{each!r} is not a remapping; write name:=other, _parameter:=value, or --ros-args …")
    see_sourced()
    kind = choose_ros(options.ros)
    with closing(find_daemon(options)) as daemon:
        settings, path = daemon.ask("config")["settings"], daemon.path
    ros_args = options.ros_args or []
    if kind == "ros1" and ros_args:
        raise ConfigError("--ros-args are ROS 2's; for ROS 1 write name:=other or _parameter:=value")
    arguments = options.remap if kind == "ros1" else ros2_words(options.remap, ros_args)
    wanted = wanted_by(settings, arguments)
    reason = run_bridge(kind, wanted, path)
    if reason is not None:
        stands = "the robot stands, and " if wanted.ros_drives else ""
        print_note(f"{reason}; {stands}the bridge restarts")
        start_again()
