"""The delay of the bridge alone: from an event of the daemon to a subscribed ROS 1 node, and back for odometry.

    python -m benchmarks.ros_bridge [--events 200]

A real roscore and a real `hvcpctl ros`; in the daemon's place its control socket alone, with 20 commands to the base a
second, and a fake base that answers with 25 words of odometry.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from statistics import median, quantiles

from benchmarks.processes import Cost
from hil_fakes.sound_server import wait_until
from tests.e2e import ros_robot
from tests.e2e.ros_robot import Roscore, read_record
from tests.ros.live import BRIDGE, bridge_to, daemon_at, running
from tests.ros.talk import HEARD, moving

WAIT_S = 60.0
COMMAND_S = 0.05
EVENTS_APART = 4
"""Commands between two sentences, so that none waits for another."""


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--events", type=int, default=200, help="sentences")
    events = parser.parse_args().events
    if ros_robot.missing():
        print(f"cannot run: {ros_robot.missing()}", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory(prefix="ros-") as place, ExitStack() as stack:
        folder = Path(place)
        record = folder / "ros.jsonl"
        core = Roscore(folder, "core")
        stack.callback(core.close)
        wait_until(core.answers, WAIT_S, "there is a master")
        daemon = stack.enter_context(daemon_at(folder / "d.sock", "cmd_vel"))
        base = [sys.executable, "-m", "tests.e2e.ros_base", "--record", str(record)]
        stack.enter_context(running(base, core.environment, folder / "base.log"))
        command = (*BRIDGE, "--ros", "1", "--socket", str(daemon.path))
        bridge = stack.enter_context(bridge_to(daemon, core.environment, command))
        wait_until(lambda: any("x_m" in each for each in daemon.arguments("base")), WAIT_S, "odometry comes")
        told_s, cost, pause = [], Cost(bridge.pid), threading.Event()
        for k in range(events * EVENTS_APART):
            daemon.tell(moving(0.1))
            if k % EVENTS_APART == 0:
                told_s.append(time.monotonic())
                daemon.tell({**HEARD, "text": f"sentence {k // EVENTS_APART}"})
            pause.wait(COMMAND_S)
        words = len([each for each in daemon.arguments("base") if "x_m" in each])
        print(f"odometry: {words / cost.passed_s:.1f} words a second reach the daemon")
        print(f"the bridge: {cost}")
        _print_latency(told_s, read_record(record, "heard"))
    return 0


def _print_latency(told_s: list[float], heard: list[tuple[float, str]]) -> None:
    late_ms = [1000.0 * (at_s - told_s[int(text.split()[1])]) for at_s, text in heard]
    most = quantiles(late_ms, n=20)[-1]
    print(f"from the daemon's event to a subscriber, {len(late_ms)} of {len(told_s)} sentences:")
    print(f"  median {median(late_ms):.1f} ms, 95 % below {most:.1f} ms, slowest {max(late_ms):.1f} ms")


if __name__ == "__main__":
    sys.exit(main())
