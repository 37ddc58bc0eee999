"""ROS 1 by rospy: a thin adapter.

rospy is pure Python and comes with the distribution's packages, not from PyPI. Where hvcpd's environment does not see
it, the folder of Debian's Python packages is added behind all others, for this process only.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hvcpd.errors import ConfigError
from hvcpd.ros import topics
from hvcpd.ros.action_topics import Link, TopicAction
from hvcpd.ros.convert import Dialect, ros_class, to_ros
from hvcpd.ros.master import MasterWatch, master_uri
from hvcpd.ros.messages import Message, Twist
from hvcpd.ros.parameters import Parameters, parameters_from
from hvcpd.ros.port import NODE, QUEUE, Listener, Report, RosPort, Wanted, goal_listener, skill_listener
from hvcpd.ros.topics import Topic

DEBIAN_PACKAGES = Path("/usr/lib/python3/dist-packages")
"""Debian's Python policy, section 3.1: of whichever Python 3 is the distribution's."""
DEBIAN_PYTHON = Path("/usr/bin/python3")
LAST_WORDS_S = 0.05
"""For rospy's own threads to send what was published last, before it closes all connections."""
MISSING = (
    "rospy is not installed: on Debian `sudo apt install python3-rospy python3-std-msgs python3-geometry-msgs "
    "python3-nav-msgs python3-diagnostic-msgs python3-tf2-msgs`, elsewhere source ROS's setup.bash first"
)


def find_rospy(path: list[str] = sys.path, packages: Path = DEBIAN_PACKAGES) -> bool:
    """Whether rospy can be imported, with Debian's packages on the path if only so. They are for one version of Python;
    that version must be ours."""
    if find_spec("rospy") is not None:
        return True
    is_ours = DEBIAN_PYTHON.exists() and DEBIAN_PYTHON.resolve().name == f"python3.{sys.version_info.minor}"
    if not is_ours or not (packages / "rospy").is_dir():
        return False
    path.append(str(packages))
    return find_spec("rospy") is not None


