"""Two XL430-W250 wheel motors on one line (U2D2, or OpenCR with `usb_to_dxl`), as `hvcpd.ports.Wheels`.

Blocking: the daemon wraps it in one worker thread. Two leases stop the wheels: the motors' own bus watchdog, and the
caller's, who must send every command anew.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from hvcpd.errors import DeviceError
from hvcpd.hardware import xl430
from hvcpd.hardware.wheels_bus import BusError, DynamixelBus
from hvcpd.hardware.wheels_handshake import (
    LOWEST_VOLTAGE_V,
    SEARCH_S,
    MotorHealth,
    arm,
    inspect,
    prepare,
    read_health,
)
from hvcpd.ports import STANDSTILL, WheelCommand, WheelReading


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
    retries: int = 2
    """Further tries after a failed exchange. At 34 ms and 20 ms of draining each, three tries end before the lease."""
    lease_s: float = 0.5
    """The motors stop by themselves after this silence; up to 2.54 s (127 units of 20 ms)."""
    profile_acceleration: int = 0
    """Motor's own ramp, 214.577 rev/min² a unit; 0 leaves the ramps to the motion controller."""
    lowest_voltage_v: float = LOWEST_VOLTAGE_V
    search_s: float = SEARCH_S
    """How long to listen for motors with other IDs when one does not answer at `open`."""
    health_every: int = 25
    """Exchanges between two looks at torque, watchdog and hardware errors: twice a second at 50 Hz."""

    @property
    def watchdog_units(self) -> int:
        """The lease in the motor's unit, 1 to 127."""
        return min(max(int(self.lease_s / xl430.WATCHDOG_UNIT_S + 1e-9), 1), 127)


