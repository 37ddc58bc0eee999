"""One journey under a schedule of faults, in virtual time, and the invariants that must hold throughout.

- After every fault that calls for it the wheels stand within a limit.
- No wheel turns faster than its recent commands, and none turns without a command.
- Nothing but DeviceError leaves the driver; the journey ends, arrived or failed; then the wheels stand.
- A robot that has arrived is where it believes to be.
"""

from __future__ import annotations

import math
import random
from collections import deque
from dataclasses import dataclass, field

from hil_fakes.dynamixel.motor import SHUTDOWN_OVERLOAD
from hil_fakes.fault_schedule import STOPS, Event, Fault, schedule
from hil_fakes.virtual_robot import PERIOD_S, Kind, VirtualRobot
from hvcpd.errors import DeviceError
from hvcpd.hardware.motion import MotionState, Turn
from hvcpd.hardware.navigator import Dock, Journey, Waypoints
from hvcpd.hardware.stall import LEAST_COMMAND_RAD_S
from hvcpd.hardware.wheels_sense import SUSTAINED_S
from hvcpd.ports import STANDSTILL, Pose, WheelCommand, WheelReading

STOP_LIMIT_S = 0.5
"""After every fault of which the driver, or a motor's watchdog, can know."""
SILENT_LIMIT_S = 0.75
"""OpenCR that no longer receives commands: its own limit is half a second of silence and up to two of its 20 ms
periods, and then the wheels still have to come to a stand; nothing that we sent before can make it shorter."""
SILENT = frozenset({Fault.HANG, Fault.UNPLUG})
SLOW_LIMIT_S = 1.25
"""OpenCR with a dead motor: its loop then takes half a second and one packet from us; the second one is our stop."""
STANDING_RAD_S = 0.05
"""1.7 mm/s at the rim; encoder and gear play are no more."""
MEMORY_S = {"dynamixel": 0.6, "opencr": 1.35}
"""Largest age of a command that can explain a speed: the longest stop limit and two control periods."""
LIMIT_S = 120.0
ODOMETRY_M = 0.05
LOW_V = 10.2
STANDING_EVERY = 4
"""Standing wheels are served every 200 ms, as on the bench."""


def stop_limit_s(kind: Kind, fault: Fault) -> float:
    """Within how many seconds of such a fault the wheels must stand."""
    if kind == "opencr":
        return SLOW_LIMIT_S if fault is Fault.DEAD_MOTOR else SILENT_LIMIT_S if fault in SILENT else STOP_LIMIT_S
    return STOP_LIMIT_S


@dataclass
class Verdict:
    """The result of a trial; `broken` names every rule that was broken."""

    seed: int
    kind: Kind
    events: list[Event]
    state: MotionState = MotionState.IDLE
    reason: str = ""
    virtual_s: float = 0.0
    stop_s: dict[Fault, float] = field(default_factory=dict)
    """Longest time from a fault of each kind that called for it until the wheels stood."""
    broken: list[str] = field(default_factory=list)


