"""The common part of both drivers: an exchange with retries, which recovers from faults and stops if in doubt.

Blocking: the daemon wraps it in one worker thread. Two leases stop the wheels: the motors' or the controller's own,
and the caller's, who must send every command anew.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress

from hvcpd.errors import DeviceError
from hvcpd.hardware.wheels_bus import BusError, DynamixelBus, twice
from hvcpd.hardware.wheels_sense import Battery, Encoder, MotorHealth
from hvcpd.ports import STANDSTILL, WheelCommand, WheelReading

TRIES = 3
"""Of one exchange. A try takes at most 34 ms and 50 ms of draining, twice if a ping has to settle the line; the wheels
are told to stop after the second that failed, so that they stand within half a second of the fault."""

LOOK_EVERY = 4
"""Exchanges from one reading of torque and errors to the next: every 200 ms in motion."""


class BusWheels(ABC):
    """Two wheels behind a serial bus, as `hvcpd.ports.Wheels`.

    After a DeviceError from `exchange` the wheels are stopped as far as the line allows; calling `exchange` again
    tries to heal: the port is opened anew, torque and mode are restored, and the angle goes on without a jump.
    """

    _stop_before = TRIES - 1
    """The try before which the wheels get the command to stop, if those before have failed."""

    def __init__(self, bus: DynamixelBus, clock: Callable[[], float], lease_s: float) -> None:
        self._bus = bus
        self._clock = clock
        self._lease_s = lease_s
        self._battery = Battery()
        self._encoders = (Encoder(), Encoder())
        self._opened = False
        self._doubtful = False
        self._exchanges = 0
        self._last_s = -math.inf
        self.faults = 0
        """Failed exchanges on the bus so far, healed ones included."""

    @property
    def port(self) -> str:
        """The serial port in use."""
        return self._bus.path

    def open(self) -> None:
        """Handshake, then standstill under torque. Raises DeviceError that names all that is wrong."""
        self._encoders = (Encoder(), Encoder())
        self._connect()
        self._opened = True

    def exchange(self, command: WheelCommand) -> WheelReading:
        """One cycle: the wanted speeds out, angles, speeds, efforts and voltage back.

        Speeds beyond the motors' limit are scaled down together, so that the curve stays. Raises DeviceError when
        the motors stay silent, report a hardware error, the battery is empty or the port is gone; ValueError for a
        speed that is no number.
        """
        if not self._opened:
            raise DeviceError(f"{self._bus.path}: the wheels are not open")
        if not (math.isfinite(command.left_rad_s) and math.isfinite(command.right_rad_s)):
            raise ValueError(f"wheel speeds must be finite, not {command}")
        reading = self._try(STANDSTILL if self._battery.empty else command)
        if reading.voltage_v is not None:
            try:
                self._battery.check(reading.voltage_v, self._clock())
            except DeviceError:
                self._stop_blindly()
                raise
        return reading

    def health(self) -> tuple[MotorHealth, ...]:
        """Voltage, temperature, load and errors of the left and the right motor, read now. Raises DeviceError."""
        try:
            return self._read_health()
        except BusError as error:
            self._doubtful = True
            raise DeviceError(f"the wheels do not answer: {error}") from error

    def close(self) -> None:
        """Stop the wheels, switch torque off, close the port. Never raises; may be called twice."""
        if self._bus.is_open:
            self._stop_blindly()
            self._torque_off()
        self._bus.close()
        self._opened = False

    def _try(self, command: WheelCommand) -> WheelReading:
        fault: BusError | None = None
        for attempt in range(TRIES):
            if attempt == self._stop_before:
                self._stop_blindly()
            try:
                self._heal()
                reading = self._cycle(command)
                if self._doubtful:  # the reply carried an alert
                    self._heal()
            except BusError as error:
                self.faults += 1
                self._doubtful = True
                fault = error
            else:
                return reading
        self._stop_blindly()
        raise DeviceError(f"the wheels do not answer: {fault}") from fault

    def _connect(self) -> None:
        """Open the port and bring both motors from any state to standstill under torque. Raises DeviceError."""
        if not self._bus.is_open:
            self._bus.open()
        try:
            problems = self._inspect()
            if not problems:
                twice(self._make_ready)
        except BusError as error:
            problems = [str(error)]
        if problems:
            self._bus.close()
            raise DeviceError("; ".join([f"{self._bus.path}: {problems[0]}", *problems[1:]]))
        self._doubtful = False
        self._last_s = self._clock()

    def _heal(self) -> None:
        """Before a cycle: make sure that all is still as `_connect` left it. Raises BusError, DeviceError."""
        if not self._bus.is_open:
            self._connect()
            return
        late = self._clock() - self._last_s > self._lease_s
        if not (self._doubtful or late or self._exchanges % LOOK_EVERY == 0):
            return
        self._look_after()
        self._doubtful = False

    def _refuse(self, reason: str) -> None:
        """Stop the wheels and say why. Raises DeviceError."""
        self._doubtful = True
        self._stop_blindly()
        raise DeviceError(f"{reason}; the wheels are stopped")

    def _follow(self, raw: tuple[int, int]) -> tuple[int, int]:
        """Both encoders' ticks since the start. Raises BusError for a position that no wheel can have reached."""
        now_s = self._clock()
        dt_s = now_s - self._last_s
        for encoder, position in zip(self._encoders, raw, strict=True):
            if encoder.leaps(position, dt_s):
                raise BusError(f"{self._bus.path}: a motor's position leaps; it may have lost its power")
        self._last_s = now_s
        self._exchanges += 1
        return self._encoders[0].follow(raw[0], dt_s), self._encoders[1].follow(raw[1], dt_s)

    def _stop_blindly(self) -> None:
        """Send zero to both wheels without waiting for anyone; their own lease stops them if it does not arrive."""
        with suppress(BusError):
            self._send_stop()

    @abstractmethod
    def _inspect(self) -> list[str]:
        """Everything that is wrong, with its remedy; changes nothing. Raises BusError."""

    @abstractmethod
    def _make_ready(self) -> None:
        """From any state to standstill under torque. Raises BusError."""

    @abstractmethod
    def _look_after(self) -> None:
        """Look at torque and errors, restore what can be restored. Raises BusError, DeviceError."""

    @abstractmethod
    def _cycle(self, command: WheelCommand) -> WheelReading:
        """One exchange on the bus. Raises BusError."""

    @abstractmethod
    def _read_health(self) -> tuple[MotorHealth, ...]:
        """Both motors' state. Raises BusError."""

    @abstractmethod
    def _send_stop(self) -> None:
        """Zero to both wheels; nobody answers. Raises BusError."""

    @abstractmethod
    def _torque_off(self) -> None:
        """Take the torque off as far as the line allows; never raises."""
