"""The bridge's topics, by names that can be remapped; docs/ros.md tells each one's meaning."""

from __future__ import annotations

from dataclasses import dataclass

from hvcpd.ros import messages as m


@dataclass(frozen=True)
class Topic:
    """A name, relative to the node's namespace unless it begins with "/", and the type of its messages.

    `latched`: who subscribes later is given the last message too ("transient local" in ROS 2).
    """

    name: str
    type: type[m.Message]
    latched: bool = False


HEARD = Topic("heard", m.String)
HEARD_SENTENCE = Topic("heard/sentence", m.Sentence)
SAID = Topic("said", m.String)
SAID_SENTENCE = Topic("said/sentence", m.Sentence)
EVENTS = Topic("events", m.String)
TASKS = Topic("tasks", m.TaskArray, latched=True)
STATE = Topic("state", m.RobotState, latched=True)
STOPPED = Topic("estop/state", m.Bool, latched=True)
CMD_VEL = Topic("cmd_vel", m.Twist)
ODOM = Topic("odom", m.Odometry)
TF = Topic("/tf", m.TFMessage)
DIAGNOSTICS = Topic("/diagnostics", m.DiagnosticArray)

SAY = Topic("say", m.String)
TASK = Topic("task", m.String)
ESTOP = Topic("estop", m.Bool)

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
