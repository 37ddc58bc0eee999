"""Actions of ROS as the robot's skills: calls of the daemon in, goals out, and what became of them back. Pure.

An action server cannot hold still: a call that is held is withdrawn, and its goal given anew when it goes on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hvcpd.config.skill_settings import RosSettings
from hvcpd.skills.host import BEATS_MISSED_S
from hvcpd.skills.life import CANCELLED
from hvcpd.skills.runners import filled_in, written

TOLD_EVERY_S = 0.5
"""Between two words to the daemon of how far a goal is; feedback may come a hundred times a second."""
MAX_LENGTH = 200
"""Characters of each; the daemon hangs up on a line of more than 8192 bytes."""
MAX_TOLD = 3
"""Most fields of a feedback or a result that are passed on; more is for ROS's own tools."""


@dataclass(frozen=True)
class Act:
    """Give the server of a skill's action this goal."""

    number: int
    skill: str
    fields: Mapping[str, Any]


@dataclass(frozen=True)
class Leave:
    """Withdraw the goal of that number."""

    number: int
    skill: str


@dataclass(frozen=True)
class Tell:
    """Have the daemon told."""

    command: str
    arguments: Mapping[str, Any]


Effect = Act | Leave | Tell


@dataclass
class _Call:
    """A call under way. `goal` is the number of its goal; None while it is held."""

    call: int
    act: Act
    goal: int | None


class Skills:
    """`on_event` what the daemon says; `ended` and `fed_back` what a server does. All return what is to be done."""

    def __init__(self, actions: Mapping[str, RosSettings]) -> None:
        self.actions = actions
        self._under_way: _Call | None = None
        self._goals = 0
        self._heard_s = self._told_s = -math.inf

    def on_event(self, event: Mapping[str, Any], now_s: float) -> list[Effect]:
        """An event of the daemon; those that are none of this class's change nothing."""
        self._heard_s = now_s
        under_way, kind = self._under_way, event.get("event")
        if kind == "perform" and event.get("skill") in self.actions:
            return [*self.leave(), *self._begin(event)]
        if under_way is None or event.get("call") != under_way.call:
            return []
        if kind == "cancel":
            return self.leave()
        if kind == "pause" and under_way.goal is not None:
            left, under_way.goal = Leave(under_way.goal, under_way.act.skill), None
            return [left]
        if kind == "resume" and under_way.goal is None:
            return [self._give(under_way)]
        return []

    def leave(self) -> list[Effect]:
        """Withdraw what is under way: nobody wants it any more."""
        call, self._under_way = self._under_way, None
        return [Leave(call.goal, call.act.skill)] if call is not None and call.goal is not None else []

    def tick(self, now_s: float) -> list[Effect]:
        """Time passes. A daemon that was silent for too long may go on, and is not to wait for its call."""
        call = self._under_way
        if call is None or now_s - self._heard_s <= BEATS_MISSED_S:
            return []
        return [*self.leave(), Tell("failed", {"call": call.call, "reason": CANCELLED})]

    def fed_back(self, number: int, values: Mapping[str, Any], now_s: float) -> list[Effect]:
        """A server tells how far it is."""
        call = self._under_way
        if call is None or call.goal != number or now_s - self._told_s < TOLD_EVERY_S:
            return []
        self._told_s = now_s
        text = ", ".join(f"{name} {written(value)}" for name, value in list(values.items())[:MAX_TOLD])
        return [Tell("progress", {"call": call.call, "text": text[:MAX_LENGTH]})]

    def ended(self, number: int, reason: str | None, values: Mapping[str, Any]) -> list[Effect]:
        """A server is done with a goal, or will never be: then the `reason`."""
        call = self._under_way
        if call is None or call.goal != number:
            return []
        self._under_way = None
        if reason is not None:
            return [Tell("failed", {"call": call.call, "reason": reason[:MAX_LENGTH]})]
        return [Tell("done", {"call": call.call, "results": dict(list(values.items())[:MAX_TOLD])})]

    def _begin(self, event: Mapping[str, Any]) -> list[Effect]:
        skill = str(event["skill"])
        fields = filled(self.actions[skill].goal, event["arguments"])
        self._under_way = _Call(int(event["call"]), Act(0, skill, fields), None)
        return [Tell("progress", {"call": self._under_way.call}), self._give(self._under_way)]

    def _give(self, call: _Call) -> Act:
        self._goals += 1
        call.goal = self._goals
        return Act(self._goals, call.act.skill, call.act.fields)


def filled(value: Any, arguments: Mapping[str, Any]) -> Any:
    """The goal's fields with the call's arguments in their places; one that stands alone keeps its type."""
    if isinstance(value, Mapping):
        return {name: filled(each, arguments) for name, each in value.items()}
    if isinstance(value, list):
        return [filled(each, arguments) for each in value]
    if not isinstance(value, str):
        return value
    if value[:1] == "{" and value[-1:] == "}" and value[1:-1] in arguments:
        return arguments[value[1:-1]]
    return filled_in(value, arguments)


def fill_message(message: Any, fields: Mapping[str, Any]) -> None:
    """Set the fields of a ROS message, group by group. Raises ValueError for one that is missing or of another type."""
    for name, value in fields.items():
        if not hasattr(message, name):
            raise ValueError(f"the goal has no field {name!r}")
        before = getattr(message, name)
        if isinstance(value, Mapping):
            fill_message(before, value)
            continue
        try:
            is_plain = isinstance(before, bool | int | float | str)
            setattr(message, name, type(before)(value) if is_plain else value)
        except (TypeError, ValueError, AssertionError):  # rclpy's messages assert their fields' types
            raise ValueError(f"the goal's field {name!r} cannot be {value!r}") from None


def values_of(message: Any, prefix: str = "") -> dict[str, float | str]:
    """The numbers and texts of a ROS message by name, those of its groups with a point: "pose.x"."""
    if hasattr(message, "get_fields_and_field_types"):
        names = list(message.get_fields_and_field_types())
    else:
        names = list(getattr(message, "__slots__", ()))
    found: dict[str, float | str] = {}
    for name in names:
        value = getattr(message, name)
        if isinstance(value, int | float) and math.isfinite(value):
            found[prefix + name] = float(value)
        elif isinstance(value, str) and value:
            found[prefix + name] = value[:MAX_LENGTH]
        elif hasattr(value, "__slots__"):
            found |= values_of(value, f"{prefix}{name}.")
    return found
