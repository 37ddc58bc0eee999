"""A wheeled robot in virtual time: fake devices on a line in memory, the daemon's own driver and odometry on it.

An hour of driving takes seconds, and a reply that does not come costs virtual time only. For tests of drivers and of
whatever moves a robot; nothing in it is patched, the port is handed to the driver.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from hil_fakes.dynamixel.line import Line
from hil_fakes.dynamixel.motor import FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.opencr import FakeOpenCR
from hil_fakes.dynamixel.virtual import VirtualPort, VirtualTime
from hil_fakes.true_pose import TruePose, TrueWheels
from hvcpd.hardware.kinematics import BURGER, Drive, Odometry
from hvcpd.hardware.motion import MotionState
from hvcpd.hardware.navigator import Journey, Navigator
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.hardware.wheels_base import BusWheels
from hvcpd.hardware.wheels_opencr import OpenCRWheels
from hvcpd.ports import STANDSTILL, Pose, WheelCommand, WheelReading

Kind = Literal["dynamixel", "opencr"]
PERIOD_S = 0.05
"""Interval of exchanges with a moving robot's wheels: that of ROBOTIS's own node."""
LIMIT_S = 300.0
"""Time for a journey."""


class VirtualRobot:
    """`motors` are the left and the right one, `pose` is the true one; `robot.wheels` is the driver under test.

    `drive` has the dimensions that the robot believes in, `truth` the true ones.
    """

    def __init__(
        self, kind: Kind = "dynamixel", seed: int = 0, drive: Drive = BURGER, truth: TrueWheels | None = None
    ) -> None:
        self.motors: tuple[FakeMotor, FakeMotor] = turtlebot3_pair()
        self.controller = FakeOpenCR(self.motors) if kind == "opencr" else None
        self.line = Line([self.controller] if self.controller is not None else self.motors, seed)
        self.time = VirtualTime()
        self.port: VirtualPort
        driver = OpenCRWheels if kind == "opencr" else DynamixelWheels
        self.wheels: BusWheels = driver("virtual", clock=self.time, make_port=self._make_port)
        self.odometry = Odometry(Pose(0.0, 0.0), drive)
        self.navigator = Navigator(drive)
        self._body = TruePose(Pose(0.0, 0.0), self.motors, truth or TrueWheels())
        self.time.follow(lambda _dt_s: self._body.follow())

    @property
    def pose(self) -> Pose:
        """Where it truly is; the heading counts whole turns."""
        return self._body.pose

    @property
    def fastest_rad_s(self) -> float:
        """The true speed of the faster wheel."""
        return max(abs(motor.true_speed_rad_s) for motor in self.motors)

    def exchange(self, command: WheelCommand) -> WheelReading:
        """One exchange, taken into the odometry."""
        reading = self.wheels.exchange(command)
        self.odometry.update(reading)
        return reading

    def cycle(self, command: WheelCommand, dt_s: float = PERIOD_S) -> WheelReading:
        """One exchange, and then time passes."""
        reading = self.exchange(command)
        self.time.advance(dt_s)
        return reading

    def run(self, command: WheelCommand, duration_s: float) -> WheelReading:
        """Give the same command for a while; return the last reading."""
        for _ in range(max(round(duration_s / PERIOD_S), 1)):
            reading = self.cycle(command)
        return reading

    def carry_out(self, journey: Journey, each: Callable[[], None] = lambda: None) -> MotionState:
        """Let the navigator drive until it has done with the journey; `each` is called after every cycle."""
        self.navigator.start(journey, self.odometry.pose)
        reading = self.cycle(STANDSTILL)
        end_s = self.time.now_s + LIMIT_S
        while self.navigator.state is MotionState.MOVING and self.time.now_s < end_s:
            reading = self.cycle(self.navigator.step(self.odometry.pose, self.time.now_s, reading))
            each()
        self.run(STANDSTILL, 0.3)
        return self.navigator.state

    def _make_port(self, _path: str, baud_rate: int, timeout_s: float) -> VirtualPort:
        self.port = VirtualPort(self.line, self.time, baud_rate, timeout_s)
        return self.port
