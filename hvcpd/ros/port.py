"""The interface of a ROS for the bridge; `ros1.py` and `ros2.py` implement it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from hvcpd.config.skill_settings import RosSettings
from hvcpd.ports import PlaceGoal
from hvcpd.ros.bridge import Bridge
from hvcpd.ros.convert import Dialect, from_ros, to_ros
from hvcpd.ros.messages import Header, Message, Point, Pose, PoseStamped, Time
from hvcpd.ros.parameters import Parameters
from hvcpd.ros.skills import Act, Leave, fill_message, values_of
from hvcpd.ros.topics import Topic

NODE = "hvcpd"
"""The node's name, if it is not given another one."""
QUEUE = 50
"""Messages that wait for a slow subscriber, of each topic."""

Happening = Callable[[Bridge, float], None]
"""Something that came from ROS, for the bridge to take at time `now_s` (monotonic)."""
Report = Callable[[Happening], None]
"""Hands it over; may be called from any thread."""


@dataclass(frozen=True)
class Listener:
    """Receives the progress of an action's goals, by number: feedback messages, from any thread, and the end with its
    reason ("" for success) and its result message (None if there is none)."""

    fed_back: Callable[[int, Any], None]
    ended: Callable[[int, str, Any], None]


def skill_listener(report: Report) -> Listener:
    """Hands the progress of skills' actions over to the bridge."""

    def fed_back(number: int, feedback: Any) -> None:
        values = values_of(feedback)
        report(lambda bridge, now_s: bridge.action_fed_back(number, values, now_s))

    def ended(number: int, reason: str, result: Any) -> None:
        values = values_of(result) if result is not None else {}
        report(lambda bridge, _: bridge.action_ended(number, reason or None, values))

    return Listener(fed_back, ended)


def goal_listener(report: Report) -> Listener:
    """Hands the progress of navigation's action over to the bridge."""

    def fed_back(number: int, feedback: Any) -> None:
        values = values_of(feedback)
        report(lambda bridge, _: bridge.goal_fed_back(number, values))

    def ended(number: int, reason: str, _result: Any) -> None:
        report(lambda bridge, _: bridge.goal_ended(number, not reason, reason))

    return Listener(fed_back, ended)


@dataclass(frozen=True)
class Wanted:
    """The requirements of the daemon's settings and the command line for the port."""

    ros_drives: bool = False
    takes_goals: bool = False
    arguments: Sequence[str] = ()
    """Of ROS: remappings and parameters."""
    actions: Mapping[str, RosSettings] = field(default_factory=dict)
    """The actions that perform the robot's skills."""


class RosPort(ABC):
    """A node of ROS, with the clients of the actions of navigation and of skills."""

    parameters: Parameters
    dismissed: str | None = None
    """Why ROS has ended the node, which is then not created again. None: it has not."""
    _dialect: Dialect
    _goal_field: str
    """Of a goal of navigation: its pose."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._navigation: Any = None
        self._actions: Mapping[str, Any] = {}
        """Those that perform skills, by the skill."""

    @property
    @abstractmethod
    def fault(self) -> str | None:
        """Why this ROS has ended, so that the node must be made again; None: it works."""

    @abstractmethod
    def stamp_s(self) -> float:
        """ROS's time, s; 0 until a simulated clock has begun."""

    @abstractmethod
    def publish(self, topic: Topic, message: Message) -> None:
        """Have subscribers told; where there is no connection, nobody is."""

    @abstractmethod
    def log(self, text: str) -> None:
        """By rosout, and on the terminal."""

    @abstractmethod
    def close(self) -> None:
        """End the node."""

    def go(self, goal: PlaceGoal, now_s: float) -> None:
        """Give a goal to navigation. The base may come to rest with any heading."""
        if self._navigation is not None:
            header = Header(Time.of(self.stamp_s()), self.parameters.map_frame)
            pose = to_ros(PoseStamped(header, Pose(Point(goal.x_m, goal.y_m))), self._dialect)
            fill = partial(fill_message, fields={self._goal_field: pose})
            self._navigation.ask(goal.number, fill, now_s, self.stamp_s())

    def cancel(self, number: int) -> None:
        """Withdraw it."""
        if self._navigation is not None:
            self._navigation.cancel(number)

    def act(self, goal: Act, now_s: float) -> None:
        """Give a goal to the server of a skill's action; one that its type does not have fails."""
        try:
            fill = partial(fill_message, fields=goal.fields)
            self._actions[goal.skill].ask(goal.number, fill, now_s, self.stamp_s())
        except ValueError as error:
            reason = str(error)
            self._report(lambda bridge, _: bridge.action_ended(goal.number, reason, {}))

    def leave(self, goal: Leave) -> None:
        """Withdraw it."""
        if goal.skill in self._actions:
            self._actions[goal.skill].cancel(goal.number)

    def tick(self, now_s: float) -> None:
        """Time passes."""
        for client in self._clients():
            client.tick(now_s)

    def _clients(self) -> list[Any]:
        return [*self._actions.values(), *([self._navigation] if self._navigation is not None else [])]

    def _take(self, topic: Topic, message: Any) -> None:
        """Hand a message of a topic over to the bridge."""
        plain = from_ros(message, topic.type)
        self._report(lambda bridge, now_s: bridge.from_ros(topic, plain, now_s))
