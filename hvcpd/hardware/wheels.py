"""Two DYNAMIXEL wheel motors on one line (U2D2, or OpenCR with `usb_to_dxl`), as `hvcpd.ports.Wheels`."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from hvcpd.hardware import registers
from hvcpd.hardware.joints import Joint, release_torque
from hvcpd.hardware.registers import Register
from hvcpd.hardware.wheels_base import BusWheels
from hvcpd.hardware.wheels_bus import TIMEOUT_S, DynamixelBus, MakePort
from hvcpd.hardware.wheels_handshake import WINDOW_SIZE, WINDOW_START, arm, inspect, prepare, read_health, read_states
from hvcpd.hardware.wheels_port import WaitingPort
from hvcpd.hardware.wheels_sense import MotorHealth
from hvcpd.ports import STANDSTILL, WheelCommand, WheelReading

LEASE_S = registers.WATCHDOG_UNITS * registers.WATCHDOG_UNIT_S
"""Silence after which the motors have stopped by themselves."""


class DynamixelWheels(BusWheels):
    """The two wheels of a TurtleBot3 Burger (or any pair of `motors.MODELS`); `ids` are left and right.

    `joints` on the same line are served in every exchange. `clock` (s) serves to notice that an exchange came later
    than the lease, and that a position cannot be. `timeout_s` is longer in simulations on a loaded machine.
    """

    def __init__(
        self,
        port: str,
        baud_rate: int = 1_000_000,
        ids: tuple[int, int] = (1, 2),
        timeout_s: float = TIMEOUT_S,
        clock: Callable[[], float] = time.monotonic,
        make_port: MakePort = WaitingPort,
        joints: Sequence[Joint] = (),
    ) -> None:
        self._joints = joints
        super().__init__(DynamixelBus(port, baud_rate, timeout_s, make_port), clock, LEASE_S)
        self._ids = ids
        self._limit_units = 0

    def _inspect(self) -> list[str]:
        problems = inspect(self._bus, *self._ids)
        if not self._opened:  # later on, a joint that is gone must not keep the wheels
            problems += [text for joint in self._joints for text in joint.inspect(self._bus)]
        return problems

    def _make_ready(self) -> None:
        self._limit_units = min(self._bus.read(motor_id, registers.VELOCITY_LIMIT) for motor_id in self._ids)
        for state in read_states(self._bus, self._ids):
            self._restore(state.motor_id, had_torque=state.torque_on)

    def _look_after(self) -> None:
        for state in read_states(self._bus, self._ids):
            if state.hardware_error:
                text = registers.hardware_error_text(state.hardware_error)
                self._refuse(f"motor {state.motor_id} reports a hardware error: {text}")
            if state.watchdog_tripped or not state.torque_on:
                self._send_stop()  # the other wheel is not to go on alone
                self._restore(state.motor_id, had_torque=state.torque_on)

    def _restore(self, motor_id: int, had_torque: bool) -> None:
        """Bring a motor from any state to standstill under torque, without a jump of its angle. Raises BusError."""
        prepare(self._bus, motor_id)
        position = self._bus.read(motor_id, registers.PRESENT_POSITION)
        encoder = self._encoders[self._ids.index(motor_id)]
        if had_torque:  # it kept its power, and so the count of its turns
            encoder.follow(position)
        else:
            encoder.rejoin(position)
        arm(self._bus, motor_id)

    def _cycle(self, command: WheelCommand) -> WheelReading:
        self._bus.alert = False
        self._bus.sync_write(registers.GOAL_VELOCITY, self._goals(command))
        windows = self._bus.sync_read(WINDOW_START, WINDOW_SIZE, self._ids)

        def both(register: Register) -> tuple[int, int]:
            left, right = (register.decode(windows[motor_id], WINDOW_START) for motor_id in self._ids)
            return left, right

        ticks = self._follow(both(registers.PRESENT_POSITION))
        self._doubtful = self._bus.alert
        for joint in self._joints:
            joint.cycle(self._bus)
        speeds, loads = both(registers.PRESENT_VELOCITY), both(registers.PRESENT_LOAD)
        return WheelReading(
            left_rad=ticks[0] * registers.RAD_PER_TICK,
            right_rad=ticks[1] * registers.RAD_PER_TICK,
            left_rad_s=speeds[0] * registers.VELOCITY_UNIT_RAD_S,
            right_rad_s=speeds[1] * registers.VELOCITY_UNIT_RAD_S,
            left_effort=loads[0] * registers.LOAD_UNIT,
            right_effort=loads[1] * registers.LOAD_UNIT,
            voltage_v=min(both(registers.PRESENT_INPUT_VOLTAGE)) * registers.VOLTAGE_UNIT_V,
        )

    def _goals(self, command: WheelCommand) -> dict[int, int]:
        """Goal velocities by motor, in the motors' unit and within their limit."""
        units = [speed / registers.VELOCITY_UNIT_RAD_S for speed in (command.left_rad_s, command.right_rad_s)]
        scale = min(1.0, self._limit_units / max(abs(units[0]), abs(units[1]), 1e-9))
        return {motor_id: round(unit * scale) for motor_id, unit in zip(self._ids, units, strict=True)}

    def _read_health(self) -> tuple[MotorHealth, ...]:
        return read_health(self._bus, self._ids)

    def _send_stop(self) -> None:
        self._bus.sync_write(registers.GOAL_VELOCITY, self._goals(STANDSTILL))

    def _torque_off(self) -> None:
        for motor_id in self._ids:
            release_torque(self._bus, motor_id)
        for joint in self._joints:
            joint.close(self._bus)
