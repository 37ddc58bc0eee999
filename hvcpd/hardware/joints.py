"""Joints on the wheels' bus: motors in position mode, each read and commanded in the wheels' own bus cycle.

Two threads share a `Joint`. The event loop says what it is to do (`turn`, `pause`, `stop`) and reads `state`; the bus's
thread calls `inspect`, `cycle` and `close`. Each side writes attributes of its own, whole frozen values at a time.

The motor's bus watchdog stops it where it is when this process falls silent (e-Manual, xl430-w250, "Bus Watchdog").
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

from hvcpd.config.skill_settings import JointSettings
from hvcpd.hardware import motors, registers
from hvcpd.hardware.wheels_bus import BusError, DynamixelBus, PortLostError, RefusedError, answer

TOLERANCE_DEG = 2.0
"""Distance from its goal within which it has arrived: position mode has no integral gain as it leaves the factory
(e-Manual), and a load keeps it off its goal."""
STILL_DEG = 0.5
"""Less than this between two readings is no motion: six ticks of the encoder."""
STILL_S = 0.5
"""Time without motion, short of its goal, after which it counts as blocked; several times the motor's lag."""
AGAIN_S = 1.0
"""Between two attempts at a joint that does not answer: each costs the wheels' cycle a time-out of about 50 ms."""
TRIES = 3
"""Of a cycle: lines lose a reply now and then."""
LAST_TRIES = 10
"""Of switching a motor's torque off at the end, when nothing else waits: three were once too few on a busy machine."""

WINDOW_START = registers.TORQUE_ENABLE.address
WINDOW_SIZE = registers.PRESENT_POSITION.address + registers.PRESENT_POSITION.size - WINDOW_START
"""Torque, errors, watchdog, load and position in one read of 72 bytes."""

DEG_PER_TICK = 360.0 / registers.TICKS_PER_TURN
VELOCITY_UNIT_DEG_S = math.degrees(registers.VELOCITY_UNIT_RAD_S)


@dataclass(frozen=True)
class JointGoal:
    """What a joint is to do: go to `goal_deg` or, without one, stand still, or `release` its torque."""

    number: int
    goal_deg: float | None = None
    release: bool = False


@dataclass(frozen=True)
class JointState:
    """The state of a joint on its way to a goal: its angle, in degrees as the settings count; its effort, as a share of
    the motor's; whether it has arrived or is blocked; or its fault."""

    goal: int = 0
    angle_deg: float = 0.0
    load: float = 0.0
    there: bool = False
    blocked: bool = False
    fault: str | None = None


