"""How one robot carries out a skill of its team's task file: by a program, a pin, a joint, or a ROS action.

Also the pin of its stop button.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from hvcpd.config.loading import between, checked

HIGHEST_PIN = 27
"""Of a Raspberry Pi's header, in Broadcom's numbers, as gpiozero counts them."""

MOTOR_RANGE_DEG = 360.0
"""Position mode knows one turn (e-Manual, xl430-w250)."""


_ACTION_NAME = re.compile(r"/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*")
_ACTION_TYPE = re.compile(r"[a-z][a-z0-9_]*/(action/)?[A-Z][A-Za-z0-9]*")


def _valid_action(name: str) -> str | None:
    example = "write for example 'gripper'"
    return None if _ACTION_NAME.fullmatch(name) else f"{name[:60]!r} is not the name of an action; {example}"


def _valid_type(name: str) -> str | None:
    example = "write for example 'control_msgs/GripperCommand'"
    return None if _ACTION_TYPE.fullmatch(name) else f"{name[:60]!r} is not the type of an action; {example}"


@dataclass(frozen=True)
class PinSettings:
    """A pin that is switched on for a while: the argument `amount` of the call, divided by `per_s`, in seconds.

    A switch at `empty_pin` that closes to ground, a tank's float for example, ends the call: it fails with
    `empty_reason`.
    """

    pin: int = field(metadata=between(0, HIGHEST_PIN))
    amount: str = "seconds"
    per_s: float = field(default=1.0, metadata=between(1e-6, 1e6))
    active_high: bool = True
    empty_pin: int | None = field(default=None, metadata=between(0, HIGHEST_PIN))
    empty_reason: str = "the tank is empty"


@dataclass(frozen=True)
class JointSettings:
    """A motor in position mode on the wheels' bus: a gripper, a pan. It goes to the argument `angle` of the call.

    Angles count from `zero_deg`, where the motor counts from 0 to 360, counter-clockwise unless `reverse`. `effort` is
    the share of the motor's force that it may use. `blocked` says what it means when something is in its way, as in a
    gripper that has closed on a book. `stopped`: whether it holds where it is after a stop, or lets go.
    """

    id: int = field(metadata=between(0, 252))
    angle: str = "angle_deg"
    zero_deg: float = field(default=180.0, metadata=between(0, 360))
    reverse: bool = False
    least_deg: float = field(default=-90.0, metadata=between(-360, 360))
    most_deg: float = field(default=90.0, metadata=between(-360, 360))
    speed_deg_s: float = field(default=90.0, metadata=between(2, 300))
    effort: float = field(default=0.5, metadata=between(0.05, 1))
    blocked: Literal["failed", "done"] = "failed"
    stopped: Literal["hold", "release"] = "hold"


@dataclass(frozen=True)
class RosSettings:
    """An action of this robot's ROS, by its name and its type ("control_msgs/GripperCommand").

    `goal` has the goal's fields; "{width_m}" alone stands for what the call has for it, a number for a number.
    """

    action: str = field(metadata=checked(_valid_action))
    type: str = field(metadata=checked(_valid_type))
    goal: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class SkillSettings:
    """How this robot carries out a skill: by a program, a pin, a joint, or an action of its ROS.

    `run` is the program and its arguments, where "{litres}" stands for what the call has for `litres`. `safe` is a
    program that leaves all safe, run after `run` was cancelled or has failed.
    """

    run: tuple[str, ...] = ()
    safe: tuple[str, ...] = ()
    gpio: PinSettings | None = None
    joint: JointSettings | None = None
    ros: RosSettings | None = None


@dataclass(frozen=True)
class StopButtonSettings:
    """A button that stops the robot, between a pin and ground; None: there is none.

    One that is normally closed opens when it is pressed, and so does a wire that breaks.
    """

    pin: int | None = field(default=None, metadata=between(0, HIGHEST_PIN))
    normally_closed: bool = True


def way_fault(_name: str, skill: SkillSettings) -> str | None:
    """What is wrong with the way to carry a skill out, or None."""
    ways = [bool(skill.run), *(way is not None for way in (skill.gpio, skill.joint, skill.ros))]
    if ways.count(True) != 1:
        ros = "`ros: {action: name, type: package/Name}`"
        return f"give one of `run: [program, …]`, `gpio: {{pin: 17}}`, `joint: {{id: 3}}` and {ros}"
    if skill.safe and not skill.run:
        return "`safe` goes with `run`; pins and joints are made safe anyway"
    if skill.joint is not None and (wrong := _joint_fault(skill.joint)) is not None:
        return f"joint: {wrong}"
    return None


def _joint_fault(joint: JointSettings) -> str | None:
    if joint.least_deg >= joint.most_deg:
        return f"least_deg {joint.least_deg:g} is not below most_deg {joint.most_deg:g}; swap them"
    ends = [joint.zero_deg + (-1 if joint.reverse else 1) * end for end in (joint.least_deg, joint.most_deg)]
    if min(ends) < 0.0 or max(ends) >= MOTOR_RANGE_DEG:
        return f"from zero_deg {joint.zero_deg:g} the motor would leave its one turn; narrow least_deg and most_deg"
    return None


def runnable(skill: SkillSettings, path: Path | None) -> SkillSettings:
    """Make program paths that begin with a point absolute: they are relative to the settings file `path`."""

    def whole(words: tuple[str, ...]) -> tuple[str, ...]:
        beside = path is not None and words[:1] and words[0].startswith(("./", "../"))
        return (str(path.resolve().parent / words[0]), *words[1:]) if beside and path is not None else words

    return dataclasses.replace(skill, run=whole(skill.run), safe=whole(skill.safe))
