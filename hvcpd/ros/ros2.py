"""ROS 2 by rclpy: a thin adapter. rclpy belongs to a ROS 2, whose setup.bash must be sourced, and to its Python."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any

from hvcpd.errors import ConfigError
from hvcpd.ros import topics
from hvcpd.ros.action_rclpy import RclpyAction
from hvcpd.ros.convert import OWN, Dialect, ros_class, to_ros
from hvcpd.ros.messages import Message, Twist
from hvcpd.ros.parameters import NAMES, Parameters, parameters_from
from hvcpd.ros.port import NODE, QUEUE, Listener, Report, RosPort, Wanted, goal_listener, skill_listener
from hvcpd.ros.topics import Topic

JOIN_S = 2.0
"""For the thread that serves callbacks to end."""
SPIN_S = 0.1
"""Interval at which the thread checks whether it is to end."""


class RclpyPort(RosPort):
    """A managed (lifecycle) node, active from the start unless its parameter `autostart` is false. While it is inactive
    the base stands, and nothing passes but a stop.

    Raises ConfigError for wrong parameters or missing packages.
    """

    _goal_field = "pose"

    def __init__(self, wanted: Wanted, report: Report) -> None:
        super().__init__(report)
        self._rclpy: Any = import_module("rclpy")
        time: Any = ros_class("builtin_interfaces/Time")
        self._dialect = Dialect(time=lambda sec, nanosec: time(sec=sec, nanosec=nanosec), byte=lambda n: bytes([n]))
        signals: Any = import_module("rclpy.signals")
        try:
            self._rclpy.init(args=[NODE, *wanted.arguments], signal_handler_options=signals.SignalHandlerOptions.NO)
        except RuntimeError as error:  # RCLError, UnknownROSArgsError
            raise ConfigError(f"ROS accepts no node with {' '.join(wanted.arguments)!r}: {error}") from None
        self._wanted = wanted
        self.parameters = Parameters()
        self._problem = ""
        self._publishers: dict[Topic, Any] = {}
        self._subscriptions: list[Any] = []
        self._action_clients: list[Any] = []
        self._publishing = threading.Lock()
        self._node: Any = self._make_node()
        try:
            self._start()
        except ConfigError:
            self._rclpy.shutdown()
            raise
        executors: Any = import_module("rclpy.executors")
        self._executor = executors.SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="ros2", daemon=True)
        self._thread.start()

    def _make_node(self) -> Any:
        lifecycle: Any = import_module("rclpy.lifecycle")
        steps = {
            "on_configure": self._configure,
            "on_activate": self._activate,
            "on_deactivate": self._deactivate,
            "on_cleanup": self._clean_up,
            "on_shutdown": self._dismiss,
        }
        result = lifecycle.TransitionCallbackReturn

        def transition(step: Callable[[], None]) -> Callable[[Any, Any], Any]:
            def carried_out(node: Any, _state: Any) -> Any:
                try:
                    step()
                except Exception as error:  # rclpy would keep it to itself
                    self._problem = str(error)
                    node.get_logger().error(self._problem)
                    return result.FAILURE
                return result.SUCCESS

            return carried_out

        methods = {name: transition(step) for name, step in steps.items()}
        return type("BridgeNode", (lifecycle.LifecycleNode,), methods)(NODE)

    def _start(self) -> None:
        """Declare the parameters; become active if that is wanted, else have the bridge wait. Raises ConfigError."""
        exceptions: Any = import_module("rclpy.exceptions")
        try:
            for name in NAMES:
                self._node.declare_parameter(name, getattr(Parameters(), name))
            at_once = self._node.declare_parameter("autostart", True).value
        except exceptions.InvalidParameterTypeException as error:
            raise ConfigError(str(error)) from None
        if not at_once:
            self._report(lambda bridge, now_s: bridge.deactivate(now_s))
            return
        done = import_module("rclpy.lifecycle").TransitionCallbackReturn.SUCCESS
        if self._node.trigger_configure() != done:
            raise ConfigError(self._problem or "ROS could not configure the node; its log says why")
        self._node.trigger_activate()

    def _configure(self) -> None:
        self._problem = ""
        self.parameters = parameters_from({name: self._node.get_parameter(name).value for name in NAMES})
        wanted, skipped = self._wanted, {topics.TF} if not self.parameters.publish_tf else set()
        try:
            for topic in topics.published(wanted.ros_drives):
                if topic not in skipped:
                    self._publish_on(topic)
            for topic in topics.subscribed(wanted.ros_drives):
                self._subscribe(topic)
            if wanted.takes_goals:
                action = self.parameters.action or "navigate_to_pose"
                listener = goal_listener(self._report)
                self._navigation = self._make_client(action, "nav2_msgs/NavigateToPose", "Nav2", listener)
            self._actions = {
                skill: self._make_client(each.action, each.type, f"what does {skill!r}", skill_listener(self._report))
                for skill, each in wanted.actions.items()
            }
        except Exception:  # whatever it is, no half of a node is left behind
            self._clean_up()
            raise

    def _activate(self) -> None:
        parameters = self.parameters
        self._report(lambda bridge, now_s: bridge.activate(parameters, now_s))

    def _deactivate(self) -> None:
        if topics.CMD_VEL in self._publishers:  # without waiting for the bridge's thread
            self.publish(topics.CMD_VEL, Twist())
        self._report(lambda bridge, now_s: bridge.deactivate(now_s))

    def _clean_up(self) -> None:
        with self._publishing:
            publishers, self._publishers = self._publishers, {}
        for each in publishers.values():
            self._node.destroy_publisher(each)
        for each in self._subscriptions:
            self._node.destroy_subscription(each)
        for each in self._action_clients:
            each.destroy()
        self._subscriptions.clear()
        self._action_clients.clear()
        self._navigation, self._actions = None, {}

    def _dismiss(self) -> None:
        self._deactivate()
        self.dismissed = "ROS has shut the bridge down"

    @property
    def fault(self) -> str | None:
        """Why this node is no more."""
        return self.dismissed or (None if self._rclpy.ok() else "the node was told to end")

    def stamp_s(self) -> float:
        """ROS's time, s."""
        return float(self._node.get_clock().now().nanoseconds) * 1e-9

    def publish(self, topic: Topic, message: Message) -> None:
        """Have subscribers told; of a topic that is not configured there are none."""
        with self._publishing:
            if self._rclpy.ok() and topic in self._publishers:
                self._publishers[topic].publish(to_ros(message, self._dialect))

    def log(self, text: str) -> None:
        """By rosout, and on the terminal."""
        self._node.get_logger().warning(text)

    def close(self) -> None:
        """End the node."""
        self._over.set()
        self._thread.join(JOIN_S)
        self._executor.shutdown(timeout_sec=JOIN_S)
        self._node.destroy_node()
        self._rclpy.try_shutdown()

    def _serve(self) -> None:
        while self._rclpy.ok() and not self._over.is_set():
            self._executor.spin_once(timeout_sec=SPIN_S)

    def _qos(self, topic: Topic) -> Any:
        qos: Any = import_module("rclpy.qos")
        durability = qos.DurabilityPolicy.TRANSIENT_LOCAL if topic.latched else qos.DurabilityPolicy.VOLATILE
        return qos.QoSProfile(depth=1 if topic.latched else QUEUE, durability=durability)

    def _publish_on(self, topic: Topic) -> None:
        try:
            kind = class_of(topic.type.ROS_TYPE)
        except ConfigError:
            if topic.type.ROS_TYPE not in OWN:
                raise
            self.log(f"{topic.name} is left out: build release/ros/hvcpd_msgs with colcon, and source its setup.bash")
            return
        self._publishers[topic] = self._node.create_publisher(kind, topic.name, self._qos(topic))

    def _subscribe(self, topic: Topic) -> None:
        kind, taken = class_of(topic.type.ROS_TYPE), partial(self._take, topic)
        self._subscriptions.append(self._node.create_subscription(kind, topic.name, taken, self._qos(topic)))

    def _make_client(self, name: str, ros_type: str, whose: str, listener: Listener) -> RclpyAction:
        package, kind_name = ros_type.split("/")
        try:
            kind: Any = getattr(import_module(f"{package}.action"), kind_name)
        except (ImportError, AttributeError):
            known = package.replace("_", "-")
            raise ConfigError(
                f"the action {ros_type} is not installed: `sudo apt install ros-$ROS_DISTRO-{known}`"
            ) from None
        action: Any = import_module("rclpy.action")
        self._action_clients.append(action.ActionClient(self._node, kind, name))
        return RclpyAction(name, self._action_clients[-1], kind.Goal, listener, whose, self._in_turn)

    def _in_turn(self, happening: Callable[[], None]) -> None:
        self._report(lambda _, __: happening())


def class_of(ros_type: str) -> Any:
    """The class of a message type. Raises ConfigError if its package is not installed."""
    try:
        return ros_class(ros_type)
    except ImportError:
        package = ros_type.split("/")[0].replace("_", "-")
        raise ConfigError(
            f"the messages of {package} are not installed: `sudo apt install ros-$ROS_DISTRO-{package}`"
            + (", or set the parameter publish_tf to false" if ros_type.startswith("tf2") else "")
        ) from None
