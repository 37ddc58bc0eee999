"""A node of ROS 1 that stands for a base, and an ear at all that the bridge publishes. It knows nothing of hvcpd.

As a TurtleBot3's own node it goes on with the last `cmd_vel` for ever. What it sees is written to a file, one JSON
object a line; sentences for `say` come on the standard input, and with its end the node ends.

python -m tests.e2e.ros_base --record FILE --pose=X,Y,HEADING
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import threading
import time
from pathlib import Path
from typing import Any

from hvcpd.ros.ros1 import find_rospy

STEP_S = 0.02
ODOM_STEPS, TRAIL_STEPS = 2, 5
"""Odometry 25 times a second, a point of the trail 10 times."""
LAG_S = 0.1
"""The wheels follow what they are told like that, as a TurtleBot3's do."""


class Base:
    """A unicycle. `told` are the speeds wanted: m/s, rad/s."""

    def __init__(self, x_m: float, y_m: float, heading_rad: float) -> None:
        self.pose = [x_m, y_m, heading_rad]
        self.told = (0.0, 0.0)
        self.speeds = [0.0, 0.0]

    def advance(self, dt_s: float) -> None:
        """Time passes."""
        for axis in (0, 1):
            self.speeds[axis] += (self.told[axis] - self.speeds[axis]) * min(dt_s / LAG_S, 1.0)
        self.pose[0] += self.speeds[0] * math.cos(self.pose[2]) * dt_s
        self.pose[1] += self.speeds[0] * math.sin(self.pose[2]) * dt_s
        self.pose[2] += self.speeds[1] * dt_s


class Record:
    """The file; written from several threads."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("a", buffering=1)
        self._lock = threading.Lock()

    def write(self, kind: str, value: object) -> None:
        with self._lock:
            self._file.write(json.dumps({"at_s": time.monotonic(), "kind": kind, "value": value}) + "\n")


def listen(rospy: Any, base: Base, record: Record) -> None:
    """Subscribe to everything."""
    from diagnostic_msgs.msg import DiagnosticArray  # type: ignore[import-not-found]
    from geometry_msgs.msg import Twist  # type: ignore[import-not-found]
    from std_msgs.msg import Bool, String  # type: ignore[import-not-found]

    def obey(twist: Any) -> None:
        base.told = (twist.linear.x, twist.angular.z)
        record.write("cmd_vel", base.told)

    def note(name: str, kind: Any, take: Any = lambda message: message.data) -> None:
        rospy.Subscriber(name, kind, lambda message: record.write(name, take(message)))

    rospy.Subscriber("cmd_vel", Twist, obey, tcp_nodelay=True)
    for name in ("heard", "heard/json", "said", "said/json", "events", "tasks", "state"):
        note(name, String)
    note("estop/state", Bool)
    note("/diagnostics", DiagnosticArray, lambda m: {each.name: [each.level, each.message] for each in m.status})


def main() -> int:
    """Be a base until the standard input ends."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--record", type=Path, required=True)
    parser.add_argument("--pose", default="0,0,0")
    options = parser.parse_args()
    assert find_rospy()
    import rospy  # type: ignore[import-not-found]
    from nav_msgs.msg import Odometry  # type: ignore[import-not-found]
    from std_msgs.msg import Bool, String  # type: ignore[import-not-found]

    rospy.init_node("base", disable_signals=True)
    base, record = Base(*map(float, options.pose.split(","))), Record(options.record)
    listen(rospy, base, record)
    odom = rospy.Publisher("odom", Odometry, queue_size=1, tcp_nodelay=True)
    words = {"say": rospy.Publisher("say", String, queue_size=5), "estop": rospy.Publisher("estop", Bool, queue_size=5)}
    over = threading.Event()

    def take_orders() -> None:
        for line in sys.stdin:
            name, value = json.loads(line)
            words[name].publish(value)
        over.set()

    threading.Thread(target=take_orders, daemon=True).start()
    step, begun_s = 0, time.monotonic()
    while not over.wait(max(begun_s + step * STEP_S - time.monotonic(), 0.0)):
        base.advance(STEP_S)
        step += 1
        if step % ODOM_STEPS == 0:
            odom.publish(_odometry(Odometry(), rospy.Time.now(), base))
        if step % TRAIL_STEPS == 0:
            record.write("pose", [*base.pose, *base.speeds])
    return 0


def _odometry(message: Any, stamp: Any, base: Base) -> Any:
    message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, "odom", "base_link"
    message.pose.pose.position.x, message.pose.pose.position.y = base.pose[:2]
    message.pose.pose.orientation.z = math.sin(base.pose[2] / 2)
    message.pose.pose.orientation.w = math.cos(base.pose[2] / 2)
    message.twist.twist.linear.x, message.twist.twist.angular.z = base.speeds
    return message


if __name__ == "__main__":
    sys.exit(main())
