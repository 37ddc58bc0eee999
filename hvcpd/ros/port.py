"""The interface of a ROS for the bridge; `ros1.py` and `ros2.py` implement it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from hvcpd.ports import PlaceGoal
from hvcpd.ros.bridge import Bridge
from hvcpd.ros.messages import Message
from hvcpd.ros.parameters import Parameters
from hvcpd.ros.skills import Act, Leave, RosAction, values_of
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


@dataclass(frozen=True)
class Wanted:
    """The requirements of the daemon's settings and the command line for the port."""

    ros_drives: bool = False
    takes_goals: bool = False
    arguments: Sequence[str] = ()
    """Of ROS: remappings and parameters."""
    actions: Mapping[str, RosAction] = field(default_factory=dict)
    """The actions that perform the robot's skills."""


class RosPort(Protocol):
    """A node of ROS."""

    @property
    def parameters(self) -> Parameters: ...

    @property
    def fault(self) -> str | None:
        """Why this ROS has ended, so that the node must be made again; None: it works."""

    @property
    def dismissed(self) -> str | None:
        """Why ROS has ended the node, which is then not created again. None: it has not."""

    def stamp_s(self) -> float:
        """ROS's time."""

    def publish(self, topic: Topic, message: Message) -> None: ...

    def go(self, goal: PlaceGoal, now_s: float) -> None: ...

    def cancel(self, number: int) -> None: ...

    def act(self, goal: Act, now_s: float) -> None: ...

    def leave(self, goal: Leave) -> None: ...

    def log(self, text: str) -> None: ...

    def tick(self, now_s: float) -> None: ...

    def close(self) -> None: ...
