"""The wheels behind a stock TurtleBot3's OpenCR controller, as `hvcpd.ports.Wheels`.

The controller follows the command words as long as its heartbeat changes. It cannot tell a fresh command from an old
one, so the heartbeat is changed only together with a command: when our commands end, so does the heartbeat.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress

from hvcpd.hardware import opencr, registers
from hvcpd.hardware.kinematics import BURGER, twist_of
from hvcpd.hardware.opencr import command_block
from hvcpd.hardware.registers import Register
from hvcpd.hardware.wheels_base import BusWheels
from hvcpd.hardware.wheels_bus import TIMEOUT_S, BusError, DynamixelBus, MakePort
from hvcpd.hardware.wheels_opencr_handshake import ControllerState, inspect, read_state
from hvcpd.hardware.wheels_port import WaitingPort
from hvcpd.hardware.wheels_sense import MotorHealth
from hvcpd.ports import STANDSTILL, WheelCommand, WheelReading

WINDOW_START = opencr.PRESENT_CURRENT_LEFT.address
WINDOW_SIZE = opencr.MOTOR_TORQUE.address + opencr.MOTOR_TORQUE.size - WINDOW_START
"""Read in every cycle: currents, velocities, positions, torque, 30 bytes."""

LIMIT_M_S = opencr.MOTOR_VELOCITY_LIMIT * registers.VELOCITY_UNIT_RAD_S * BURGER.wheel_radius_m
"""0.2097 m/s at the rim: beyond their own velocity limit motors refuse the controller's goals (up to 0.2108)."""

NO_PROFILE = bytes(opencr.PROFILE_ACCELERATION_LEFT.size + opencr.PROFILE_ACCELERATION_RIGHT.size)
"""Value that switches off the ramps of both motors, side by side. ROBOTIS's node can set them, and the motors keep them
until their power is cut: a gentle one would stretch every stop, also that of the heartbeat."""

TORQUE_DELAY_S = 0.04
"""The controller's table shows the torque up to one of its 20 ms periods after it was switched on; twice that."""

CLOCKS_APART_S = 0.5
"""Between two readings the controller's clock and ours count the same; if not, it has restarted. More than any reply's
delay, less than it takes to start. A false alarm costs nothing but torque switched on that is on."""


