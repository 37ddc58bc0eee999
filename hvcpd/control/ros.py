"""`hvcpctl ros`: bridge a running robot to ROS, until interrupted."""

from __future__ import annotations

import argparse
import sys
from contextlib import closing

from hvcpd.control.daemon_client import find_daemon
from hvcpd.errors import EX_OK, ConfigError
from hvcpd.ros.command import base_of, choose_ros, run_bridge, start_again


def run(options: argparse.Namespace) -> int:
    """Find the daemon and its settings, then bridge; begin anew whenever ROS's master has ended."""
    arguments = [*options.remap, *(["--ros-args", *options.ros_args] if options.ros_args else [])]
    for each in options.remap:
        if ":=" not in each:
            raise ConfigError(f"{each!r} is no remapping; write name:=other, _parameter:=value, or --ros-args …")
    kind = choose_ros(options.ros)
    with closing(find_daemon(options)) as daemon:
        base = base_of(daemon.ask("config")["settings"])
        path = daemon.path
    reason = run_bridge(kind, base, path, arguments)
    if reason is not None:
        sys.stderr.write(f"hvcpctl: {reason}; the robot stands, and the bridge begins anew\n")
        start_again()
    return EX_OK
