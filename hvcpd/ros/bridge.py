"""The bridge itself, without ROS and without sockets: lines of the daemon and messages of ROS in, both kinds out.

Time is passed in: `now_s` is monotonic; `stamp_s` is the time that ROS has, for headers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hvcpd.ros import topics
from hvcpd.ros.driving import Cancel, Driving, Go, Order, Speeds
from hvcpd.ros.mapping import (
    Line,
    as_text,
    base_arguments,
    diagnostics_of,
    odometry_of,
    sentence_of,
    state_of,
    task_arguments,
    tasks_of,
    tf_of,
    twist_of,
    way_left_m,
)
from hvcpd.ros.messages import Bool, Message, Odometry, String
from hvcpd.ros.parameters import Parameters
from hvcpd.ros.skills import Act, Effect, Leave, Skills, Tell
from hvcpd.ros.topics import Topic

STATUS_S = 1.0
"""Between two diagnoses: /diagnostics is read at 1 Hz by custom."""
BASE_S = 0.03
"""Between two words of odometry to the daemon: it reads its wheels every 0.05 s."""
SILENT_S = 1.0
"""Time without odometry after which the bridge reports it, so that people see why the robot stands."""
UNANSWERED_S = 1.0
"""A reply that has not come by then is not waited for any more."""
MAX_SAY_LENGTH = 500
"""Characters; more than any sentence of the phrasebook. The daemon hangs up on a line of more than 8192 bytes."""
MAX_SAYS = 5
"""Sentences that wait for the daemon's reply, which comes at once; more would keep a stop or odometry waiting."""
NO_DAEMON = "no daemon answers; start it with `hvcpd`"
TOO_MANY = "say: too many sentences at once; this one and others are left out"
NOT_PRESSED = f"{topics.ESTOP.name}: false releases only after true; publish both, or say resume"
EVENT_KINDS = ("said", "heard", "garbled", "held", "taskchanged", "performed", "statechanged")


@dataclass(frozen=True)
class Publish:
    """Have ROS told."""

    topic: Topic
    message: Message


@dataclass(frozen=True)
class Ask:
    """Have the daemon told; the reply comes with this `id`."""

    id: int
    command: str
    arguments: Mapping[str, Any]


@dataclass(frozen=True)
class Log:
    """Have people told, by ROS's log."""

    text: str


Output = Publish | Ask | Log | Go | Cancel | Act | Leave


