"""The delay of `heard` in ROS and the cost of the bridge, with two daemons over a private PulseAudio and two roscores.

    python -m benchmarks.ros [--sentences 12]

Late is counted from the end of a sentence at its speaker: when ROS was told `said`, and as long after as the sentence
lasts. So the speaker's and the listener's sound buffers count, as they do between real robots; their sum is told.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from itertools import permutations
from pathlib import Path
from statistics import median

from benchmarks.processes import Cost
from tests.e2e import parts, ros_robot
from tests.e2e.ros_robot import RosRobot
from tests.e2e.stage import MISSION_S, Stage, staged


def main() -> int:
    """Run part of a mission and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sentences", type=int, default=12, help="so many must be heard")
    wanted = parser.parse_args().sentences
    missing = parts.missing() or ros_robot.missing()
    if missing:
        print(f"cannot run: {missing}", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory(prefix="ros-") as place:
        folder, units = Path(place) / "stage", Path(place) / "units"
        folder.mkdir()
        units.mkdir()
        with staged(folder, units, RosRobot) as stage:
            stage.start()
            costs = {robot.name: Cost(robot.bridge.pid) for robot in stage.robots if robot.bridge is not None}
            stage.wait(lambda: sum(len(r.seen("heard")) for r in stage.robots) >= wanted, MISSION_S, "enough is heard")
            _print_latency(stage)
            for name, cost in costs.items():
                print(f"bridge of {name}: {cost}")
    return 0


def _print_latency(stage: Stage[RosRobot]) -> None:
    late_s = sorted(
        each for listener, speaker in permutations(stage.robots) for each in _latencies_s(listener, speaker)
    )
    sound_s = sum(float(robot.events("listening")[0]["latency_s"]) for robot in stage.robots) / len(stage.robots)
    print(f"`heard` after the end of the sentence, {len(late_s)} sentences:")
    print(f"  median {median(late_s):.2f} s, fastest {late_s[0]:.2f} s, slowest {late_s[-1]:.2f} s")
    print(f"  of it in sound buffers, as the daemons estimate: {sound_s:.2f} s")


def _latencies_s(listener: RosRobot, speaker: RosRobot) -> list[float]:
    """From the end of each sentence to the moment when ROS was told that it was heard."""
    ends = []
    for told_s, (_, text, duration_s, _) in speaker.seen("said/sentence"):
        ends.append((text, told_s + duration_s))
    found = []
    for heard_s, text in listener.seen("heard"):
        before = [end_s for sentence, end_s in ends if sentence == text and end_s < heard_s + 1.0]
        found += [heard_s - before[-1]] if before else []
    return found


if __name__ == "__main__":
    sys.exit(main())
