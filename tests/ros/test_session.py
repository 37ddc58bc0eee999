"""The loop between a daemon's socket and a ROS: real sockets, a scripted daemon, a ROS that keeps what it is told."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from hil_fakes.sound_server import wait_until
from hvcpd.errors import NotRunningError
from hvcpd.ports import PlaceGoal
from hvcpd.ros import topics
from hvcpd.ros.bridge import Bridge
from hvcpd.ros.link import DaemonLink
from hvcpd.ros.messages import Message, String, Twist, Vector3
from hvcpd.ros.parameters import Parameters
from hvcpd.ros.session import Inbox, Session
from hvcpd.ros.topics import Topic
from tests.ros.live import SocketDaemon, daemon_at

MOVING = {"event": "drive", "at_s": 1.0, "linear_m_s": 0.1, "angular_rad_s": 0.0, "stopped": False, "goal": None}
GOAL = MOVING | {"linear_m_s": 0.0, "goal": {"number": 1, "x_m": 1.0, "y_m": 2.0}}
WAIT_S = 20.0


@dataclass
class NotedPort:
    """A ROS that keeps what it is told; `on_change` may end it."""

    parameters: Parameters = field(default_factory=Parameters)
    fault: str | None = None
    dismissed: str | None = None
    published: list[tuple[Topic, Message]] = field(default_factory=list)
    went: list[PlaceGoal] = field(default_factory=list)
    cancelled: list[int] = field(default_factory=list)
    logged: list[str] = field(default_factory=list)
    closed: bool = False
    on_change: Callable[[], None] = lambda: None

    def stamp_s(self) -> float:
        return 1.0

    def publish(self, topic: Topic, message: Message) -> None:
        self.published.append((topic, message))
        self.on_change()

    def go(self, goal: PlaceGoal, now_s: float) -> None:
        self.went.append(goal)
        self.on_change()

    def cancel(self, number: int) -> None:
        self.cancelled.append(number)

    def log(self, text: str) -> None:
        self.logged.append(text)
        self.on_change()

    def tick(self, now_s: float) -> None:
        """Nothing to do."""

    def close(self) -> None:
        self.closed = True


@dataclass
class Scene:
    daemon: SocketDaemon
    port: NotedPort
    inbox: Inbox
    session: Session


@pytest.fixture
def scene(tmp_path: Path) -> Iterator[Scene]:
    path = tmp_path / "s.sock"
    port, inbox = NotedPort(), Inbox()
    session = Session(Bridge(True, port.parameters), port, inbox, path)
    with daemon_at(path, "goal") as daemon:
        yield Scene(daemon, port, inbox, session)


def velocities(port: NotedPort) -> list[Message]:
    return [message for topic, message in port.published if topic == topics.CMD_VEL]


def test_lines_of_the_daemon_reach_ros_and_the_base_stands_at_the_end(scene: Scene) -> None:
    scene.daemon.first = ["no JSON", [1], MOVING]
    goals = [GOAL]

    def drive_on() -> None:  # a velocity that is followed by another before it was due is not published
        if goals and Twist(Vector3(x=0.1)) in velocities(scene.port):
            scene.daemon.tell(goals.pop())

    scene.port.on_change = drive_on
    assert scene.session.run(lambda: bool(scene.port.went)) is None
    assert Twist(Vector3(x=0.1)) in velocities(scene.port)
    assert scene.port.went == [PlaceGoal(1, 1.0, 2.0)]
    assert velocities(scene.port)[-1] == Twist()
    assert scene.port.cancelled == [1]
    assert scene.port.closed
    wait_until(lambda: len(scene.daemon.asked) >= 3, WAIT_S, "the daemon has read what it was asked")
    assert [each["command"] for each in scene.daemon.asked][:3] == ["subscribe", "tasks", "status"]


def test_what_comes_from_other_threads_reaches_the_daemon(scene: Scene) -> None:
    scene.inbox.put(lambda bridge, now_s: bridge.from_ros(topics.SAY, String("hello"), now_s))
    over = threading.Event()

    def enough() -> bool:
        return bool(scene.daemon.arguments("say")) or over.is_set()

    timer = threading.Timer(WAIT_S, over.set)
    timer.start()
    scene.session.run(enough)
    timer.cancel()
    assert [each["text"] for each in scene.daemon.arguments("say")] == ["hello"]


def test_a_ros_that_ends_is_told_of_and_the_daemon_knows_why(scene: Scene) -> None:
    scene.daemon.first = [MOVING]

    def end() -> None:
        scene.port.fault = "no ROS master"

    scene.port.on_change = end
    assert scene.session.run() == "no ROS master"
    wait_until(lambda: bool(scene.daemon.arguments("base")), WAIT_S, "the daemon is told")
    assert [each["fault"] for each in scene.daemon.arguments("base")] == ["no ROS master"]
    assert velocities(scene.port)[-1] == Twist()


def test_a_daemon_that_ends_is_told_of_and_the_next_one_is_found(scene: Scene) -> None:
    scene.daemon.first = [MOVING]

    def hang_up() -> None:
        if scene.daemon.first == [MOVING] and velocities(scene.port):
            scene.daemon.first = [GOAL]
            scene.daemon.hang_up()

    scene.port.on_change = hang_up
    scene.session.run(lambda: bool(scene.port.went))
    assert len(scene.port.logged) == 1
    assert "trying again" in scene.port.logged[0]
    assert Twist() in velocities(scene.port)


def test_where_no_daemon_is_nobody_is_reached(tmp_path: Path) -> None:
    with pytest.raises(NotRunningError, match="start it with `hvcpd`"):
        DaemonLink(tmp_path / "nobody.sock")
    with pytest.raises(NotRunningError):
        DaemonLink(tmp_path / "nowhere" / "nobody.sock")