class Bridge:
    """One robot's. What is to be done is fetched with `outputs` after each call."""

    def __init__(self, ros_drives: bool, parameters: Parameters, skills: Skills | None = None) -> None:
        self.ros_drives = ros_drives
        self._skills = skills or Skills({})
        self._parameters = parameters
        self._status: Line | None = None
        self._driving = Driving()
        self._outputs: list[Output] = []
        self._asked: dict[int, str] = {}
        self._last_id = 0
        self._sample_zero_s = 0.0
        self._status_s = -math.inf
        self._base_s = -math.inf
        self._base_id: int | None = None
        self._stop_id: int | None = None
        self._stop_s = -math.inf
        self._odometry_s = -math.inf
        self._told_silent_s = -math.inf
        self._pressed = False
        self._stopped: bool | None = None
        self._way_left_m: float | None = None
        self._last_refusal = ""
        self._active = True

    def outputs(self) -> list[Output]:
        """The outputs since the last call, in order."""
        done, self._outputs = self._outputs, []
        return done

    def begin(self, now_s: float) -> None:
        """A daemon is there: follow it, and tell ROS how things are."""
        unanswered = self._asked.get(self._stop_id or 0)
        self._asked.clear()
        if unanswered == "stop":  # there was no daemon, or it ended first
            self._stop_id = self._ask("stop")
        self._odometry_s = now_s
        self._driving.begin(now_s)
        if not self._active:
            return
        self._ask("subscribe", events=[*EVENT_KINDS, "drive" if self.ros_drives else "odom"])
        self._ask("tasks")
        if self._skills.actions:
            self._ask("offer", skills=sorted(self._skills.actions))
        self._ask_status(now_s)

    def lost(self, now_s: float) -> None:
        """The daemon has ended."""
        self._status = None
        self._carry_out(self._driving.stand(now_s))
        self._act(self._skills.leave())

    def activate(self, parameters: Parameters, now_s: float) -> None:
        """ROS has activated its node, with these parameters."""
        self._parameters = parameters
        if not self._active:
            self._active, self._stopped = True, None
            self.begin(now_s)

    def deactivate(self, now_s: float) -> None:
        """ROS has deactivated its node: the base stands, and nothing passes but a stop."""
        if self._active:
            self.master_lost("ROS has deactivated the bridge", now_s)
            if self._skills.actions:
                self._ask("offer", skills=[])
            self._active = False

    def master_lost(self, reason: str, now_s: float) -> None:
        """ROS has ended, or can no longer be trusted: the robot stands, and gets the reason."""
        self._carry_out(self._driving.stand(now_s))
        self._act(self._skills.leave())
        if self.ros_drives:
            self._ask("base", fault=reason)

    def from_daemon(self, line: Line, now_s: float, stamp_s: float) -> None:
        """A line of the daemon, event or reply."""
        kind = line.get("event")
        if kind is None:
            self._replied(line, stamp_s)
        elif kind == "drive":
            if self._active and not self._is_stopping(now_s):
                self._carry_out(self._driving.on_event(line, now_s))
        elif kind == "odom":
            self._tell_odometry(line, stamp_s)
        elif kind in EVENT_KINDS:
            self._tell_event(kind, line, stamp_s)
        elif self._active:
            self._act(self._skills.on_event(line, now_s))

    def from_ros(self, topic: Topic, message: Message, now_s: float) -> None:
        """A message to the bridge."""
        if not self._active and message != Bool(True):  # a stop
            return
        if topic == topics.SAY and isinstance(message, String):
            self._take_say(message.data)
        elif topic == topics.TASK and isinstance(message, String):
            self._take_task(message.data)
        elif topic == topics.ESTOP and isinstance(message, Bool):
            self._take_estop(message.data, now_s)
        elif topic == topics.ODOM and isinstance(message, Odometry):
            self._take_odometry(message, now_s)

    def goal_fed_back(self, number: int, values: Mapping[str, float | str]) -> None:
        """Navigation tells how far it is with a goal."""
        if self._driving.goal is not None and self._driving.goal.number == number:
            self._way_left_m = way_left_m(values, self._driving.goal)

    def goal_ended(self, number: int, arrived: bool, reason: str) -> None:
        """Navigation has ended with a goal."""
        if self._driving.finished(number):
            self._way_left_m = None
            self._ask("base", goal=number, arrived=arrived, reason=reason)

    def action_fed_back(self, number: int, values: Mapping[str, Any], now_s: float) -> None:
        """An action server tells how far it is with a skill's goal."""
        self._act(self._skills.fed_back(number, values, now_s))

    def action_ended(self, number: int, reason: str | None, values: Mapping[str, Any]) -> None:
        """An action server has ended with a skill's goal: well, or for a `reason`."""
        self._act(self._skills.ended(number, reason, values))

    def tick(self, now_s: float, stamp_s: float) -> None:
        """Time passes; call it at least every 0.05 s."""
        self._act(self._skills.tick(now_s))
        if self.ros_drives:
            self._carry_out(self._driving.tick(now_s))
            self._watch_base(now_s)
        if now_s - self._status_s >= STATUS_S:
            if self._status is None:
                self._publish(topics.DIAGNOSTICS, diagnostics_of(None, stamp_s, NO_DAEMON, {}))
            self._ask_status(now_s)

    def _is_stopping(self, now_s: float) -> bool:
        """Ignore commands that the daemon sent before it knew of a stop."""
        return self._stop_id in self._asked and now_s - self._stop_s < UNANSWERED_S

    def _ask_status(self, now_s: float) -> None:
        self._status_s = now_s
        self._ask("status")

    def _watch_base(self, now_s: float) -> None:
        silent_s = now_s - self._odometry_s
        if self._active and silent_s > SILENT_S and now_s - self._told_silent_s > SILENT_S:
            self._told_silent_s = now_s
            self._ask("base", fault=f"no odometry comes on {topics.ODOM.name}; is the base's driver running?")

    def _tell_odometry(self, event: Line, stamp_s: float) -> None:
        odometry = odometry_of(event, stamp_s, self._parameters)
        self._publish(topics.ODOM, odometry)
        if self._parameters.publish_tf:
            self._publish(topics.TF, tf_of(odometry))

    def _tell_event(self, kind: str, event: Line, stamp_s: float) -> None:
        self._publish(topics.EVENTS, String(as_text(dict(event))))
        if kind in ("heard", "said"):
            heard = kind == "heard"
            self._publish(topics.HEARD if heard else topics.SAID, String(str(event["text"])))
            sentence = sentence_of(event, self._sample_zero_s)
            self._publish(topics.HEARD_SENTENCE if heard else topics.SAID_SENTENCE, sentence)
        elif kind == "statechanged":
            self._publish(topics.STATE, state_of(event["state"], event["doing"], event["task"], stamp_s))
            self._tell_stopped(event["state"] == "stopped")
        elif kind == "taskchanged":
            self._ask("tasks")

    def _tell_stopped(self, stopped: bool) -> None:
        if stopped is not self._stopped:
            self._stopped = stopped
            self._publish(topics.STOPPED, Bool(stopped))

    def _take_estop(self, pressed: bool, now_s: float) -> None:
        """Stop, or release after a stop: "false" alone is what a switch that nobody presses may repeat for ever."""
        was_pressed, self._pressed = self._pressed, pressed
        if not pressed and not was_pressed:
            if self._stopped and self._last_refusal != NOT_PRESSED:
                self._tell_refusal(NOT_PRESSED, None)
            return
        command = "stop" if pressed else "resume"
        is_known = was_pressed and pressed and self._stopped and self._status is not None
        if not is_known and self._asked.get(self._stop_id or 0) != command:  # it may be on its way, however often said
            self._stop_id = self._ask(command)
        self._stop_s = now_s
        if pressed:  # without waiting for the daemon's word
            self._carry_out(self._driving.stand(now_s))
            self._act(self._skills.leave())

    def _take_say(self, text: str) -> None:
        if len(text) > MAX_SAY_LENGTH:
            self._tell_refusal(f"say: {len(text)} characters are not a sentence; {text[:40]!r}…", None)
        elif sum(command == "say" for command in self._asked.values()) < MAX_SAYS:
            self._ask("say", text=text)
        elif self._last_refusal != TOO_MANY:
            self._tell_refusal(TOO_MANY, None)

    def _take_task(self, text: str) -> None:
        """Pass "again 3", "skip 3", "remove 3" or "add" with a task in JSON on."""
        wanted, _, rest = text.strip().partition(" ")
        arguments = task_arguments(wanted, rest)
        if arguments is None:
            forms = "'again 3', 'skip 3', 'remove 3' or 'add' and a task in JSON"
            self._tell_refusal(f"task: write {forms}, not {text[:40]!r}", None)
        elif sum(command == "task" for command in self._asked.values()) < MAX_SAYS:
            self._ask("task", do=wanted, **arguments)

    def _take_odometry(self, odometry: Odometry, now_s: float) -> None:
        arguments = base_arguments(odometry)
        if arguments is None:
            return
        self._odometry_s = now_s
        waits = self._base_id in self._asked and now_s - self._base_s < UNANSWERED_S
        if not waits and now_s - self._base_s >= BASE_S:
            self._base_s = now_s
            self._base_id = self._ask("base", **arguments)

    def _replied(self, line: Line, stamp_s: float) -> None:
        command = self._asked.pop(line.get("id") or 0, None)
        if command is None:
            return
        if line.get("ok") is not True:
            error = line.get("error", {})
            self._tell_refusal(f"{command}: {error.get('text', 'refused without a reason')}", error.get("code"))
            return
        result = line["result"]
        if command == "status":
            self._take_status(result, stamp_s)
        elif command == "tasks":
            self._publish(topics.TASKS, tasks_of(result["tasks"], stamp_s))

    def _tell_refusal(self, text: str, code: object) -> None:
        if code != "starting" and (text != self._last_refusal or not text.startswith("base")):
            self._outputs.append(Log(text))
        self._last_refusal = text

    def _take_status(self, status: Line, stamp_s: float) -> None:
        began = self._status is None or self._status["state"] == "starting"
        self._status = status
        self._sample_zero_s = stamp_s - float(status["now_s"])
        self._tell_stopped(bool(status["stopped"]))
        if began and status["state"] != "starting":
            self._ask("tasks")
        if began:
            task = status["task"]["number"] if status.get("task") else None
            self._publish(topics.STATE, state_of(status["state"], status["doing"], task, stamp_s))
        way = {} if self._way_left_m is None else {"distance to the goal, m": f"{self._way_left_m:.2f}"}
        self._publish(topics.DIAGNOSTICS, diagnostics_of(status, stamp_s, "", way))

    def _carry_out(self, orders: list[Order]) -> None:
        for order in orders:
            if not isinstance(order, Speeds):
                self._way_left_m = None
                self._outputs.append(order)
            elif self.ros_drives:
                self._publish(topics.CMD_VEL, twist_of(order.linear_m_s, order.angular_rad_s))

    def _act(self, deeds: list[Effect]) -> None:
        for deed in deeds:
            if isinstance(deed, Tell):
                self._ask(deed.command, **deed.arguments)
            else:
                self._outputs.append(deed)

    def _publish(self, topic: Topic, message: Message) -> None:
        if self._active or topic == topics.CMD_VEL:
            self._outputs.append(Publish(topic, message))

    def _ask(self, command: str, **arguments: object) -> int:
        self._last_id += 1
        self._asked[self._last_id] = command
        self._outputs.append(Ask(self._last_id, command, arguments))
        return self._last_id
