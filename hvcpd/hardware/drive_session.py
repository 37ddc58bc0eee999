"""Drives one robot by hand, without the daemon: a journey at a time, in real time or rehearsed. One thread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hvcpd.errors import DeviceError
from hvcpd.hardware.kinematics import BURGER, Drive, Odometry, Twist, twist_of
from hvcpd.hardware.motion import MotionState
from hvcpd.hardware.navigator import Journey, Navigator
from hvcpd.ports import STANDSTILL, Pose, WheelCommand, WheelReading, Wheels

PERIOD_S = 0.05
"""As the daemon does."""


@dataclass(frozen=True)
class Snapshot:
    """One moment of a journey. `reading` is None while the wheels do not answer; `fault` then says why."""

    at_s: float
    pose: Pose
    twist: Twist
    progress: float
    state: MotionState
    reading: WheelReading | None
    fault: str = ""


class DriveSession:
    """Wheels, odometry from (0, 0, 0) on, and a navigator. `clock` in s, `sleep` takes s."""

    def __init__(
        self, wheels: Wheels, clock: Callable[[], float], sleep: Callable[[float], None], drive: Drive = BURGER
    ) -> None:
        self.odometry = Odometry(Pose(0.0, 0.0), drive)
        self.navigator = Navigator(drive)
        self._wheels = wheels
        self._drive = drive
        self._clock = clock
        self._sleep = sleep
        self.fault = ""
        """Why the wheels did not answer at the last exchange; empty if they did."""
        self.way_m = 0.0
        """How far the robot's middle has moved so far."""

    @property
    def reason(self) -> str:
        """Why the last journey failed, and the wheels' last fault; empty if all is well."""
        return "; ".join(text for text in (self.navigator.reason, self.fault) if text)

    def carry_out(self, journey: Journey, show: Callable[[Snapshot], None] = lambda _moment: None) -> MotionState:
        """Drive until it has arrived or failed (`navigator.reason` says why). The wheels stand when this returns."""
        self.navigator.start(journey, self.odometry.pose)
        reading = self._exchange(STANDSTILL)
        start_s = due_s = self._clock()
        try:
            while self.navigator.state is MotionState.MOVING:
                command = self.navigator.step(self.odometry.pose, self._clock(), reading)
                reading = self._exchange(command)
                show(self._snapshot(self._clock() - start_s, command, reading))
                due_s = max(due_s + PERIOD_S, self._clock())
                self._sleep(max(due_s - self._clock(), 0.0))
        finally:
            self._exchange(STANDSTILL)
        return self.navigator.state

    def rest(self, duration_s: float) -> None:
        """Stand for a while, the odometry goes on."""
        end_s = self._clock() + duration_s
        while self._clock() < end_s:
            self._exchange(STANDSTILL)
            self._sleep(PERIOD_S)

    def _exchange(self, command: WheelCommand) -> WheelReading | None:
        try:
            reading = self._wheels.exchange(command)
        except DeviceError as error:
            self.fault = str(error)
            return None
        self.fault = ""
        before = self.odometry.pose
        now = self.odometry.update(reading)
        self.way_m += ((now.x_m - before.x_m) ** 2 + (now.y_m - before.y_m) ** 2) ** 0.5
        return reading

    def _snapshot(self, at_s: float, command: WheelCommand, reading: WheelReading | None) -> Snapshot:
        navigator = self.navigator
        return Snapshot(
            at_s,
            self.odometry.pose,
            twist_of(command, self._drive),
            navigator.progress,
            navigator.state,
            reading,
            self.fault or navigator.reason,
        )


class RehearsedWheels:
    """Ideal wheels in virtual time, which passes only in `sleep`: to see what a robot would do."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self._command = STANDSTILL
        self._left_rad = self._right_rad = 0.0

    def clock(self) -> float:
        """The rehearsal's time, s."""
        return self.now_s

    def sleep(self, duration_s: float) -> None:
        """Let the wheels turn for a while."""
        self.now_s += duration_s
        self._left_rad += self._command.left_rad_s * duration_s
        self._right_rad += self._command.right_rad_s * duration_s

    def open(self) -> None:
        """Nothing to open."""

    def exchange(self, command: WheelCommand) -> WheelReading:
        """Set the speeds from now on."""
        self._command = command
        return WheelReading(self._left_rad, self._right_rad, command.left_rad_s, command.right_rad_s)

    def close(self) -> None:
        """Nothing to close."""
