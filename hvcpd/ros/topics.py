"""The bridge's topics, by names that can be remapped; docs/ros.md tells each one's meaning."""

from __future__ import annotations

from dataclasses import dataclass

from hvcpd.ros.messages import (
    Bool,
    DiagnosticArray,
    Message,
    Odometry,
    RobotState,
    Sentence,
    String,
    TaskArray,
    TFMessage,
    Twist,
)


@dataclass(frozen=True)
class Topic:
    """A name, relative to the node's namespace unless it begins with "/", and the type of its messages.

    `latched`: who subscribes later is given the last message too ("transient local" in ROS 2).
    """

    name: str
    type: type[Message]
    latched: bool = False


HEARD = Topic("heard", String)
HEARD_SENTENCE = Topic("heard/sentence", Sentence)
SAID = Topic("said", String)
SAID_SENTENCE = Topic("said/sentence", Sentence)
EVENTS = Topic("events", String)
TASKS = Topic("tasks", TaskArray, latched=True)
STATE = Topic("state", RobotState, latched=True)
STOPPED = Topic("estop/state", Bool, latched=True)
CMD_VEL = Topic("cmd_vel", Twist)
ODOM = Topic("odom", Odometry)
TF = Topic("/tf", TFMessage)
DIAGNOSTICS = Topic("/diagnostics", DiagnosticArray)

SAY = Topic("say", String)
TASK = Topic("task", String)
ESTOP = Topic("estop", Bool)

PUBLISHED = (HEARD, HEARD_SENTENCE, SAID, SAID_SENTENCE, EVENTS, TASKS, STATE, STOPPED, DIAGNOSTICS)
"""Topics that are published in any case."""
SUBSCRIBED = (SAY, TASK, ESTOP)
"""Topics that are subscribed to in any case."""


def published(ros_drives: bool) -> tuple[Topic, ...]:
    """All that the bridge publishes."""
    return (*PUBLISHED, CMD_VEL) if ros_drives else (*PUBLISHED, ODOM, TF)


def subscribed(ros_drives: bool) -> tuple[Topic, ...]:
    """All that it listens to; `cmd_vel` never: who has the wheels is settled in the settings."""
    return (*SUBSCRIBED, ODOM) if ros_drives else SUBSCRIBED
