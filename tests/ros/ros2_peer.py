"""A node of a real ROS 2 beside the bridge: keeps what it hears, tells odometry, says what the standard input has.

It runs in the Python of that ROS 2, and knows nothing of hvcpd.  python ros2_peer.py RECORD
"""

from __future__ import annotations

import json
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

import rclpy  # type: ignore[import-not-found]
from diagnostic_msgs.msg import DiagnosticArray  # type: ignore[import-not-found]
from geometry_msgs.msg import Twist  # type: ignore[import-not-found]
from lifecycle_msgs.msg import Transition  # type: ignore[import-not-found]
from lifecycle_msgs.srv import ChangeState  # type: ignore[import-not-found]
from nav_msgs.msg import Odometry  # type: ignore[import-not-found]
from rclpy.qos import DurabilityPolicy, QoSProfile  # type: ignore[import-not-found]
from std_msgs.msg import Bool, String  # type: ignore[import-not-found]

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def main() -> None:
    """Live until the standard input ends."""
    rclpy.init()
    node = rclpy.create_node("peer")
    record = Path(sys.argv[1]).open("a", buffering=1)  # noqa: SIM115 - open to the end

    def note(name: str, kind: Any, take: Any, qos: Any = 10) -> None:
        def taken(message: Any) -> None:
            record.write(json.dumps({"at_s": 0.0, "kind": name, "value": take(message)}) + "\n")

        node.create_subscription(kind, name, taken, qos)

    for name in ("heard", "said"):
        note(name, String, lambda m: m.data)
    with suppress(ImportError):  # release/ros/hvcpd_msgs is not built
        from hvcpd_msgs.msg import Sentence, TaskArray  # type: ignore[import-not-found]

        note("heard/sentence", Sentence, lambda m: [m.speaker, m.confidence, [word.text for word in m.words]])
        note("tasks", TaskArray, lambda m: [[task.number, task.state] for task in m.tasks], LATCHED)
    note("estop/state", Bool, lambda m: m.data, LATCHED)
    note("cmd_vel", Twist, lambda m: [m.linear.x, m.angular.z])
    note("/diagnostics", DiagnosticArray, lambda m: [each.name for each in m.status])
    words = {"say": (node.create_publisher(String, "say", 10), String)}
    words["estop"] = (node.create_publisher(Bool, "estop", 10), Bool)
    odom = node.create_publisher(Odometry, "odom", 10)

    change = node.create_client(ChangeState, "/hvcpd/change_state")

    def changed(transition: int, answer: Any) -> None:
        value = [transition, answer.success]
        record.write(json.dumps({"at_s": 0.0, "kind": "transition", "value": value}) + "\n")

    def take_orders() -> None:
        for line in sys.stdin:
            name, value = json.loads(line)
            if name == "transition":
                change.wait_for_service(10.0)
                request = ChangeState.Request(transition=Transition(id=value))
                change.call_async(request).add_done_callback(lambda done, id=value: changed(id, done.result()))
                continue
            publisher, kind = words[name]
            publisher.publish(kind(data=value))
        rclpy.shutdown()

    def tell_odometry() -> None:
        message = Odometry()
        message.header.frame_id, message.child_frame_id = "odom", "base_link"
        message.pose.pose.position.x, message.pose.pose.position.y = 1.5, -0.5
        message.twist.twist.linear.x = 0.125
        odom.publish(message)

    threading.Thread(target=take_orders, daemon=True).start()
    node.create_timer(0.05, tell_odometry)
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.1)


if __name__ == "__main__":
    main()