class Ros1Port(RosPort):
    """A node of the master that ROS_MASTER_URI names. Raises ConfigError for wrong parameters or missing packages."""

    _goal_field = "target_pose"

    def __init__(self, wanted: Wanted, report: Report) -> None:
        super().__init__(report)
        if not find_rospy():
            raise ConfigError(MISSING)
        self._rospy: Any = import_module("rospy")
        genpy: Any = import_module("genpy")
        self._dialect = Dialect(time=genpy.Time, byte=int)
        self._watch = MasterWatch(master_uri())
        self._is_ending = False
        argv = [NODE, *wanted.arguments]
        os.environ.setdefault("ROSCONSOLE_FORMAT", "[${severity}] ${message}")
        try:
            self._rospy.init_node(NODE, argv=argv, disable_signals=True)
        except self._rospy.ROSInitException as error:
            raise ConfigError(f"ROS accepts no node with {' '.join(wanted.arguments)!r}: {error}") from None
        self.parameters = read_parameters(self._rospy, wanted.arguments)
        self._publishers = {
            topic: self._publisher(topic.name, topic.type.ROS_TYPE, topic.latched)
            for topic in topics.published(wanted.ros_drives)
        }
        for topic in topics.subscribed(wanted.ros_drives):
            self._subscribe(topic)
        if wanted.takes_goals:
            action = self.parameters.action or "move_base"
            listener = goal_listener(report)
            self._navigation = self._make_client(action, "move_base_msgs/MoveBase", "move_base", listener)
        self._actions = {
            skill: self._make_client(each.action, each.type, f"what does {skill!r}", skill_listener(report))
            for skill, each in wanted.actions.items()
        }
        self._rospy.on_shutdown(self._say_last_words)
        core: Any = import_module("rospy.core")
        core.add_preshutdown_hook(self._dismiss)
        self._watch.start()

    @property
    def fault(self) -> str | None:
        """Why the master is no more, or the node has been told to end."""
        return self._watch.fault or self.dismissed

    def stamp_s(self) -> float:
        """ROS's time, s; 0 until a simulated clock has begun."""
        return float(self._rospy.get_time())

    def publish(self, topic: Topic, message: Message) -> None:
        """Have subscribers told; without a connection nobody is."""
        if not self._is_ending:
            self._send(topic, message)

    def log(self, text: str) -> None:
        """By rosout, and on the terminal."""
        self._rospy.logwarn(text)

    def close(self) -> None:
        """End the node; a master that has gone, or hangs, is not told, for that could take for ever."""
        self._watch.close()
        if self._watch.fault is None:
            self._rospy.signal_shutdown("the bridge ends")

    def _say_last_words(self) -> None:
        """In a thread of rospy's, which closes all connections next: the base must stand, whatever ends the node."""
        self._is_ending = True
        for client in self._clients():
            client.cancel_any()
        for _ in range(2):  # the loop's thread may be about to say something else
            if topics.CMD_VEL in self._publishers:
                self._send(topics.CMD_VEL, Twist())
            time.sleep(LAST_WORDS_S)

    def _dismiss(self, reason: str) -> None:
        """rospy tells why; the connections are closed by now."""
        why = reason.split("]: ")[-1].split("Reason: ")[-1].strip("[]")
        self.dismissed = f"ROS has ended the bridge: {why}"

    def _send(self, topic: Topic, message: Message) -> None:
        with suppress(self._rospy.ROSException):  # the node has ended
            self._publishers[topic].publish(to_ros(message, self._dialect))

    def _publisher(self, name: str, ros_type: str, latched: bool = False) -> Any:
        return self._rospy.Publisher(name, class_of(ros_type), queue_size=QUEUE, latch=latched, tcp_nodelay=True)

    def _subscribe(self, topic: Topic) -> None:
        kind = class_of(topic.type.ROS_TYPE)
        self._rospy.Subscriber(topic.name, kind, partial(self._take, topic), queue_size=QUEUE, tcp_nodelay=True)

    def _make_client(self, name: str, kind: str, whose: str, listener: Listener) -> TopicAction:
        goals = self._publisher(f"{name}/goal", f"{kind}ActionGoal")
        cancels = self._publisher(f"{name}/cancel", "actionlib_msgs/GoalID")
        ends = (goals, cancels)
        link = Link(goals.publish, cancels.publish, lambda: all(each.get_num_connections() > 0 for each in ends))
        client = TopicAction(name, kind, link, listener, self._dialect, whose)
        take: tuple[tuple[str, str, Callable[[Any, float], None]], ...] = (
            ("status", "actionlib_msgs/GoalStatusArray", client.take_status),
            ("feedback", f"{kind}ActionFeedback", client.take_feedback),
            ("result", f"{kind}ActionResult", client.take_result),
        )
        for suffix, message, taker in take:
            self._rospy.Subscriber(f"{name}/{suffix}", class_of(message), self._in_turn(taker), queue_size=QUEUE)
        return client

    def _in_turn(self, take: Callable[[Any, float], None]) -> Callable[[Any], None]:
        """A callback that has the loop's thread take the message."""
        return lambda message: self._report(lambda _, now_s: take(message, now_s))


def class_of(ros_type: str) -> Any:
    """The class of a message type. Raises ConfigError if its package is not installed."""
    try:
        return ros_class(ros_type)
    except ImportError:
        package = ros_type.split("/")[0]
        raise ConfigError(
            f"the messages of {package} are not installed: on Debian `sudo apt install "
            f"python3-{package.replace('_', '-')}`, with ROS Noetic `ros-noetic-{package.replace('_', '-')}`"
        ) from None


def read_parameters(rospy: Any, arguments: Sequence[str]) -> Parameters:
    """What ROS's master has for this node; of a command line with a fault nothing stays there."""
    node = rospy.get_name()
    given = rospy.get_param("~", {})
    if not isinstance(given, dict):
        raise ConfigError(f"the parameters of {node} are not names with values: {given!r}")
    try:
        return parameters_from(given)
    except ConfigError as error:
        ours = {each[1:].partition(":=")[0] for each in arguments if each.startswith("_")} & given.keys()
        for name in ours:
            rospy.delete_param(f"~{name}")
        if ours == given.keys():
            raise
        raise ConfigError(
            f"{error}\nROS's master keeps parameters from one start to the next; `rosparam delete {node}` forgets them"
        ) from None