class _Encoder:
    """Makes an unbounded angle of the motor's 32-bit position."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._ticks = 0

    def follow(self, raw: int) -> int:
        """Ticks since the start, from the present position; an overflow of 32 bits is no jump."""
        if self._last is not None:
            self._ticks += _wrap(raw - self._last, 1 << 32)
        self._last = raw
        return self._ticks

    def rejoin(self, raw: int) -> None:
        """The motor lost count of its turns: take the shorter way to the angle within one turn that it still knows."""
        if self._last is not None:
            self._ticks += _wrap(raw - self._last, xl430.TICKS_PER_TURN)
        self._last = raw


def _wrap(difference: int, period: int) -> int:
    """`difference` brought into [-period/2, period/2)."""
    return (difference + period // 2) % period - period // 2


class DynamixelWheels:
    """The two wheels of a TurtleBot3 Burger (or any pair of XL430-W250); `ids` are left and right.

    After a DeviceError from `exchange` the wheels are stopped as far as the line allows; calling `exchange` again
    tries to heal: the port is opened anew, torque and mode are restored, and the angle goes on without a jump.
    `clock` (s) only serves to notice that an exchange came later than the lease.
    """

    def __init__(
        self,
        port: str,
        baud_rate: int = 1_000_000,
        ids: tuple[int, int] = (1, 2),
        settings: DynamixelSettings | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._settings = settings or DynamixelSettings()
        self._ids = ids
        self._clock = clock
        self._bus = DynamixelBus(port, baud_rate, self._settings.timeout_s)
        self._signs = dict(zip(ids, (self._settings.left_sign, self._settings.right_sign), strict=True))
        self._encoders = {motor_id: _Encoder() for motor_id in ids}
        self._limit_units = xl430.FACTORY_VELOCITY_LIMIT
        self._look: tuple[MotorHealth, ...] = ()
        self._opened = False
        self._doubtful = False
        self._exchanges = 0
        self._last_s = -math.inf
        self.faults = 0
        """Failed exchanges on the bus so far, healed ones included."""

    def open(self) -> None:
        """Handshake, velocity mode, watchdog, torque. Raises DeviceError that names all that is wrong."""
        self._encoders = {motor_id: _Encoder() for motor_id in self._ids}
        self._connect()
        self._opened = True

    def exchange(self, command: WheelCommand) -> WheelReading:
        """One cycle: goal velocities to both motors, position and velocity back.

        Speeds beyond the motors' limit are scaled down together, so that the curve stays. Raises DeviceError when
        the motors stay silent, report a hardware error, or the port is gone; ValueError for a speed that is no number.
        """
        if not self._opened:
            raise DeviceError(f"{self._bus.path}: the wheels are not open")
        goals = self._goals(command)
        fault: BusError | None = None
        for _ in range(self._settings.retries + 1):
            try:
                self._heal()
                reading = self._cycle(goals)
            except BusError as error:
                self.faults += 1
                self._doubtful = True
                fault = error
            else:
                return reading
        self._stop_blindly()
        raise DeviceError(f"the wheels do not answer: {fault}") from fault

    def health(self) -> tuple[MotorHealth, ...]:
        """Voltage, temperature, load and errors of the left and the right motor, read now. Raises DeviceError."""
        try:
            self._look = read_health(self._bus, self._ids)
        except BusError as error:
            self._doubtful = True
            raise DeviceError(f"the wheels do not answer: {error}") from error
        return self._look

    @property
    def last_health(self) -> tuple[MotorHealth, ...]:
        """What the last look found, without asking again; `exchange` looks every `health_every` times."""
        return self._look

    def close(self) -> None:
        """Stop the wheels, switch torque off, let go of the port. Never raises; may be called twice."""
        if self._bus.is_open:
            self._stop_blindly()
            for motor_id in self._ids:
                with suppress(BusError):  # a motor that does not answer stops by its watchdog
                    self._bus.write(motor_id, xl430.TORQUE_ENABLE, 0)
        self._bus.close()
        self._opened = False

    def _connect(self) -> None:
        """Open the port and bring both motors from any state to standstill under torque. Raises DeviceError."""
        if not self._bus.is_open:
            self._bus.open()
        try:
            problems = inspect(self._bus, *self._ids, self._settings.lowest_voltage_v, self._settings.search_s)
            if not problems:
                limits = [self._bus.read(motor_id, xl430.VELOCITY_LIMIT) for motor_id in self._ids]
                self._limit_units = min(xl430.FACTORY_VELOCITY_LIMIT, *limits)
                for health in read_health(self._bus, self._ids):
                    self._restore(health)
        except BusError as error:
            problems = [str(error)]
        if problems:
            self._bus.close()
            raise DeviceError("; ".join([f"{self._bus.path}: {problems[0]}", *problems[1:]]))
        self._doubtful = False
        self._last_s = self._clock()

    def _heal(self) -> None:
        """Before a cycle: make sure that the motors still are as `_connect` left them. Raises BusError, DeviceError."""
        if not self._bus.is_open:
            self._connect()
            return
        late = self._clock() - self._last_s > self._settings.lease_s
        due = self._exchanges % self._settings.health_every == 0
        if not (self._doubtful or late or due):
            return
        self._look = read_health(self._bus, self._ids)
        for health in self._look:
            if health.hardware_error:
                self._doubtful = True
                self._stop_blindly()
                raise DeviceError(
                    f"motor {health.motor_id} reports a hardware error: "
                    f"{xl430.hardware_error_text(health.hardware_error)}; the wheels are stopped"
                )
            if health.watchdog_tripped or not health.torque_on:
                self._restore(health)
        self._doubtful = False

    def _restore(self, health: MotorHealth) -> None:
        """Bring a motor from any state to standstill under torque, without a jump of its angle. Raises BusError."""
        motor_id = health.motor_id
        prepare(self._bus, motor_id, self._settings.profile_acceleration)
        position = self._bus.read(motor_id, xl430.PRESENT_POSITION)
        if health.torque_on:  # it kept its power, and so the count of its turns
            self._encoders[motor_id].follow(position)
        else:
            self._encoders[motor_id].rejoin(position)
        arm(self._bus, motor_id, self._settings.watchdog_units)

    def _cycle(self, goals: dict[int, int]) -> WheelReading:
        start = xl430.PRESENT_VELOCITY.address
        size = xl430.PRESENT_POSITION.address + xl430.PRESENT_POSITION.size - start
        self._bus.alert = False
        self._bus.sync_write(xl430.GOAL_VELOCITY, goals)
        windows = self._bus.sync_read(start, size, self._ids)
        self._doubtful = self._bus.alert
        self._exchanges += 1
        self._last_s = self._clock()
        angles, speeds = [], []
        for motor_id in self._ids:
            ticks = self._encoders[motor_id].follow(xl430.PRESENT_POSITION.decode(windows[motor_id], start))
            units = xl430.PRESENT_VELOCITY.decode(windows[motor_id], start)
            angles.append(self._signs[motor_id] * ticks * xl430.RAD_PER_TICK)
            speeds.append(self._signs[motor_id] * units * xl430.VELOCITY_UNIT_RAD_S)
        return WheelReading(angles[0], angles[1], speeds[0], speeds[1])

    def _goals(self, command: WheelCommand) -> dict[int, int]:
        """Goal velocities by motor, in the motors' unit and within their limit."""
        speeds = (command.left_rad_s, command.right_rad_s)
        if not all(math.isfinite(speed) for speed in speeds):
            raise ValueError(f"wheel speeds must be finite, not {speeds}")
        units = [speed / xl430.VELOCITY_UNIT_RAD_S for speed in speeds]
        scale = min(1.0, self._limit_units / max(abs(units[0]), abs(units[1]), 1e-9))
        return {m: self._signs[m] * round(u * scale) for m, u in zip(self._ids, units, strict=True)}

    def _stop_blindly(self) -> None:
        """Send zero to both wheels without waiting for anyone; the watchdog stops them if this does not arrive."""
        with suppress(BusError):
            self._bus.sync_write(xl430.GOAL_VELOCITY, self._goals(STANDSTILL))
