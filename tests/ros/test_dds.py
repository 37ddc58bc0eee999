"""ROS 2's wire without ROS 2: bytes against an independent serialiser, and topics through real DDS on this computer."""

from __future__ import annotations

import dataclasses
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from hypothesis import given, settings

from hvcpd.errors import ConfigError
from hvcpd.ros import topics
from hvcpd.ros.bridge import Bridge
from hvcpd.ros.convert import from_ros
from hvcpd.ros.dds_types import dds_class, to_dds, type_name
from hvcpd.ros.messages import Bool, Message, Odometry, String, Time
from hvcpd.ros.port import Happening, Wanted
from hvcpd.ros.ros2_dds import DdsPort, domain_of, is_local
from tests.ros.samples import MESSAGES, messages

pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install 'hvcpd[ros2]'")
rosbags = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed: make setup-dev")

STORE = rosbags.get_typestore(rosbags.Stores.ROS2_HUMBLE)
WAIT_S = 20.0


def as_rosbags(value: Any) -> Any:
    """The same message in the independent serialiser's classes."""
    if isinstance(value, tuple) and value and isinstance(value[0], float):
        import numpy as np

        return np.array(value, np.float64)
    if isinstance(value, tuple):
        return [as_rosbags(each) for each in value]
    if not dataclasses.is_dataclass(value):
        return value
    kind = STORE.types[long_name(type(value))]
    names = [each.name for each in dataclasses.fields(value)]
    return kind(**{name: as_rosbags(getattr(value, name)) for name in names})


def long_name(plain: Any) -> str:
    package, name = plain.ROS_TYPE.split("/")
    return f"{package}/msg/{name}"


def their_bytes(message: Message) -> bytes:
    return bytes(STORE.serialize_cdr(as_rosbags(message), long_name(type(message))))


@pytest.mark.parametrize("kind", [*MESSAGES, Time], ids=lambda kind: kind.__name__)
def test_fields_are_those_of_ros(kind: Any) -> None:
    theirs = STORE.types[long_name(kind)]
    names = [each.name for each in dataclasses.fields(theirs) if not each.name.startswith("__")]
    assert [each.name for each in dataclasses.fields(kind)] == names


@settings(deadline=None)
@given(messages())
def test_bytes_are_those_of_another_implementation_and_come_back(message: Message) -> None:
    ours = to_dds(message).serialize()
    theirs = their_bytes(message)
    assert unpadded(ours) == unpadded(theirs)
    assert from_ros(dds_class(type(message)).deserialize(theirs), type(message)) == message


def unpadded(encoded: bytes) -> bytes:
    """Without what an encoder may add to a whole number of words: zeros, and their count in the header's options."""
    return encoded[:3] + encoded[4:].rstrip(b"\0")


def test_types_and_names_are_mangled_as_ros_2_does() -> None:
    assert type_name("std_msgs/String") == "std_msgs.msg.dds_.String_"
    assert dds_class(Odometry).__idl_typename__.replace(".", "::") == "nav_msgs::msg::dds_::Odometry_"


