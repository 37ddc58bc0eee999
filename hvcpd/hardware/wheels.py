"""Two DYNAMIXEL wheel motors on one line (U2D2, or OpenCR with `usb_to_dxl`), as `hvcpd.ports.Wheels`."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hvcpd.hardware import registers
from hvcpd.hardware.joints import Joint, let_go
from hvcpd.hardware.wheels_base import BusWheels
from hvcpd.hardware.wheels_bus import DynamixelBus, MakePort
from hvcpd.hardware.wheels_handshake import SEARCH_S, arm, inspect, prepare, read_health, read_states
from hvcpd.hardware.wheels_port import WaitingPort
from hvcpd.hardware.wheels_sense import LOWEST_VOLTAGE_V, Battery, MotorHealth
from hvcpd.ports import STANDSTILL, WheelCommand, WheelReading

WINDOW_START = registers.PRESENT_LOAD.address
WINDOW_SIZE = registers.PRESENT_TEMPERATURE.address + registers.PRESENT_TEMPERATURE.size - WINDOW_START
"""Read in every cycle: load, velocity, position, voltage and temperature lie side by side, 21 bytes."""


@dataclass(frozen=True)
class DynamixelSettings:
    """How to talk to the motors."""

    left_sign: int = 1
    """+1 if a positive goal velocity drives the left wheel forward, else -1. ROBOTIS sets up a TurtleBot3's right
    motor with reversed drive mode, so that both are +1; a motor fresh from its box on the right side needs -1."""
    right_sign: int = 1
    timeout_s: float = 0.034
    """Wait for a reply, beyond its time on the wire; the SDK's own value (two FTDI latencies of 16 ms and 2 ms).
    Simulations on a loaded machine want more."""
    lease_s: float = 0.24
    """The motors stop by themselves after this silence; up to 2.54 s (127 units of 20 ms). With up to 0.23 s of braking
    from top speed they stand within half a second; the daemon talks to them every 50 ms, at rest every 100 ms."""
    profile_acceleration: int = 0
    """Motor's own ramp, 214.577 rev/min² a unit; 0 leaves the ramps to the motion controller."""
    lowest_voltage_v: float = LOWEST_VOLTAGE_V
    search_s: float = SEARCH_S
    """Time to listen for motors with other IDs when one does not answer at `open`."""
    look_every: int = 4
    """Exchanges between two readings of torque, watchdog and hardware errors: every 200 ms in motion."""

    @property
    def watchdog_units(self) -> int:
        """The lease in the motor's unit, 1 to 127."""
        return min(max(int(self.lease_s / registers.WATCHDOG_UNIT_S + 1e-9), 1), 127)


class DynamixelWheels(BusWheels):
    """The two wheels of a TurtleBot3 Burger (or any pair of `motors.MODELS`); `ids` are left and right.

    `joints` on the same line are served in every exchange. `clock` (s) serves to notice that an exchange came later
    than the lease, and that a position cannot be.
    """

    def __init__(
        self,
        port: str,
        baud_rate: int = 1_000_000,
        ids: tuple[int, int] = (1, 2),
        settings: DynamixelSettings | None = None,
        clock: Callable[[], float] = time.monotonic,
        make_port: MakePort = WaitingPort,
        joints: Sequence[Joint] = (),
    ) -> None:
        self._joints = joints
        self._settings = settings or DynamixelSettings()
        bus = DynamixelBus(port, baud_rate, self._settings.timeout_s, make_port)
        super().__init__(bus, clock, self._settings.lease_s, Battery(self._settings.lowest_voltage_v))
        self._ids = ids
        self._signs = (self._settings.left_sign, self._settings.right_sign)
        self._limit_units = 0

    @property
    def _look_every(self) -> int:
        return self._settings.look_every

    def _inspect(self) -> list[str]:
        problems = inspect(self._bus, *self._ids, self._settings.lowest_voltage_v, self._settings.search_s)
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
        prepare(self._bus, motor_id, self._settings.profile_acceleration)
        position = self._bus.read(motor_id, registers.PRESENT_POSITION)
        encoder = self._encoders[self._ids.index(motor_id)]
        if had_torque:  # it kept its power, and so the count of its turns
            encoder.follow(position)
        else:
            encoder.rejoin(position)
        arm(self._bus, motor_id, self._settings.watchdog_units)

    def _cycle(self, command: WheelCommand) -> WheelReading:
        self._bus.alert = False
        self._bus.sync_write(registers.GOAL_VELOCITY, self._goals(command))
        windows = self._bus.sync_read(WINDOW_START, WINDOW_SIZE, self._ids)
        left, right = (windows[motor_id] for motor_id in self._ids)
        position = registers.PRESENT_POSITION
        ticks = self._follow((position.decode(left, WINDOW_START), position.decode(right, WINDOW_START)))
        self._doubtful = self._bus.alert
        for joint in self._joints:
            joint.cycle(self._bus)
        volts = [registers.PRESENT_INPUT_VOLTAGE.decode(window, WINDOW_START) for window in (left, right)]
        speeds = [registers.PRESENT_VELOCITY.decode(window, WINDOW_START) for window in (left, right)]
        loads = [registers.PRESENT_LOAD.decode(window, WINDOW_START) for window in (left, right)]
        return WheelReading(
            left_rad=self._signs[0] * ticks[0] * registers.RAD_PER_TICK,
            right_rad=self._signs[1] * ticks[1] * registers.RAD_PER_TICK,
            left_rad_s=self._signs[0] * speeds[0] * registers.VELOCITY_UNIT_RAD_S,
            right_rad_s=self._signs[1] * speeds[1] * registers.VELOCITY_UNIT_RAD_S,
            left_effort=self._signs[0] * loads[0] * registers.LOAD_UNIT,
            right_effort=self._signs[1] * loads[1] * registers.LOAD_UNIT,
            voltage_v=min(volts) * registers.VOLTAGE_UNIT_V,
        )

    def _goals(self, command: WheelCommand) -> dict[int, int]:
        """Goal velocities by motor, in the motors' unit and within their limit."""
        units = [speed / registers.VELOCITY_UNIT_RAD_S for speed in (command.left_rad_s, command.right_rad_s)]
        scale = min(1.0, self._limit_units / max(abs(units[0]), abs(units[1]), 1e-9))
        return {m: s * round(u * scale) for m, s, u in zip(self._ids, self._signs, units, strict=True)}

    def _read_health(self) -> tuple[MotorHealth, ...]:
        return read_health(self._bus, self._ids)

    def _send_stop(self) -> None:
        self._bus.sync_write(registers.GOAL_VELOCITY, self._goals(STANDSTILL))

    def _torque_off(self) -> None:
        for motor_id in self._ids:
            let_go(self._bus, motor_id)
        for joint in self._joints:
            joint.close(self._bus)
