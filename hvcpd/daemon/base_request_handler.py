"""A base under ROS, seen from the daemon: reports of the bridge, and commands to it.

While there is no base the robot claims no task that drives and takes no order for one; what it gave up for that reason
it may try again when the base is back.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import structlog

from hvcpd.daemon.control_protocol import NUMBER, RefusalError
from hvcpd.daemon.wheel_service import MOVING_S, SLACK_S
from hvcpd.daemon.wiring import Wiring
from hvcpd.hardware.goals import GoalNavigator
from hvcpd.hardware.kinematics import Twist, twist_of
from hvcpd.hardware.ros_base import BaseReport, RosBase
from hvcpd.ports import STANDSTILL, Pose, WheelCommand
from hvcpd.reporting.events import Drive
from hvcpd.robot.robot import Robot

MAX_POSE_M = 1e6
"""Of odometry; beyond, it is no robot's in a room, and its float has no more millimetres to spare."""
MAX_SPEED = 100.0
"""Largest speed, m/s and rad/s, that is a measurement."""
MAX_REASON_LENGTH = 200
GONE_S = 2.0
"""Silence (sample clock) after which a base counts as gone; it stands long before that."""

ARGUMENTS: dict[str, tuple[type, ...]] = {
    "x_m": NUMBER,
    "y_m": NUMBER,
    "heading_rad": NUMBER,
    "linear_m_s": NUMBER,
    "angular_rad_s": NUMBER,
    "fault": (str,),
    "goal": (int,),
    "arrived": (bool,),
    "reason": (str,),
}
"""Arguments of the command `base`: odometry, or why there is none, or what became of a goal."""

_log = structlog.get_logger(__name__)


class BaseRequestHandler:
    """Passes odometry and commands between the ROS bridge and the robot; runs in the event loop."""

    def __init__(self, base: RosBase, navigator: GoalNavigator | None = None) -> None:
        self._base = base
        self._navigator = navigator
        self._there: bool | None = None
        self._seen_s = -math.inf
        self._given_up: frozenset[int] = frozenset()
        self._last: Drive | None = None

    def take(self, arguments: dict[str, Any]) -> None:
        """Handle a message of the bridge. Raises RefusalError if it is no odometry."""
        if "fault" in arguments:
            self._base.tell_fault(arguments["fault"][:MAX_REASON_LENGTH] or "the bridge has no base")
        elif "goal" in arguments:
            reason = arguments.get("reason", "")[:MAX_REASON_LENGTH]
            if self._navigator is not None:
                self._navigator.tell(arguments["goal"], arguments.get("arrived", False), reason)
            if reason:
                _log.info("goal", number=arguments["goal"], arrived=arguments.get("arrived", False), reason=reason)
        else:
            self._base.tell(_report(arguments))

    def drive(self, robot: Robot, wanted: WheelCommand) -> Drive | None:
        """The command to send to the bridge now, or None: a halt at once, others at a fixed rate."""
        there = self._base.fault is None
        goal = self._navigator.goal if self._navigator is not None and there else None
        twist = twist_of(wanted if there else STANDSTILL, robot.odometry.drive)
        stopped = robot.coordination.knowledge.latched
        new = Drive(robot.now, twist.linear_m_s, twist.angular_rad_s, stopped, goal)
        if self._last is not None and not _is_due(self._last, new):
            return None
        self._last = new
        return new

    def watch(self, robot: Robot, wiring: Wiring, lacking: frozenset[int] = frozenset()) -> None:
        """Exclude tasks that drive while there is no base, and always those for which skills are `lacking`."""
        if self._base.fault is None:
            self._seen_s = robot.now
        there = robot.now - self._seen_s < GONE_S
        if there is self._there:
            return
        c = robot.coordination
        mine = frozenset(e.number for e in c.board.entries() if c.role.name in e.failed_by)
        forgiven = mine - self._given_up if there else ()
        self._given_up = self._given_up if there else mine
        self._there = there
        c.reconfigure(robot.now, replace(c.role, unable=self.unable(wiring) | lacking), forgiven=forgiven)
        if there:
            _log.info("base found")
        else:
            _log.warning("no base", effect="it leaves tasks that drive to others")  # the wheels have told why

    def unable(self, wiring: Wiring) -> frozenset[int]:
        """The tasks that the robot lacks the means for at present."""
        return wiring.unable if self._there else wiring.unable | wiring.tasks.driving


def _is_due(last: Drive, new: Drive) -> bool:
    if (last.stopped, last.goal) != (new.stopped, new.goal):
        return True
    stands = new.linear_m_s == 0.0 and new.angular_rad_s == 0.0
    if stands and (last.linear_m_s, last.angular_rad_s) != (0.0, 0.0):
        return True
    return new.at_s - last.at_s >= MOVING_S - SLACK_S


def _report(arguments: dict[str, Any]) -> BaseReport:
    values = []
    for name, most in (
        ("x_m", MAX_POSE_M),
        ("y_m", MAX_POSE_M),
        ("heading_rad", MAX_POSE_M),
        ("linear_m_s", MAX_SPEED),
        ("angular_rad_s", MAX_SPEED),
    ):
        value = float(arguments.get(name, math.nan))
        if not abs(value) <= most:
            raise RefusalError("bad_argument", f"{name}: give a number within ±{most:g}")
        values.append(value)
    return BaseReport(Pose(*values[:3]), Twist(*values[3:]))
