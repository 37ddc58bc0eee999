"""ROS 2 without ROS 2: Cyclone DDS speaks the types that ROS 2 nodes have on the wire.

`ros2 topic` sees and hears it; `ros2 node` and `ros2 param` do not, for it announces no node. Goals need rclpy.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Mapping
from importlib import import_module
from typing import Any

from hvcpd.errors import ConfigError
from hvcpd.ports import PlaceGoal
from hvcpd.ros import topics
from hvcpd.ros.convert import from_ros
from hvcpd.ros.dds_types import dds_class, to_dds
from hvcpd.ros.messages import Message
from hvcpd.ros.parameters import Parameters, parameters_from
from hvcpd.ros.port import NODE, QUEUE, Report, Wanted
from hvcpd.ros.ros_arguments import parse_ros_arguments
from hvcpd.ros.skills import Act, Leave
from hvcpd.ros.topics import Topic

BLOCKING_S = 0.1
"""Longest wait of a reliable writer for a reader that does not keep up."""
COMMON = "<Compatibility><IgnoreTypeInformation>1.1,1.15,1.16</IgnoreTypeInformation></Compatibility>"
"""ROS 2 nodes match by the types' names. Some makers' DDS also tells how types are built, not as Cyclone's Python has
it, and would not match: RTI Connext, Fast DDS and Cyclone, by their vendor numbers (OMG, DDSI-RTPS)."""
LOCAL = (
    "<General><Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>119</MaxAutoParticipantIndex><Peers><Peer address='localhost'/></Peers></Discovery>"
)
"""Only this computer, found by asking each possible port; as rmw_cyclonedds does for ROS_LOCALHOST_ONLY."""


def domain_of(environment: Mapping[str, str] = os.environ) -> int:
    """ROS_DOMAIN_ID. Raises ConfigError if it is none."""
    text = environment.get("ROS_DOMAIN_ID") or "0"
    if not text.isdecimal() or int(text) > 232:
        raise ConfigError(f"ROS_DOMAIN_ID is {text!r}; a domain is a number from 0 to 232")
    return int(text)


def is_local(environment: Mapping[str, str] = os.environ) -> bool:
    """Whether ROS is to keep to this computer."""
    wide = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper()
    return wide in ("LOCALHOST", "OFF") or environment.get("ROS_LOCALHOST_ONLY") == "1"


def configuration(environment: Mapping[str, str] = os.environ) -> str:
    """Cyclone's configuration: the user's own (CYCLONEDDS_URI), and over it what ROS's variables ask for."""
    own = environment.get("CYCLONEDDS_URI", "")
    ours = f"<CycloneDDS><Domain>{COMMON}{LOCAL if is_local(environment) else ''}</Domain></CycloneDDS>"
    return f"{own},{ours}" if own else ours


class DdsPort:
    """The topics of a node. Raises ConfigError for wrong parameters, and for goals."""

    fault: str | None = None
    dismissed: str | None = None

    def __init__(self, wanted: Wanted, report: Report, environment: Mapping[str, str] = os.environ) -> None:
        source = "source the setup.bash of a ROS 2 with hvcpd in its Python"
        if wanted.takes_goals:
            raise ConfigError(f"goals of Nav2 (wheels.ros_mode: goal) need rclpy: {source}, or set ros_mode to cmd_vel")
        if wanted.actions:
            named = ", ".join(wanted.actions)
            raise ConfigError(
                f"skills by actions of ROS 2 ({named}) need rclpy: {source}, or take them out of `skills`"
            )
        self._names = parse_ros_arguments(wanted.arguments, NODE)
        self.parameters: Parameters = parameters_from(self._names.parameters)
        self._report = report
        core, self._pub, self._sub, self._topic = (
            import_module(f"cyclonedds.{part}") for part in ("core", "pub", "sub", "topic")
        )
        domain = domain_of(environment)
        domains: Any = import_module("cyclonedds.domain")
        self._core: Any = core
        try:
            self._domain: Any = domains.Domain(domain, configuration(environment))
            self._participant: Any = domains.DomainParticipant(domain)
        except core.DDSException as error:
            raise ConfigError(f"Cyclone DDS does not start ({error}); is CYCLONEDDS_URI right?") from None
        self._writers = {topic: self._writer(topic) for topic in topics.published(wanted.ros_drives)}
        self._readers = {topic: self._reader(topic) for topic in topics.subscribed(wanted.ros_drives)}

    def stamp_s(self) -> float:
        """The system's clock, which is ROS 2's unless time is simulated."""
        return time.time()

    def publish(self, topic: Topic, message: Message) -> None:
        """Have subscribers told; one that does not keep up misses it."""
        try:
            self._writers[topic].write(to_dds(message))
        except self._core.DDSException as error:
            self.log(f"{topic.name}: {error}")

    def go(self, goal: PlaceGoal, now_s: float) -> None:
        """Never asked for: see the constructor."""

    def cancel(self, number: int) -> None:
        """Never asked for."""

    def act(self, goal: Act, now_s: float) -> None:
        """Never asked for."""

    def leave(self, goal: Leave) -> None:
        """Never asked for."""

    def log(self, text: str) -> None:
        """On the terminal."""
        sys.stderr.write(f"hvcpctl: {text}\n")

    def tick(self, now_s: float) -> None:
        """Take what has come."""
        for topic, reader in self._readers.items():
            for sample in reader.take(N=QUEUE):
                if sample.sample_info.valid_data:
                    self._take(topic, from_ros(sample, topic.type), now_s)

    def close(self) -> None:
        """Leave the domain."""
        self._writers.clear()
        self._readers.clear()
        self._participant = self._domain = None

    def _take(self, topic: Topic, message: Message, _now_s: float) -> None:
        self._report(lambda bridge, now_s: bridge.from_ros(topic, message, now_s))

    def _writer(self, topic: Topic) -> Any:
        return self._pub.DataWriter(self._participant, self._dds_topic(topic), qos=self._qos(topic.latched))

    def _reader(self, topic: Topic) -> Any:
        return self._sub.DataReader(self._participant, self._dds_topic(topic), qos=self._qos(topic.latched))

    def _dds_topic(self, topic: Topic) -> Any:
        name = self._names.resolve(topic.name)
        try:
            return self._topic.Topic(self._participant, f"rt{name}", dds_class(topic.type))
        except self._core.DDSException:
            raise ConfigError(f"{topic.name}: {name!r} is not the name of a topic") from None

    def _qos(self, latched: bool) -> Any:
        qos: Any = import_module("cyclonedds.qos")
        policy: Any = qos.Policy
        return qos.Qos(
            policy.Reliability.Reliable(round(BLOCKING_S * 1e9)),
            policy.Durability.TransientLocal if latched else policy.Durability.Volatile,
            policy.History.KeepLast(1 if latched else QUEUE),
            policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
        )
