"""A base under ROS: its commands, and the time for which the last command of the daemon is valid. Pure.

Leases both ways end within half a second: the daemon stands when it hears no odometry (hvcpd/hardware/ros_base.py), and
here the base is stopped when the daemon is silent. A TurtleBot3's own node goes on with the last `cmd_vel` for ever.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hvcpd.ports import PlaceGoal

LEASE_S = 0.4
"""Silence of the daemon, which speaks every 0.05 s, after which the base is stopped."""
PERIOD_S = 0.05
"""Between two commands to a base that moves or is held, as Nav2 and move_base do (20 Hz)."""
ZEROS_S = 0.5
"""Time for which zero is commanded after a motion; then nothing is: others may drive the base by hand."""


@dataclass(frozen=True)
class Speeds:
    """Command these speeds now, m/s and rad/s."""

    linear_m_s: float
    angular_rad_s: float


@dataclass(frozen=True)
class Go:
    """Give this goal to ROS's navigation."""

    goal: PlaceGoal


@dataclass(frozen=True)
class Cancel:
    """Withdraw the goal of that number."""

    number: int


Order = Speeds | Go | Cancel
STAND = Speeds(0.0, 0.0)


class Driving:
    """`on_event` with each `drive` event of the daemon, `tick` at least every `PERIOD_S`; both give orders for ROS."""

    def __init__(self) -> None:
        self._speeds = STAND
        self._stopped = False
        self.goal: PlaceGoal | None = None
        """The goal that ROS's navigation has now."""
        self._finished: int | None = None
        self._told_s: float | None = None
        self._sent_s = -math.inf
        self._zeros_until_s = -math.inf

    def begin(self, now_s: float) -> None:
        """Zero is commanded first: an earlier bridge that was killed may have left the base under way."""
        self._zeros_until_s = now_s + ZEROS_S

    def on_event(self, event: Mapping[str, Any], now_s: float) -> list[Order]:
        """The daemon says how the base is to move."""
        self._told_s = now_s
        self._stopped = bool(event["stopped"])
        goal = goal_of(event.get("goal"))
        if goal is not None and goal.number == self._finished:  # the daemon does not know yet
            goal = None
        orders = self._change_goal(goal)
        speeds = Speeds(float(event["linear_m_s"]), float(event["angular_rad_s"]))
        halts = speeds == STAND != self._speeds
        self._set(speeds, now_s)
        if halts or any(isinstance(order, Cancel) for order in orders):
            self._zeros_until_s = now_s + ZEROS_S
            self._sent_s = -math.inf
        return orders + self._command(now_s)

    def tick(self, now_s: float) -> list[Order]:
        """Time passes; a daemon that has been silent for `LEASE_S` wants nothing any more."""
        orders: list[Order] = []
        if self._told_s is not None and now_s - self._told_s > LEASE_S:
            orders = self.stand(now_s)
        return orders + self._command(now_s)

    def stand(self, now_s: float) -> list[Order]:
        """The daemon is gone: the base stands, and navigation's goal is cancelled."""
        self._told_s = self._finished = None
        orders = self._change_goal(None)
        if orders or self._speeds != STAND:
            self._zeros_until_s = now_s + ZEROS_S
            self._sent_s = -math.inf
        self._speeds = STAND
        return orders + self._command(now_s)

    def finished(self, number: int) -> bool:
        """Navigation is done with that goal; whether it still mattered."""
        if self.goal is None or self.goal.number != number:
            return False
        self.goal, self._finished = None, number
        return True

    def _set(self, speeds: Speeds, now_s: float) -> None:
        self._speeds = speeds
        if speeds != STAND:
            self._zeros_until_s = now_s + ZEROS_S

    def _change_goal(self, goal: PlaceGoal | None) -> list[Order]:
        before, self.goal = self.goal, goal
        if goal == before:
            return []
        orders: list[Order] = [Cancel(before.number)] if before is not None else []
        return [*orders, Go(goal)] if goal is not None else orders

    def _command(self, now_s: float) -> list[Order]:
        wanted = self._speeds != STAND or self._stopped or now_s < self._zeros_until_s
        if self.goal is not None or not wanted or now_s - self._sent_s < PERIOD_S - 1e-6:
            return []
        self._sent_s = now_s
        return [self._speeds]


def goal_of(value: Mapping[str, Any] | None) -> PlaceGoal | None:
    """The goal of a `drive` event."""
    return None if value is None else PlaceGoal(int(value["number"]), float(value["x_m"]), float(value["y_m"]))
