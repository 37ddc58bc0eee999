"""A bridge without ROS and without sockets, and what daemons and bases tell it."""

from __future__ import annotations

from typing import Any

from hvcpd.ros import messages as m
from hvcpd.ros.bridge import Ask, Bridge, Output, Publish
from hvcpd.ros.parameters import Parameters
from hvcpd.ros.topics import Topic

STATUS: dict[str, Any] = {
    "name": "Rob",
    "team": "plant",
    "mode": "volunteer",
    "version": "1",
    "pid": 1,
    "uptime_s": 5.0,
    "wall_s": 0.0,
    "state": "ready",
    "doing": "is looking for work",
    "stopped": False,
    "now_s": 20.0,
    "task": {"number": 2, "name": "water the green rose"},
    "peers": [{"name": "Bot", "present": True}, {"name": "Max", "present": False}],
    "battery_v": 10.9,
    "sound": {"listening": True, "level_dbfs": -60.0, "floor_dbfs": -70.0, "mute": False, "lost": {}},
    "wheels": {"driver": "ros", "turning": False, "fault": None},
}
HEARD = {
    "event": "heard",
    "at_s": 21.0,
    "utterance": None,
    "listener": "Rob",
    "speaker": "Bot",
    "text": "Hi Rob, I am Bot, confirmed four",
    "confidence": 0.93,
    "snr_db": 30.0,
    "words": [["hi", 21.0, 21.3], ["four", 23.0, 23.4]],
}
AT_S, STAMP_S = 50.0, 1_000.25


class Talk:
    """A bridge, and what it put out."""

    def __init__(self, ros_drives: bool = True, parameters: Parameters | None = None) -> None:
        self.bridge = Bridge(ros_drives, parameters or Parameters())
        self.out: list[Output] = []
        self.begin()

    def begin(self) -> list[Output]:
        """A daemon is there."""
        self.bridge.begin(AT_S)
        return self._fetch()

    def answer(self, command: str, result: dict[str, Any] | None = None, **error: str) -> list[Output]:
        """The daemon replies to the last request of that command."""
        mark = [each.id for each in self.out if isinstance(each, Ask) and each.command == command][-1]
        reply = {"id": mark, "ok": not error, "result": result, "error": error}
        return self.daemon(reply)

    def daemon(self, line: dict[str, Any], now_s: float = AT_S) -> list[Output]:
        self.bridge.from_daemon(line, now_s, STAMP_S)
        return self._fetch()

    def ros(self, topic: Topic, message: m.Message, now_s: float = AT_S) -> list[Output]:
        self.bridge.from_ros(topic, message, now_s)
        return self._fetch()

    def tick(self, now_s: float) -> list[Output]:
        self.bridge.tick(now_s, STAMP_S)
        return self._fetch()

    def _fetch(self) -> list[Output]:
        new = self.bridge.outputs()
        self.out += new
        return new


def on(topic: Topic, outputs: list[Output]) -> list[m.Message]:
    return [each.message for each in outputs if isinstance(each, Publish) and each.topic == topic]


def asked(command: str, outputs: list[Output]) -> list[dict[str, Any]]:
    return [dict(each.arguments) for each in outputs if isinstance(each, Ask) and each.command == command]


def moving(linear: float, goal: int | None = None, stopped: bool = False) -> dict[str, Any]:
    to = None if goal is None else {"number": goal, "x_m": 3.0, "y_m": 4.0}
    return {"event": "drive", "at_s": 1.0, "linear_m_s": linear, "angular_rad_s": 0.5, "stopped": stopped, "goal": to}


def odometry(x_m: float, heading_rad: float) -> m.Odometry:
    pose = m.Pose(m.Point(x_m, 2.0, 0.0), m.Quaternion.about_z(heading_rad))
    speeds = m.Twist(m.Vector3(0.1), m.Vector3(z=-0.2))
    return m.Odometry(m.Header(frame_id="odom"), "base_link", m.PoseWithCovariance(pose), m.TwistWithCovariance(speeds))
