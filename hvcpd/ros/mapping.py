"""Between the daemon's lines and ROS's messages: each function turns one into the other. Pure."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from hvcpd.config.json_objects import json_object
from hvcpd.ports import WARN_BATTERY_V, PlaceGoal
from hvcpd.reporting.text import shown_away
from hvcpd.ros import messages as m
from hvcpd.ros.parameters import Parameters

MAX_TASK_LENGTH = 4000
"""Characters of a task in JSON; one of a dozen actions has about 500."""
MAX_DIGITS = 4
"""Of a task's number; which ones there are the daemon knows."""

Line = Mapping[str, Any]
"""One JSON object of the daemon's; docs/control.md lists their fields."""


def as_text(value: object) -> str:
    """JSON for a topic: one line, plain ASCII."""
    return json.dumps(value, separators=(", ", ": "), allow_nan=False)


def sentence_of(event: Line, wall_of: float) -> m.Sentence:
    """A `heard` or `said` event; `wall_of` is the ROS time of the daemon's sample clock at 0."""
    at_s = float(event["at_s"])
    words = tuple(m.Word(str(word), begin_s - at_s, end_s - at_s) for word, begin_s, end_s in event.get("words") or ())
    end_s = float(event["end_s"]) - at_s if "end_s" in event else words[-1].end_s if words else math.nan
    sure, snr_db = (math.nan if event.get(key) is None else float(event[key]) for key in ("confidence", "snr_db"))
    stamp = m.Header(m.Time.of(max(wall_of + at_s, 0.0)))
    return m.Sentence(stamp, str(event["speaker"]), str(event["text"]), end_s, sure, snr_db, words)


def tasks_of(tasks: Sequence[Line], stamp_s: float) -> m.TaskArray:
    """The board as the command `tasks` has it."""
    return m.TaskArray(m.Header(m.Time.of(stamp_s)), tuple(map(_task, tasks)))


def _task(task: Line) -> m.Task:
    place = task.get("place")
    point = m.Point(float(place["x_m"]), float(place["y_m"])) if place else m.Point()
    owner = task.get("owner") or ""
    return m.Task(int(task["number"]), str(task.get("name", "")), str(task["state"]), owner, place is not None, point)


def state_of(state: str, doing: str, task: int | None, stamp_s: float) -> m.RobotState:
    """What the robot is doing."""
    return m.RobotState(m.Header(m.Time.of(stamp_s)), state, doing, task or 0)


def odometry_of(event: Line, stamp_s: float, parameters: Parameters) -> m.Odometry:
    """nav_msgs/Odometry of an `odom` event."""
    pose = m.Pose(m.Point(float(event["x_m"]), float(event["y_m"])), m.Quaternion.about_z(float(event["heading_rad"])))
    speeds = twist_of(float(event["linear_m_s"]), float(event["angular_rad_s"]))
    header = m.Header(m.Time.of(stamp_s), parameters.odom_frame)
    return m.Odometry(header, parameters.base_frame, m.PoseWithCovariance(pose), m.TwistWithCovariance(speeds))


def tf_of(odometry: m.Odometry) -> m.TFMessage:
    """The transform odom → base_link that goes with it."""
    pose = odometry.pose.pose
    move = m.Vector3(pose.position.x, pose.position.y, pose.position.z)
    transform = m.Transform(move, pose.orientation)
    return m.TFMessage((m.TransformStamped(odometry.header, odometry.child_frame_id, transform),))


def twist_of(linear_m_s: float, angular_rad_s: float) -> m.Twist:
    """geometry_msgs/Twist of a robot on the floor."""
    return m.Twist(m.Vector3(x=linear_m_s), m.Vector3(z=angular_rad_s))


def base_arguments(odometry: m.Odometry) -> dict[str, float] | None:
    """The command `base` of what a base says; None for one that says no numbers."""
    pose, twist = odometry.pose.pose, odometry.twist.twist
    values = {
        "x_m": pose.position.x,
        "y_m": pose.position.y,
        "heading_rad": pose.orientation.heading_rad,
        "linear_m_s": twist.linear.x,
        "angular_rad_s": twist.angular.z,
    }
    return values if all(map(math.isfinite, values.values())) else None


