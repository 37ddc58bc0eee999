"""The daemon as a real process dies in mid-motion: its motors stop by themselves."""

import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from hil_fakes.dynamixel.motor import FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.opencr import FakeOpenCR
from hil_fakes.dynamixel.pump import LONGEST_STEP_S
from tests.hardware.driven import FAST_RAD_S, STANDING_RAD_S, Driven

MOTORS_S = 0.5
OPENCR_S = 0.75
"""The controller's own half second of silence and one or two periods of 20 ms, and then the wheels come to a stand."""

Make = Callable[[], Sequence[FakeMotor | FakeOpenCR]]


def opencr() -> Sequence[FakeOpenCR]:
    return (FakeOpenCR(),)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "number", "limit_s"),
    [
        (turtlebot3_pair, signal.SIGKILL, MOTORS_S),
        (turtlebot3_pair, signal.SIGSTOP, MOTORS_S),
        (opencr, signal.SIGKILL, OPENCR_S),
    ],
    ids=["dynamixel-killed", "dynamixel-frozen", "opencr-killed"],
)
def test_the_motors_stop_when_the_daemon_is_no_more(
    make: Make, number: signal.Signals, limit_s: float, tmp_path: Path, units: Path, compared: Path
) -> None:
    (tmp_path / "state").mkdir()
    (tmp_path / "state" / "units").symlink_to(units)
    (tmp_path / "state" / "vocabulary").symlink_to(compared)

    def command(port: str) -> list[str]:
        config = tmp_path / "hvcpd.yaml"
        alone = "names: [Rob]\nwaits: {answer_s: 2}\n"  # so it does not wait long for an answer
        config.write_text(f"state_dir: {tmp_path / 'state'}\nwheels: {{port: {port}}}\nseed: 1\n{alone}")
        return [sys.executable, "-m", "tests.daemon.quiet_robot", "--config", str(config), "--name", "Rob"]

    with Driven(*make(), command=command) as driven:
        driven.when(lambda: driven.fastest_rad_s > FAST_RAD_S)  # it has claimed a task, and drives to it
        dead_s = driven.kill(number)
        stood_s = driven.when(lambda: driven.fastest_rad_s <= STANDING_RAD_S)
    assert stood_s - dead_s <= limit_s + LONGEST_STEP_S
    assert stood_s - dead_s > 0.1, "it was standing before"
