"""A real process drives fake motors on a pty in real time, and dies."""

import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from types import TracebackType

import pytest

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import FakeXL430, turtlebot3_pair
from hil_fakes.dynamixel.opencr import FakeOpenCR
from hil_fakes.dynamixel.pump import RealTimePump

PATIENCE_S = 30.0
FAST_RAD_S = 3.0
STANDING_RAD_S = 0.05


class Driven:
    """A process that drives 5 m on these devices; `when` waits until the motors do something."""

    def __init__(self, *devices: FakeXL430 | FakeOpenCR) -> None:
        self.bus = FakeBus(devices, seed=1)
        self._motors = [*self.bus.motors.values()] or [
            m for d in devices if isinstance(d, FakeOpenCR) for m in (d.left, d.right)
        ]
        self._changed = threading.Condition()
        self.longest_step_s = 0.0
        """Of the motors' time: so coarse is the clock on a loaded machine."""
        self._pump = RealTimePump(self._advance)
        self._command = [sys.executable, "-m", "hvcpd.control.cli", "drive", "forward", "5", "--port", self.bus.path]

    def __enter__(self) -> "Driven":
        self._pump.__enter__()
        self.process = subprocess.Popen(self._command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.process.kill()
        self.process.communicate()
        self._pump.__exit__(kind, error, trace)
        self.bus.close()

    @property
    def fastest_rad_s(self) -> float:
        return max(abs(motor.true_speed_rad_s) for motor in self._motors)

    @property
    def torque(self) -> list[int]:
        return [motor.memory.get("torque_enable") for motor in self._motors]

    def kill(self) -> float:
        """kill -9; the motors' time (s) at which it was sent."""
        with self._changed:
            self.longest_step_s = 0.0
        self.process.send_signal(signal.SIGKILL)
        return self.bus.line.now_s

    def when(self, condition: Callable[[], bool]) -> float:
        """The motors' time (s) at which the condition holds."""
        with self._changed:
            assert self._changed.wait_for(condition, PATIENCE_S), self.process.poll()
            return self.bus.line.now_s

    def _advance(self, dt_s: float) -> None:
        with self._changed:
            self.longest_step_s = max(self.longest_step_s, dt_s)
            self.bus.advance(dt_s)
            self._changed.notify_all()


def test_killed_in_mid_motion_the_motors_stop_by_themselves_within_half_a_second() -> None:
    with Driven(*turtlebot3_pair()) as driven:
        driven.when(lambda: driven.fastest_rad_s > FAST_RAD_S)
        killed_s = driven.kill()
        stood_s = driven.when(lambda: driven.fastest_rad_s <= STANDING_RAD_S)
        assert stood_s - killed_s <= 0.5 + driven.longest_step_s
        assert driven.torque == [1, 1]  # nobody was there to switch it off: it was the watchdog


def test_killed_in_mid_motion_opencr_stops_by_its_heartbeat() -> None:
    with Driven(FakeOpenCR()) as driven:
        driven.when(lambda: driven.fastest_rad_s > FAST_RAD_S)
        killed_s = driven.kill()
        stood_s = driven.when(lambda: driven.fastest_rad_s <= STANDING_RAD_S)
        assert stood_s - killed_s <= 0.75 + driven.longest_step_s


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_stops_the_wheels_and_switches_them_off(number: signal.Signals) -> None:
    with Driven(*turtlebot3_pair()) as driven:
        driven.when(lambda: driven.fastest_rad_s > 1.0)
        driven.process.send_signal(number)
        assert driven.process.wait(PATIENCE_S) == 130
        driven.when(lambda: driven.fastest_rad_s <= STANDING_RAD_S and driven.torque == [0, 0])
