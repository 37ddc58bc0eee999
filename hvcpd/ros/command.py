"""`hvcpctl ros`: the bridge as a process. Which ROS, which daemon, and what happens when either ends."""

from __future__ import annotations

import os
import select
import signal
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

from hvcpd.config.command_line import print_error
from hvcpd.config.skill_settings import RosSettings
from hvcpd.errors import DEBIAN_FOLDER, ConfigError, NotDoneError, NotRunningError
from hvcpd.ros.bridge import Bridge
from hvcpd.ros.link import DaemonLink
from hvcpd.ros.master import master_pid, master_uri
from hvcpd.ros.port import Report, RosPort, Wanted
from hvcpd.ros.ros1 import find_rospy
from hvcpd.ros.session import Inbox, Session
from hvcpd.ros.skills import Skills

Kind = Literal["ros1", "ros2"]
WAIT_S = 0.5
"""Between two looks for a master."""
TELL_S = 1.0
"""Interval of the messages to the daemon that there is no base."""


def see_sourced(own: str = DEBIAN_FOLDER.rstrip("/")) -> None:
    """Have an isolated Python, as the Debian package's, find what a sourced setup.bash names in PYTHONPATH. It is built
    for the system's NumPy, so `own`, the package's libraries, comes behind both."""
    named = [each for each in os.environ.get("PYTHONPATH", "").split(os.pathsep) if each]
    if named and sys.flags.isolated:
        sys.path[:] = [*named, *(each for each in sys.path if each != own), own]


def choose_ros(wanted: str | None, environment: Mapping[str, str] = os.environ) -> Kind:
    """Which ROS to speak: the one asked for, that of the sourced setup.bash, or else what is installed.

    Raises ConfigError if there is none.
    """
    version = wanted or environment.get("ROS_VERSION")
    if version in ("1", "2"):
        return "ros1" if version == "1" else "ros2"
    if find_rospy():
        return "ros1"
    if find_spec("rclpy") is not None:
        return "ros2"
    raise ConfigError("no ROS is here: sudo apt install python3-rospy (ROS 1), or source the setup.bash of a ROS 2")


def wanted_by(settings: Sequence[Mapping[str, Any]], arguments: Sequence[str] = ()) -> Wanted:
    """What the settings in the reply to `config` want of a port; `arguments` are ROS's, of the command line."""
    values = {each["key"]: each["value"] for each in settings}
    drives = values.get("wheels.driver") == "ros"
    skills = {name: each["ros"] for name, each in values.get("skills", {}).items() if each.get("ros")}
    actions = {name: RosSettings(each["action"], _short(each["type"]), each["goal"]) for name, each in skills.items()}
    return Wanted(drives, drives and values.get("wheels.ros_mode") == "goal", arguments, actions)


def _short(ros_type: str) -> str:
    """ROS 2 writes "package/action/Name" for what ROS 1 calls "package/Name"."""
    return ros_type.replace("/action/", "/")


def run_bridge(kind: Kind, wanted: Wanted, path: Path) -> str | None:
    """Bridge until interrupted, or until this ROS is no more: then why. The daemon may come and go.

    Raises NotDoneError if ROS has ended the bridge: there is another one, or somebody wants none.
    """
    is_interrupted = obey_signals()
    with suppress(KeyboardInterrupt):
        if kind == "ros1":
            wait_for_master(path, wanted.ros_drives)
        inbox = Inbox()
        port = make_port(kind, wanted, inbox.put)
        bridge = Bridge(wanted.ros_drives, port.parameters, Skills(wanted.actions))
        reason = Session(bridge, port, inbox, path).run(is_interrupted)
        if port.dismissed is not None and reason == port.dismissed:
            raise NotDoneError(reason)
        return reason
    return None


def obey_signals() -> Callable[[], bool]:
    """Have SIGTERM and SIGINT raise KeyboardInterrupt, so that the base is told to stand. Returns whether one came, for
    the loop: what rospy does while a node begins may swallow the exception."""
    came = list[int]()

    def take(number: int, _frame: object) -> None:
        came.append(number)
        raise KeyboardInterrupt

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, take)
    return lambda: bool(came)


def make_port(kind: Kind, wanted: Wanted, report: Report) -> RosPort:
    """A node of that ROS. Raises ConfigError for wrong parameters or missing packages."""
    if kind == "ros1":
        from hvcpd.ros.ros1 import Ros1Port

        return Ros1Port(wanted, report)
    if find_spec("rclpy") is None:
        raise ConfigError(f"no ROS 2 for Python 3.{sys.version_info.minor} is here: source its setup.bash")
    from hvcpd.ros.ros2 import RclpyPort

    return RclpyPort(wanted, report)


def ros2_words(remaps: Iterable[str], ros_args: Sequence[str]) -> list[str]:
    """One command line as ROS 2 has it, from remappings as ROS 1 has them (`_name:=` sets a parameter) and its own."""
    words = []
    for each in remaps:
        is_parameter = each.startswith("_") and not each.startswith("__")
        words += ["-p", each[1:]] if is_parameter else ["-r", each]
    words += ros_args
    return ["--ros-args", *words] if words else []


def wait_for_master(path: Path, ros_drives: bool, ask: Callable[[str], int] = master_pid) -> None:
    """Return when a ROS 1 master answers; meanwhile report to the daemon why there is no base."""
    uri, logged = master_uri(), False
    while True:
        try:
            ask(uri)
        except OSError as error:
            if not logged:
                print_error("hvcpctl", f"waiting for a ROS master at {uri} ({error.strerror or error})")
                logged = True
        else:
            return
        if ros_drives:
            with suppress(NotRunningError):
                link = DaemonLink(path)
                link.ask(1, "base", {"fault": f"no ROS master at {uri}"})
                link.close()
        select.select([], [], [], WAIT_S)


def start_again() -> None:
    """Start the same command again in place of this process: a rospy node cannot be made twice in one process."""
    sys.stdout.flush()
    sys.stderr.flush()
    os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
