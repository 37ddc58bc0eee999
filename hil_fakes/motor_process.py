"""Two fake wheel motors on a pseudo-terminal of a stable name, in real time, as a process of its own.

python -m hil_fakes.motor_process --port PATH --trail FILE --pose X_M,Y_M,HEADING_DEG

Says "ready" once the port is there. Takes "unplug" and "replug", a line each, from its standard input, says "done"
after each, and ends with the input. The trail is one JSON object a line, twenty a second: where the robot truly is,
and how fast its wheels truly turn.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TextIO

from cattrs import structure

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.pump import RealTimePump
from hil_fakes.true_pose import TruePose, TrueWheels
from hvcpd.ports import Pose

PERIOD_S = 0.05
"""Between two lines of the trail."""
LINES_BYTES = 1024
"""More than two lines of the trail."""


@dataclass(frozen=True)
class TrailPoint:
    """`at_s` is the machine's monotonic clock, the same for all processes; speeds and torque are left, right."""

    at_s: float
    x_m: float
    y_m: float
    heading_rad: float
    speeds_rad_s: tuple[float, float]
    torque: tuple[int, int]

    @property
    def fastest_rad_s(self) -> float:
        """Of the faster wheel."""
        return max(map(abs, self.speeds_rad_s))


def read_trail(path: Path) -> tuple[TrailPoint, ...]:
    """The trail until now; a line that is still being written is left out."""
    return tuple(structure(json.loads(line), TrailPoint) for line in path.read_text().split("\n")[:-1])


def last_point(path: Path) -> TrailPoint:
    """The end of the trail. Raises ValueError if there is none yet."""
    with path.open("rb") as file:
        file.seek(max(file.seek(0, os.SEEK_END) - LINES_BYTES, 0))
        lines = file.read().split(b"\n")[:-1]
    if not lines:
        raise ValueError(f"{path}: the motors have not moved yet")
    return structure(json.loads(lines[-1]), TrailPoint)


class _Trail:
    """Writes where the motors have brought the robot."""

    def __init__(self, bus: FakeBus, motors: tuple[FakeMotor, FakeMotor], start: Pose, file: TextIO) -> None:
        self._bus = bus
        self._motors = motors
        self._file = file
        self._truth = TruePose(start, motors, TrueWheels())
        self._due_s = 0.0

    def advance(self, dt_s: float) -> None:
        """Let the motors' time pass."""
        self._bus.advance(dt_s)
        self._truth.follow()
        now_s = time.monotonic()
        if now_s < self._due_s:
            return
        self._due_s = now_s + PERIOD_S
        pose, (left, right) = self._truth.pose, self._motors
        speeds = left.true_speed_rad_s, right.true_speed_rad_s
        torque = left.memory.get("torque_enable"), right.memory.get("torque_enable")
        point = TrailPoint(now_s, pose.x_m, pose.y_m, pose.heading_rad, speeds, torque)
        self._file.write(json.dumps(asdict(point)) + "\n")
        self._file.flush()


def _pose(text: str) -> Pose:
    x_m, y_m, heading_deg = (float(part) for part in text.split(","))
    return Pose(x_m, y_m, math.radians(heading_deg))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the process."""
    parser = argparse.ArgumentParser(prog="hil_fakes.motor_process", description="Fake wheels on a serial port.")
    parser.add_argument("--port", type=Path, required=True, help="what the port is to be called")
    parser.add_argument("--trail", type=Path, required=True, help="the file for where the robot truly is")
    parser.add_argument("--pose", type=_pose, default=Pose(0.0, 0.0), help="x, y in m, heading in degrees")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    motors = turtlebot3_pair()
    with FakeBus(motors, options.seed, options.port) as bus, options.trail.open("w") as file:
        deeds = {"unplug": bus.unplug, "replug": bus.replug}
        with RealTimePump(_Trail(bus, motors, options.pose, file).advance):
            _say("ready")
            for line in sys.stdin:
                deeds[line.strip()]()
                _say("done")
    return 0


def _say(word: str) -> None:
    sys.stdout.write(f"{word}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