class Trial:
    """Runs one journey; see the module."""

    def __init__(self, seed: int, kind: Kind = "dynamixel") -> None:
        self.verdict = Verdict(seed, kind, schedule(seed))
        self.robot = VirtualRobot(kind, seed)
        self.robot.time.follow(self._watch)
        self._rng = random.Random(f"journey {seed}")
        self._todo = deque(self.verdict.events)
        self._undo: list[Event] = []
        self._hang_until_s = 0.0
        self._command = STANDSTILL
        self._commands: deque[tuple[float, WheelCommand]] = deque()
        self._calls: list[Event] = []

    def run(self) -> Verdict:
        """Drive, let the faults happen, judge."""
        robot, verdict = self.robot, self.verdict
        robot.wheels.open()
        robot.navigator.start(self._journey(), robot.odometry.pose)
        reading: WheelReading | None = None
        blocks = 0
        while robot.navigator.state is MotionState.MOVING and robot.time.now_s < LIMIT_S:
            wanted = robot.navigator.step(robot.odometry.pose, robot.time.now_s, reading)
            halt = wanted == STANDSTILL and self._command != STANDSTILL
            reading = None
            if wanted != STANDSTILL or halt or blocks % STANDING_EVERY == 0:
                reading = self._exchange(wanted)
            blocks += 1
            self._wait(PERIOD_S)
        verdict.state, verdict.reason = robot.navigator.state, robot.navigator.reason
        if verdict.state is MotionState.MOVING:
            verdict.broken.append(f"the journey has not ended after {LIMIT_S:.0f} s")
        self._exchange(STANDSTILL)
        self._wait(SILENT_LIMIT_S)
        if robot.fastest_rad_s > STANDING_RAD_S:
            verdict.broken.append("the wheels turn after the journey's end")
        self._judge_arrival()
        robot.wheels.close()
        verdict.virtual_s = robot.time.now_s
        return verdict

    def _journey(self) -> Journey:
        draw = self._rng.uniform
        match self._rng.randrange(3):
            case 0:
                return Waypoints(((draw(0.3, 1.0), draw(-0.5, 0.5)), (draw(-0.5, 0.5), draw(0.3, 1.0))))
            case 1:
                return Dock(Pose(draw(-1.0, 1.0), draw(-1.0, 1.0), draw(-3.0, 3.0)))
            case _:
                return Turn(draw(6.0, 20.0))

    def _exchange(self, wanted: WheelCommand) -> WheelReading | None:
        while self.robot.time.now_s < self._hang_until_s:
            self.robot.time.advance(0.01)
        self._command = wanted
        self._commands.append((self.robot.time.now_s, wanted))
        try:
            return self.robot.exchange(wanted)
        except DeviceError:
            return None
        finally:
            self._commands.append((self.robot.time.now_s, wanted))

    def _wait(self, duration_s: float) -> None:
        for _ in range(round(duration_s / 0.01)):
            self.robot.time.advance(0.01)

    def _watch(self, _dt_s: float) -> None:
        """Called whenever time has passed, in the middle of an exchange too."""
        now_s = self.robot.time.now_s
        while self._todo and self._todo[0].at_s <= now_s:
            self._begin(self._todo.popleft())
        for event in [event for event in self._undo if event.until_s <= now_s]:
            self._undo.remove(event)
            self._end(event)
        self._judge_speeds(now_s)
        self._judge_calls(now_s)

    def _begin(self, event: Event) -> None:
        robot, motor = self.robot, self.robot.motors[event.side]
        match event.fault:
            case Fault.BAD_REPLIES:
                robot.line.faults.schedule(*event.replies)
            case Fault.BABBLE:
                robot.line.babble(event.until_s - event.at_s)
            case Fault.UNPLUG:
                robot.port.plugged = False
            case Fault.DEAD_MOTOR:
                motor.powered = False
            case Fault.BROWN_OUT:
                (robot.controller or motor).reboot()
            case Fault.HARDWARE_ERROR:
                motor.raise_hardware_error(SHUTDOWN_OVERLOAD)
            case Fault.OBSTACLE:
                motor.blocked = True
            case Fault.EMPTY_BATTERY:
                for each in robot.motors:
                    each.voltage_v = LOW_V
            case Fault.HANG:
                self._hang_until_s = event.until_s
        self._undo.append(event)
        if event.fault in STOPS and robot.navigator.state is MotionState.MOVING:
            self._calls.append(event)

    def _end(self, event: Event) -> None:
        robot, motor = self.robot, self.robot.motors[event.side]
        match event.fault:
            case Fault.UNPLUG:
                robot.port.plugged = True
            case Fault.DEAD_MOTOR:
                motor.powered = True
                motor.reboot()
            case Fault.HARDWARE_ERROR:
                motor.reboot()
            case Fault.OBSTACLE:
                motor.blocked = False
            case Fault.EMPTY_BATTERY:
                for each in robot.motors:
                    each.voltage_v = 12.0

    def _judge_speeds(self, now_s: float) -> None:
        while len(self._commands) > 1 and self._commands[1][0] < now_s - MEMORY_S[self.verdict.kind]:
            self._commands.popleft()
        for side, motor in enumerate(self.robot.motors):
            speed = motor.true_speed_rad_s
            if abs(speed) <= STANDING_RAD_S:
                continue
            told = [0.0, *(command.right_rad_s if side else command.left_rad_s for _, command in self._commands)]
            if not min(told) - 0.4 <= speed <= max(told) + 0.4:
                self.verdict.broken.append(f"{now_s:.2f} s: a wheel turns at {speed:.2f} rad/s that nobody asked for")

    def _judge_calls(self, now_s: float) -> None:
        """Tick off the faults after which the wheels have come to a stand."""
        for event in list(self._calls):
            is_low = event.fault is Fault.EMPTY_BATTERY
            since_s = now_s - event.at_s - (SUSTAINED_S if is_low else 0.0)
            charged = is_low and event.until_s < now_s
            back = event.fault in (Fault.HANG, Fault.DEAD_MOTOR) and event.until_s <= now_s  # and drives on
            if charged or back or (event.fault is Fault.OBSTACLE and not self._strains(event, now_s)):
                self._calls.remove(event)
            elif since_s >= 0.0 and self.robot.fastest_rad_s <= STANDING_RAD_S:
                self._calls.remove(event)
                known_s = self.verdict.stop_s.get(event.fault, 0.0)
                self.verdict.stop_s[event.fault] = max(known_s, since_s)
            elif since_s > stop_limit_s(self.verdict.kind, event.fault) + 0.01:
                self._calls.remove(event)
                self.verdict.broken.append(
                    f"{event.at_s:.2f} s: {event.fault.value}: the wheels still turn after {since_s:.2f} s"
                )

    def _strains(self, event: Event, now_s: float) -> bool:
        """Whether the held wheel has had commands to turn since the obstacle for as long as detection takes."""
        if now_s - event.at_s > 0.25:
            return True
        wanted = self._command.right_rad_s if event.side else self._command.left_rad_s
        return abs(wanted) >= LEAST_COMMAND_RAD_S

    def _judge_arrival(self) -> None:
        robot = self.robot
        if self.verdict.state is not MotionState.ARRIVED:
            return
        believed, true = robot.odometry.pose, robot.pose
        off_m = math.hypot(believed.x_m - true.x_m, believed.y_m - true.y_m)
        if off_m > ODOMETRY_M:
            self.verdict.broken.append(f"arrived, but {off_m:.3f} m from where it believes to be")


def run_trial(seed: int, kind: Kind = "dynamixel") -> Verdict:
    """Run one trial; see the module. The same seed gives the same verdict."""
    return Trial(seed, kind).run()
