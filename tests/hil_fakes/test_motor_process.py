"""The motors as a process: a port of a stable name, and a trail of where the robot truly is."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from dynamixel_sdk import COMM_SUCCESS, PacketHandler, PortHandler

from hil_fakes.motor_process import TrailPoint, last_point, read_trail
from hil_fakes.sound_server import wait_until

TORQUE, OPERATING_MODE, GOAL_VELOCITY = 64, 11, 104
VELOCITY_MODE = 1
PATIENCE_S = 60.0


def _taken(write: Callable[[], tuple[int, int]]) -> bool:
    return write()[0] == COMM_SUCCESS


@pytest.fixture
def motors(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    options = ["--port", str(tmp_path / "port"), "--trail", str(tmp_path / "trail"), "--pose=1.0,2.0,90"]
    command = [sys.executable, "-m", "hil_fakes.motor_process", *options]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert answer(process) == "ready"
        yield process
        process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert not (tmp_path / "port").is_symlink(), "the port outlived the motors"


def answer(process: subprocess.Popen[str], word: str = "") -> str:
    assert process.stdin is not None
    assert process.stdout is not None
    if word:
        process.stdin.write(f"{word}\n")
        process.stdin.flush()
    return process.stdout.readline().strip()


def spin(port: PortHandler) -> None:
    """Both wheels forward. A busy machine may answer too late for the SDK, so each write is tried until it is heard."""
    protocol = PacketHandler(2.0)
    for motor in (1, 2):
        for write, address, value in (
            (protocol.write1ByteTxRx, OPERATING_MODE, VELOCITY_MODE),
            (protocol.write1ByteTxRx, TORQUE, 1),
            (protocol.write4ByteTxRx, GOAL_VELOCITY, 100),
        ):
            wait_until(partial(_taken, partial(write, port, motor, address, value)), PATIENCE_S, "the motor answers")


def test_its_port_keeps_its_name_and_its_trail_tells_where_the_wheels_roll(
    motors: subprocess.Popen[str], tmp_path: Path
) -> None:
    path, trail = tmp_path / "port", tmp_path / "trail"
    wait_until(lambda: trail.stat().st_size > 0, PATIENCE_S, "the trail begins")
    first = read_trail(trail)[0]
    assert (first.x_m, first.y_m, first.torque, first.fastest_rad_s) == (1.0, 2.0, (0, 0), 0.0)

    assert answer(motors, "unplug") == "done"
    assert not path.exists()
    assert answer(motors, "replug") == "done"

    port = PortHandler(str(path))
    assert port.setBaudRate(1_000_000)
    spin(port)
    wait_until(lambda: last_point(trail).torque == (1, 1), PATIENCE_S, "both wheels are switched on")
    wait_until(lambda: last_point(trail).y_m != 2.0, PATIENCE_S, "the robot moves")
    port.closePort()
    moved = last_point(trail)
    assert moved.fastest_rad_s > 0.0
    assert moved in read_trail(trail)


def test_the_end_of_a_trail_is_its_last_whole_line(tmp_path: Path) -> None:
    path = tmp_path / "trail"
    line = '{"at_s": %d, "x_m": 0.5, "y_m": 0.0, "heading_rad": 0.0, "speeds_rad_s": [-2.0, 1.0], "torque": [1, 0]}'
    path.write_text("\n".join(line % k for k in range(50)) + '\n{"at_s": 50, "x_')
    assert last_point(path) == TrailPoint(49, 0.5, 0.0, 0.0, (-2.0, 1.0), (1, 0))
    assert read_trail(path)[-1] == last_point(path)
    assert last_point(path).fastest_rad_s == 2.0
    path.write_text("")
    with pytest.raises(ValueError, match="not moved"):
        last_point(path)
