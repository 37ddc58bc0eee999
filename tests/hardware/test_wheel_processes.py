"""A real process drives fake motors on a pty in real time, and dies."""

import signal
from collections.abc import Callable

import pytest

from hil_fakes.dynamixel.motor import turtlebot3_pair
from hil_fakes.dynamixel.opencr import FakeOpenCR
from hil_fakes.dynamixel.pump import LONGEST_STEP_S
from tests.hardware.driven import PATIENCE_S, STANDING_RAD_S, driving, five_metres, from_a_script

pytestmark = pytest.mark.slow


def test_killed_in_mid_motion_the_motors_stop_by_themselves_within_half_a_second() -> None:
    with driving(turtlebot3_pair) as driven:
        killed_s = driven.kill()
        stood_s = driven.when(lambda: driven.fastest_rad_s <= STANDING_RAD_S)
        assert stood_s - killed_s <= 0.5 + LONGEST_STEP_S
        assert driven.torque == [1, 1]  # nobody was there to switch it off: it was the watchdog


def test_killed_in_mid_motion_opencr_stops_by_its_heartbeat() -> None:
    with driving(lambda: [FakeOpenCR()]) as driven:
        killed_s = driven.kill()
        stood_s = driven.when(lambda: driven.fastest_rad_s <= STANDING_RAD_S)
        assert stood_s - killed_s <= 0.75 + LONGEST_STEP_S


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("command", [five_metres, from_a_script])
def test_a_signal_stops_the_wheels_and_switches_them_off(
    command: Callable[[str], list[str]], number: signal.Signals
) -> None:
    with driving(turtlebot3_pair, command) as driven:
        driven.process.send_signal(number)
        assert driven.process.wait(PATIENCE_S) == 130
        driven.when(lambda: driven.fastest_rad_s <= STANDING_RAD_S and driven.torque == [0, 0])