class Joint:
    """One joint. `clock` (s) is the bus thread's."""

    def __init__(self, settings: JointSettings, clock: Callable[[], float]) -> None:
        self.settings = settings
        self.state = JointState()
        self._clock = clock
        self._goal = self._carried_out = self._tried = JointGoal(0)
        self._is_ready = False
        self._failures = 0
        self._again_s = -math.inf
        self._moved_s = 0.0
        self._moved_deg = math.inf

    def turn(self, angle_deg: float) -> int:
        """Go to an angle within the settings' bounds; the number of this goal. Raises ValueError."""
        if not self.settings.least_deg <= angle_deg <= self.settings.most_deg:
            raise ValueError(f"{angle_deg:g}° is beyond {self.settings.least_deg:g} to {self.settings.most_deg:g}°")
        return self._set_goal(angle_deg)

    def pause(self) -> int:
        """Stand under torque."""
        return self._set_goal(None)

    def stop(self) -> int:
        """Hold the position, or release the torque, as declared."""
        return self._set_goal(None, release=self.settings.stopped == "release")

    def inspect(self, bus: DynamixelBus) -> list[str]:
        """What is wrong with the motor, with its remedy; changes nothing. Raises PortLostError."""
        motor_id = self.settings.id
        model = answer(partial(bus.ping, motor_id))
        firmware = answer(partial(bus.read, motor_id, registers.FIRMWARE_VERSION)) if model is not None else None
        if model is None or firmware is None:
            return [f"joint (ID {motor_id}): no answer; plug it into the wheels' line, at {bus.baud_rate} baud"]
        fault = motors.model_fault(model) or motors.firmware_fault(model, firmware)
        return [f"joint (ID {motor_id}): {fault}"] if fault else []

    def cycle(self, bus: DynamixelBus) -> None:
        """Command the goal and read the state; a silent joint is skipped for a while. Raises PortLostError."""
        now_s, goal = self._clock(), self._goal
        if now_s < self._again_s and goal is self._tried:
            return
        try:
            if not self._is_ready:
                self._make_ready(bus)
            if goal is not self._carried_out:
                self._carry_out(bus, goal, now_s)
            self.state = self._read_state(bus, goal, now_s)
        except PortLostError:
            self._is_ready = False
            raise
        except BusError as error:
            self._tried = goal
            self._failures += 1
            if self._failures < TRIES:  # the next cycle goes on where this one was
                self._is_ready &= not isinstance(error, RefusedError)  # its watchdog has tripped meanwhile
                return
            self._stop_blindly(bus)
            self._failures, self._is_ready, self._again_s = 0, False, now_s + AGAIN_S
            self.state = JointState(goal.number, self.state.angle_deg, fault=f"the joint does not answer: {error}")
        else:
            self._failures = 0
            self._is_ready = self.state.fault is None

    def close(self, bus: DynamixelBus) -> None:
        """Leave it as declared; never raises. One that holds stands by its watchdog from now on."""
        if self.settings.stopped == "release":
            release_torque(bus, self.settings.id)

    def _stop_blindly(self, bus: DynamixelBus) -> None:
        """Have a motor that does not answer but may still hear hold its last known position, or release its torque."""
        if not self._is_ready:
            return
        with suppress(BusError):
            if self.settings.stopped == "release":
                bus.sync_write(registers.TORQUE_ENABLE, {self.settings.id: 0})
            else:
                bus.sync_write(registers.GOAL_POSITION, {self.settings.id: self._ticks(self.state.angle_deg)})

    def _set_goal(self, goal_deg: float | None, release: bool = False) -> int:
        self._goal = JointGoal(self._goal.number + 1, goal_deg, release)
        return self._goal.number

    def _make_ready(self, bus: DynamixelBus) -> None:
        """Position mode at the place where it is, an earlier watchdog trip cleared; torque stays on if it was."""
        motor_id, write = self.settings.id, partial(bus.write, self.settings.id)
        if bus.read(motor_id, registers.OPERATING_MODE) != registers.POSITION_CONTROL:
            write(registers.TORQUE_ENABLE, 0)
            write(registers.OPERATING_MODE, registers.POSITION_CONTROL)
        write(registers.BUS_WATCHDOG, 0)
        self._stand(bus)
        write(registers.GOAL_PWM, round(self.settings.effort * registers.FULL_PWM))
        write(registers.PROFILE_VELOCITY, max(round(self.settings.speed_deg_s / VELOCITY_UNIT_DEG_S), 1))
        write(registers.BUS_WATCHDOG, registers.WATCHDOG_UNITS)
        self._is_ready = True

    def _stand(self, bus: DynamixelBus) -> None:
        position = bus.read(self.settings.id, registers.PRESENT_POSITION)
        bus.write(self.settings.id, registers.GOAL_POSITION, min(max(position, 0), registers.TICKS_PER_TURN - 1))

    def _carry_out(self, bus: DynamixelBus, goal: JointGoal, now_s: float) -> None:
        if goal.goal_deg is None:
            self._stand(bus)
            if goal.release:
                bus.write(self.settings.id, registers.TORQUE_ENABLE, 0)
        else:
            if not bus.read(self.settings.id, registers.TORQUE_ENABLE):
                self._stand(bus)  # an old goal is not to make it jump
                bus.write(self.settings.id, registers.TORQUE_ENABLE, 1)
            bus.write(self.settings.id, registers.GOAL_POSITION, self._ticks(goal.goal_deg))
        self._moved_s, self._moved_deg = now_s, math.inf
        self._carried_out = goal

    def _read_state(self, bus: DynamixelBus, goal: JointGoal, now_s: float) -> JointState:
        window = bus.read_block(self.settings.id, WINDOW_START, WINDOW_SIZE)
        angle_deg = self._angle_deg(registers.PRESENT_POSITION.decode(window, WINDOW_START))
        load = abs(registers.PRESENT_LOAD.decode(window, WINDOW_START)) * registers.LOAD_UNIT
        if error := registers.HARDWARE_ERROR_STATUS.decode(window, WINDOW_START):
            text = f"its motor reports a hardware error: {registers.hardware_error_text(error)}; switch it off and on"
            return JointState(goal.number, angle_deg, load, fault=text)
        if registers.BUS_WATCHDOG.decode(window, WINDOW_START) == registers.WATCHDOG_TRIPPED:
            return JointState(goal.number, angle_deg, load, fault="its motor heard nothing for too long, and stopped")
        if goal.goal_deg is None:
            return JointState(goal.number, angle_deg, load)
        if not registers.TORQUE_ENABLE.decode(window, WINDOW_START):
            return JointState(goal.number, angle_deg, load, fault="its motor has lost its torque")
        if abs(angle_deg - self._moved_deg) > STILL_DEG:
            self._moved_s, self._moved_deg = now_s, angle_deg
        there = abs(angle_deg - goal.goal_deg) <= TOLERANCE_DEG
        blocked = not there and now_s - self._moved_s >= STILL_S
        return JointState(goal.number, angle_deg, load, there, blocked)

    @property
    def _sign(self) -> int:
        return -1 if self.settings.reverse else 1

    def _ticks(self, angle_deg: float) -> int:
        ticks = round((self.settings.zero_deg + self._sign * angle_deg) / DEG_PER_TICK)
        return min(max(ticks, 0), registers.TICKS_PER_TURN - 1)

    def _angle_deg(self, ticks: int) -> float:
        return self._sign * (ticks * DEG_PER_TICK - self.settings.zero_deg)


def release_torque(bus: DynamixelBus, motor_id: int) -> None:
    """Switch a motor's torque off, with several tries; a motor that never answers stops by its watchdog."""
    any(switched_torque_off(bus, motor_id) for _ in range(LAST_TRIES))


def switched_torque_off(bus: DynamixelBus, motor_id: int) -> bool:
    """Switch a motor's torque off once; return whether the motor confirmed it."""
    try:
        bus.write(motor_id, registers.TORQUE_ENABLE, 0)
    except BusError:
        return False
    return True