class OpenCRWheels(BusWheels):
    """The two wheels of a stock TurtleBot3 Burger. `clock` and `timeout_s` as in `DynamixelWheels`."""

    _stop_before = 1
    """At once: while a motor is silent the controller takes a packet each half second, so the stop must be next."""

    def __init__(
        self,
        port: str,
        baud_rate: int = 1_000_000,
        timeout_s: float = TIMEOUT_S,
        clock: Callable[[], float] = time.monotonic,
        make_port: MakePort = WaitingPort,
    ) -> None:
        super().__init__(DynamixelBus(port, baud_rate, timeout_s, make_port), clock, opencr.HEARTBEAT_TIMEOUT_S)
        self._beat = 0
        self._carry = (0.0, 0.0)
        self._state: ControllerState | None = None
        self._state_s = 0.0
        self._torque_asked_s: float | None = None

    def _inspect(self) -> list[str]:
        return inspect(self._bus)

    def _make_ready(self) -> None:
        self._send_stop()
        self._bus.write_block(opencr.DEVICE_ID, opencr.LINEAR_X.address, command_block(0, 0), "the command words")
        profiles = opencr.PROFILE_ACCELERATION_LEFT.address
        self._bus.write_block(opencr.DEVICE_ID, profiles, NO_PROFILE, "profile accelerations")
        self._take(read_state(self._bus))
        self._bus.write(opencr.DEVICE_ID, opencr.MOTOR_TORQUE, 1)

    def _look_after(self) -> None:
        state = read_state(self._bus)
        if state.debug_mode:
            self._refuse("OpenCR is in debug mode, in which it does not stop when we fall silent")
        if state.device_status == opencr.NO_MOTORS:
            self._refuse("OpenCR finds no motors: check their cable and power, then press its reset button")
        rebooted = self._take(state)
        window = self._bus.read_block(opencr.DEVICE_ID, WINDOW_START, WINDOW_SIZE)
        torque = _value(window, opencr.MOTOR_TORQUE)
        if not torque or self._torque_asked_s is not None:
            self._rejoin(window, self._clock() - self._last_s)
        if torque:
            self._torque_asked_s = None
            return
        self._send_stop()  # both wheels stand until the torque is back
        self._bus.write(opencr.DEVICE_ID, opencr.MOTOR_TORQUE, 1)
        if self._torque_asked_s is None or rebooted:
            self._torque_asked_s = self._clock()
        elif self._clock() - self._torque_asked_s >= TORQUE_DELAY_S:
            self._refuse(
                "OpenCR keeps the motors' torque off: a motor has shut itself down (overload, heat, voltage) or lost "
                "its cable; switch the robot off and on"
            )

    def _take(self, state: ControllerState) -> bool:
        """Note the controller's state; True (and the angles rejoined) if it has restarted since the last one."""
        now_s = self._clock()
        rebooted = False
        if self._state is not None:
            counted_s = (state.millis - self._state.millis) % (1 << 32) * 0.001
            rebooted = abs(counted_s - (now_s - self._state_s)) > CLOCKS_APART_S
        self._state, self._state_s = state, now_s
        if rebooted:
            self._rejoin(self._bus.read_block(opencr.DEVICE_ID, WINDOW_START, WINDOW_SIZE), 0.0)
        return rebooted

    def _rejoin(self, window: bytes, dt_s: float) -> None:
        """A motor without torque may have restarted, and then has forgotten its turns."""
        for encoder, position in zip(self._encoders, _positions(window), strict=True):
            encoder.rejoin(position, dt_s)

    def _cycle(self, command: WheelCommand) -> WheelReading:
        self._bus.write_block(opencr.DEVICE_ID, opencr.LINEAR_X.address, self._block(command), "the command words")
        self._beat = (self._beat + 1) % 256
        self._bus.write(opencr.DEVICE_ID, opencr.HEARTBEAT, self._beat)
        window = self._bus.read_block(opencr.DEVICE_ID, WINDOW_START, WINDOW_SIZE)
        if not _value(window, opencr.MOTOR_TORQUE):
            self._rejoin(window, self._clock() - self._last_s)
            self._doubtful = True
        ticks = self._follow(_positions(window))
        return WheelReading(
            left_rad=ticks[0] * registers.RAD_PER_TICK,
            right_rad=ticks[1] * registers.RAD_PER_TICK,
            left_rad_s=_value(window, opencr.PRESENT_VELOCITY_LEFT) * registers.VELOCITY_UNIT_RAD_S,
            right_rad_s=_value(window, opencr.PRESENT_VELOCITY_RIGHT) * registers.VELOCITY_UNIT_RAD_S,
            left_effort=_value(window, opencr.PRESENT_CURRENT_LEFT) * opencr.EFFORT_UNIT,
            right_effort=_value(window, opencr.PRESENT_CURRENT_RIGHT) * opencr.EFFORT_UNIT,
            voltage_v=self._state.voltage_v if self._state is not None else None,
        )

    def _block(self, command: WheelCommand) -> bytes:
        """The command words. They are coarse (1 cm/s), so what rounding takes away is made good in the next ones."""
        if command == STANDSTILL:
            self._carry = (0.0, 0.0)
            return command_block(0, 0)
        rims = [speed * BURGER.wheel_radius_m for speed in (command.left_rad_s, command.right_rad_s)]
        scale = min(1.0, LIMIT_M_S / max(abs(rims[0]), abs(rims[1]), 1e-9))
        twist = twist_of(WheelCommand(command.left_rad_s * scale, command.right_rad_s * scale), BURGER)
        wanted = (
            twist.linear_m_s * opencr.COMMAND_PER_UNIT + self._carry[0],
            twist.angular_rad_s * opencr.COMMAND_PER_UNIT + self._carry[1],
        )
        linear, angular = _within_limits(round(wanted[0]), round(wanted[1]))
        self._carry = (_half(wanted[0] - linear), _half(wanted[1] - angular))
        return command_block(linear, angular)

    def _read_health(self) -> tuple[MotorHealth, ...]:
        state = read_state(self._bus)
        window = self._bus.read_block(opencr.DEVICE_ID, WINDOW_START, WINDOW_SIZE)
        torque = bool(_value(window, opencr.MOTOR_TORQUE))
        currents = (opencr.PRESENT_CURRENT_LEFT, opencr.PRESENT_CURRENT_RIGHT)
        return tuple(
            MotorHealth(n + 1, torque, False, 0, state.voltage_v, None, _value(window, register) * opencr.EFFORT_UNIT)
            for n, register in enumerate(currents)
        )

    def _send_stop(self) -> None:
        self._carry = (0.0, 0.0)
        self._bus.send_block(opencr.DEVICE_ID, opencr.LINEAR_X.address, command_block(0, 0))

    def _torque_off(self) -> None:
        with suppress(BusError):  # a controller that does not answer stops by its heartbeat
            self._bus.write_block(opencr.DEVICE_ID, opencr.LINEAR_X.address, command_block(0, 0), "the command words")
            self._bus.write(opencr.DEVICE_ID, opencr.MOTOR_TORQUE, 0)


def _value(window: bytes, register: Register) -> int:
    return register.decode(window, WINDOW_START)


def _positions(window: bytes) -> tuple[int, int]:
    return _value(window, opencr.PRESENT_POSITION_LEFT), _value(window, opencr.PRESENT_POSITION_RIGHT)


def _within_limits(linear: int, angular: int) -> tuple[int, int]:
    """The command in whole units, its forward part cut so that no wheel is beyond the motors' limit."""
    room = LIMIT_M_S * opencr.COMMAND_PER_UNIT - abs(angular) * BURGER.separation_m / 2.0
    most = max(int(room), 0)
    return min(max(linear, -most), most), angular


def _half(carry: float) -> float:
    return min(max(carry, -0.5), 0.5)