def way_left_m(values: Mapping[str, float | str], goal: PlaceGoal) -> float:
    """How far it is to a goal by the feedback of Nav2, or by that of move_base, which has the base's place; NaN if the
    numbers are missing."""
    x_m, y_m = (float(values.get(f"base_position.pose.position.{axis}", math.nan)) for axis in "xy")
    return float(values.get("distance_remaining", math.hypot(goal.x_m - x_m, goal.y_m - y_m)))


def diagnostics_of(status: Line | None, stamp_s: float, why_none: str, driving: Mapping[str, str]) -> m.DiagnosticArray:
    """What `status` says, as four parts: robot, sound, wheels, battery; or that there is no robot, and why."""
    if status is None:
        parts: tuple[m.DiagnosticStatus, ...] = (
            m.DiagnosticStatus(m.DiagnosticStatus.STALE, "hvcpd: robot", why_none, "hvcpd"),
        )
    else:
        name = str(status["name"])
        made = (_robot(status), _sound(status["sound"]), _wheels(status.get("wheels"), driving), _battery(status))
        parts = tuple(
            m.DiagnosticStatus(level, f"hvcpd: {part}", message, name, _values(values))
            for part, level, message, values in made
        )
    return m.DiagnosticArray(m.Header(m.Time.of(stamp_s)), parts)


_Part = tuple[str, int, str, Mapping[str, object]]


def _robot(status: Line) -> _Part:
    level = m.DiagnosticStatus.WARN if status["stopped"] or status["state"] == "starting" else m.DiagnosticStatus.OK
    task = status.get("task")
    values = {
        "state": status["state"],
        "task": task["name"] if task else "",
        "team": status["team"],
        "version": status["version"],
        "uptime_s": status["uptime_s"],
        "within earshot": ", ".join(peer["name"] for peer in status["peers"] if peer["present"]),
        **{f"distance to {peer['name']}": far for peer in status["peers"] if (far := shown_away(peer))},
    }
    return "robot", level, str(status["doing"]), values


def _sound(sound: Line) -> _Part:
    values = {"level_dbfs": sound["level_dbfs"], "floor_dbfs": sound["floor_dbfs"], **sound["lost"]}
    if not sound["listening"]:
        return "sound", m.DiagnosticStatus.ERROR, "hears nothing: there is no sound", values
    if sound["mute"]:
        return "sound", m.DiagnosticStatus.WARN, "the microphone is mute", values
    return "sound", m.DiagnosticStatus.OK, "listens", values


def _wheels(wheels: Line | None, driving: Mapping[str, str]) -> _Part:
    if wheels is None:
        return "wheels", m.DiagnosticStatus.OK, "none: it stands and talks", driving
    values = {"driver": wheels["driver"], "turning": wheels["turning"], **driving}
    if wheels["fault"]:
        return "wheels", m.DiagnosticStatus.ERROR, str(wheels["fault"]), values
    return "wheels", m.DiagnosticStatus.OK, "turning" if wheels["turning"] else "standing", values


def _battery(status: Line) -> _Part:
    voltage_v = status.get("battery_v")
    if voltage_v is None:
        return "battery", m.DiagnosticStatus.OK, "not measured", {}
    low = voltage_v < WARN_BATTERY_V
    level = m.DiagnosticStatus.WARN if low else m.DiagnosticStatus.OK
    return "battery", level, "low: charge it" if low else "charged", {"voltage_v": voltage_v}


def _values(values: Mapping[str, object]) -> tuple[m.KeyValue, ...]:
    return tuple(m.KeyValue(key, str(value)) for key, value in values.items())


def task_arguments(wanted: str, rest: str) -> dict[str, Any] | None:
    """The arguments of the command `task` for a text of the topic `task`; None if it is malformed."""
    if wanted != "add":
        return {"number": int(rest)} if rest.isascii() and rest.isdigit() and len(rest) <= MAX_DIGITS else None
    task = json_object(rest) if len(rest) <= MAX_TASK_LENGTH else None
    return {"task": task} if task is not None else None
