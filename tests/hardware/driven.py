"""A real process that drives fake motors on a pty in real time."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import TracebackType

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import FakeMotor
from hil_fakes.dynamixel.opencr import FakeOpenCR
from hil_fakes.dynamixel.pump import RealTimePump
from tests.undisturbed import undisturbed

PATIENCE_S = 150.0
ATTEMPTS = 3
FAST_RAD_S = 3.0
STANDING_RAD_S = 0.05


def five_metres(port: str) -> list[str]:
    """The command that drives 5 m."""
    return [sys.executable, "-m", "hvcpd.control.cli", "drive", "forward", "5", "--port", port]


def from_a_script(port: str) -> list[str]:
    """The same as a shell starts it in the background: deaf to SIGINT."""
    return ["sh", "-c", 'trap "" INT; exec "$@"', "sh", *five_metres(port)]


@contextmanager
def driving(
    devices: Callable[[], Sequence[FakeMotor | FakeOpenCR]], command: Callable[[str], Sequence[str]] = five_metres
) -> Iterator[Driven]:
    """A process that drives such devices, begun again if it refuses to."""
    for _ in range(ATTEMPTS):
        with Driven(*devices(), command=command) as driven:
            if driven.sets_out():
                yield driven
                return
    raise AssertionError("it never drove")


class Driven:
    """A process that drives these devices, by `command` of the port; `when` waits until the motors do something."""

    def __init__(self, *devices: FakeMotor | FakeOpenCR, command: Callable[[str], Sequence[str]] = five_metres) -> None:
        self.bus = FakeBus(devices, seed=1)
        self._motors = [*self.bus.motors.values()] or [
            m for d in devices if isinstance(d, FakeOpenCR) for m in (d.left, d.right)
        ]
        self._changed = threading.Condition()
        self._pump = RealTimePump(self._advance)
        self._command = command(self.bus.path)
        self._quiet = undisturbed()

    def __enter__(self) -> Driven:
        self._quiet.__enter__()
        self._pump.__enter__()
        self.process = subprocess.Popen(self._command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.process.kill()
        self.process.communicate()
        self._pump.__exit__(kind, error, trace)
        self._quiet.__exit__(kind, error, trace)
        self.bus.close()

    @property
    def fastest_rad_s(self) -> float:
        return max(abs(motor.true_speed_rad_s) for motor in self._motors)

    @property
    def torque(self) -> list[int]:
        return [motor.memory.get("torque_enable") for motor in self._motors]

    def kill(self, number: signal.Signals = signal.SIGKILL) -> float:
        """kill -9, or SIGSTOP; the motors' time (s) at which the process has ceased and its last words are heard.

        On a busy machine a process may run on for a while after it was sent a signal.
        """
        self.process.send_signal(number)
        os.waitid(os.P_PID, self.process.pid, os.WEXITED | os.WSTOPPED | os.WNOWAIT)
        return self.when(lambda: self.bus.caught_up)

    def when(self, condition: Callable[[], bool]) -> float:
        """The motors' time (s) at which the condition holds."""
        with self._changed:
            assert self._changed.wait_for(condition, PATIENCE_S), self._account()
            return self.bus.line.now_s

    def sets_out(self) -> bool:
        """Whether it drives. It refuses to if a fake on a busy machine answers late, as OpenCR does whose motors are
        gone."""
        self.when(lambda: self.fastest_rad_s > FAST_RAD_S or self.process.poll() is not None)
        if self.process.poll() is None:
            return True
        account = self._account()
        assert any(reason in account for reason in ("answers late", "nothing answers", "no answer")), account
        return False

    def _account(self) -> str:
        """How the process ended, if it has, and its last words."""
        status = self.process.poll()
        self.process.kill()
        return f"exit status {status}: {self.process.communicate()[1][-2000:]}"

    def _advance(self, dt_s: float) -> None:
        with self._changed:
            self.bus.advance(dt_s)
            self._changed.notify_all()