def test_the_environment_says_how_far_it_reaches() -> None:
    assert domain_of({}) == 0
    assert domain_of({"ROS_DOMAIN_ID": "42"}) == 42
    for wrong in ("233", "-1", "x"):
        with pytest.raises(ConfigError, match="0 to 232"):
            domain_of({"ROS_DOMAIN_ID": wrong})
    assert is_local({"ROS_LOCALHOST_ONLY": "1"})
    assert is_local({"ROS_AUTOMATIC_DISCOVERY_RANGE": "localhost"})
    assert not is_local({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"})


def test_goals_are_refused_before_anything_is_opened() -> None:
    with pytest.raises(ConfigError, match="rclpy"):
        DdsPort(Wanted(ros_drives=True, takes_goals=True), lambda _: None)


class Peer:
    """Another program of the domain: writes and reads topics with types of its own making."""

    def __init__(self, participant: Any) -> None:
        self._participant = participant

    def writer(self, name: str, plain: type[Message]) -> Any:
        from cyclonedds.pub import DataWriter
        from cyclonedds.topic import Topic

        return DataWriter(self._participant, Topic(self._participant, name, dds_class(plain)), qos=_reliable())

    def reader(self, name: str, plain: type[Message], latched: bool = False) -> Any:
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        return DataReader(self._participant, Topic(self._participant, name, dds_class(plain)), qos=_reliable(latched))


def _reliable(latched: bool = False) -> Any:
    from cyclonedds.core import Policy, Qos

    durability = Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile
    representation = Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False)
    return Qos(Policy.Reliability.Reliable(10**8), durability, Policy.History.KeepLast(5), representation)


def wait_until(condition: Callable[[], bool]) -> None:
    """Poll; DDS finds its peers within a tenth of a second."""
    pause = threading.Event()
    for _ in range(int(WAIT_S / 0.02)):
        if condition():
            return
        pause.wait(0.02)
    raise AssertionError("nothing came")


@contextmanager
def on_the_air(domain: int, arguments: tuple[str, ...] = ()) -> Iterator[tuple[DdsPort, Peer, list[Happening]]]:
    """A port that ROS drives through, and another program in its domain, on this computer only."""
    from cyclonedds.domain import DomainParticipant

    reported: list[Happening] = []
    environment = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    port = DdsPort(Wanted(ros_drives=True, arguments=arguments), reported.append, environment)
    try:
        yield port, Peer(DomainParticipant(domain)), reported
    finally:
        port.close()


def domain_for(test: int) -> int:
    """Another one for each test and process, so that tests side by side do not hear each other."""
    return 100 + (os.getpid() * 7 + test * 3) % 120


def test_topics_pass_both_ways_under_ros_names() -> None:
    with on_the_air(domain_for(1), ("--ros-args", "-r", "__ns:=/rob", "-r", "heard:=ears")) as (port, peer, reported):
        port.publish(topics.TASKS, String("[]"))
        heard = peer.reader("rt/rob/ears", String)
        board = peer.reader("rt/rob/tasks", String, latched=True)
        say, estop = peer.writer("rt/rob/say", String), peer.writer("rt/rob/estop", Bool)
        got: list[str] = []

        def hears() -> bool:
            port.publish(topics.HEARD, String("Hi all"))
            got.extend(sample.data for sample in heard.take(N=10))
            return bool(got)

        wait_until(hears)
        assert got[0] == "Hi all"
        boards: list[Any] = []
        wait_until(lambda: bool(boards.extend(board.take(N=10)) or boards))
        assert boards[0].data == "[]"

        def is_heard() -> bool:
            say.write(to_dds(String("hello")))
            estop.write(to_dds(Bool(True)))
            port.tick(0.0)
            return asked(port, reported) >= {"say", "stop"}

        wait_until(is_heard)


def asked(port: DdsPort, reported: list[Happening]) -> set[str]:
    """What a bridge asks the daemon after what was reported."""
    bridge = Bridge(True, port.parameters)
    for happening in reported:
        happening(bridge, 0.0)
    return {getattr(output, "command", "") for output in bridge.outputs()}


def test_a_name_that_is_none_and_a_wrong_configuration_are_told() -> None:
    with (
        pytest.raises(ConfigError, match="'/bad name' is not the name of a topic"),
        on_the_air(domain_for(4), ("-r", "heard:=bad name")),
    ):
        pass
    environment = {"ROS_DOMAIN_ID": str(domain_for(5)), "CYCLONEDDS_URI": "<bad"}
    with pytest.raises(ConfigError, match="is CYCLONEDDS_URI right"):
        DdsPort(Wanted(), lambda _: None, environment)


def test_two_domains_hear_nothing_of_each_other() -> None:
    with on_the_air(domain_for(2)) as (one, peer, _), on_the_air(domain_for(3)) as (other, _, _):
        reader = peer.reader("rt/heard", String)
        got: list[str] = []

        def hears() -> bool:
            other.publish(topics.HEARD, String("from elsewhere"))
            one.publish(topics.HEARD, String("from here"))
            got.extend(sample.data for sample in reader.take(N=10))
            return bool(got)

        wait_until(hears)
        assert set(got) == {"from here"}
