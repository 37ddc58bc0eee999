"""A node of ROS 1 that stands for a base and for move_base, and an ear at all that the bridge publishes.

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

from hvcpd.ros.convert import ros_class
from hvcpd.ros.ros1 import find_rospy

STEP_S = 0.02
ODOM_STEPS, TRAIL_STEPS = 2, 5
"""Odometry 25 times a second, a point of the trail 10 times."""
STATUS_STEPS = 10
"""actionlib tells its status 5 times a second."""
NEAR_M = 0.02
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


class FakeMoveBase:
    """Drives the base straight ahead to the x of a goal, by actionlib's topics, and tells of it five times a second."""

    def __init__(self, rospy: Any, base: Base, record: Record) -> None:
        from actionlib_msgs.msg import GoalID, GoalStatusArray  # type: ignore[import-not-found]
        from move_base_msgs import msg  # type: ignore[import-not-found]

        self._msg, self._base, self._record = msg, base, record
        self._goal: Any = None
        self._status = rospy.Publisher("move_base/status", GoalStatusArray, queue_size=1)
        self._feedback = rospy.Publisher("move_base/feedback", msg.MoveBaseActionFeedback, queue_size=1)
        self._result = rospy.Publisher("move_base/result", msg.MoveBaseActionResult, queue_size=5)
        self._new_status = GoalStatusArray
        self._withdrawn: set[str] = set()
        rospy.Subscriber("move_base/goal", msg.MoveBaseActionGoal, self._take)
        rospy.Subscriber("move_base/cancel", GoalID, self._cancel)

    def _take(self, goal: Any) -> None:
        self._record.write("move_base", ["goal", goal.goal.target_pose.header.frame_id])
        self._goal = goal
        if goal.goal_id.id in self._withdrawn:  # a cancellation can overtake its goal
            self._end(8)

    def _cancel(self, which: Any) -> None:
        self._record.write("move_base", ["cancel", which.id])
        self._withdrawn.add(which.id)
        if self._goal is not None and which.id in ("", self._goal.goal_id.id):
            self._end(2)

    def _end(self, status: int) -> None:
        result = self._msg.MoveBaseActionResult()
        result.status.goal_id, result.status.status = self._goal.goal_id, status
        self._goal, self._base.told = None, (0.0, 0.0)
        self._result.publish(result)

    def step(self) -> None:
        """Time passes."""
        self._status.publish(self._new_status())
        if self._goal is None:
            return
        left_m = self._goal.goal.target_pose.pose.position.x - self._base.pose[0]
        feedback = self._msg.MoveBaseActionFeedback()
        feedback.status.goal_id = self._goal.goal_id
        feedback.feedback.base_position.pose.position.x = self._base.pose[0]
        self._feedback.publish(feedback)
        if left_m < NEAR_M:
            self._end(3)
        else:
            self._base.told = (min(left_m, 0.2), 0.0)


def listen(rospy: Any, base: Base, record: Record) -> None:
    """Subscribe to everything."""
    from diagnostic_msgs.msg import DiagnosticArray  # type: ignore[import-not-found]
    from geometry_msgs.msg import Twist  # type: ignore[import-not-found]
    from std_msgs.msg import Bool, String  # type: ignore[import-not-found]
    from tf2_msgs.msg import TFMessage  # type: ignore[import-not-found]

    def obey(twist: Any) -> None:
        base.told = (twist.linear.x, twist.angular.z)
        record.write("cmd_vel", base.told)

    def note(name: str, kind: Any, take: Any = lambda message: message.data) -> None:
        rospy.Subscriber(name, kind, lambda message: record.write(name, take(message)))

    rospy.Subscriber("cmd_vel", Twist, obey, tcp_nodelay=True)
    for name in ("heard", "said", "events"):
        note(name, String)
    for name in ("heard/sentence", "said/sentence"):
        note(name, ros_class("hvcpd_msgs/Sentence"), lambda m: [m.speaker, m.text, m.duration_s, m.confidence])
    note("tasks", ros_class("hvcpd_msgs/TaskArray"), lambda m: [[t.number, t.state, t.owner] for t in m.tasks])
    note("state", ros_class("hvcpd_msgs/RobotState"), lambda m: m.state)
    note("estop/state", Bool)
    note("/tf", TFMessage, lambda m: [[t.header.frame_id, t.child_frame_id, _xy(t)] for t in m.transforms])
    note("/diagnostics", DiagnosticArray, _parts)


def _xy(transform: Any) -> tuple[float, float]:
    return transform.transform.translation.x, transform.transform.translation.y


def _parts(array: Any) -> dict[str, Any]:
    return {each.name: [each.level, each.message, {v.key: v.value for v in each.values}] for each in array.status}


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
    move_base = FakeMoveBase(rospy, base, record)
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
        if step % STATUS_STEPS == 0:
            move_base.step()
        if step % TRAIL_STEPS == 0:
            record.write("pose", [*base.pose, *base.speeds])
    rospy.signal_shutdown("the input has ended")
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
