"""Evaluation of the motors' readings, for both drivers: a continuous angle, and whether the battery suffices."""

from __future__ import annotations

from dataclasses import dataclass

from hvcpd.errors import DeviceError
from hvcpd.hardware import registers

LOWEST_VOLTAGE_V = 11.0
"""Below this OpenCR cuts the motors' power in the end (ROBOTIS e-Manual, TurtleBot3: 11.1 V nominal, warning at 11)."""

SUSTAINED_S = 1.0
"""A dip while the motors start is shorter."""

RECOVERED_V = 0.3
"""Rise above the lowest voltage from which on a battery counts as charged or changed; at rest a weak one rises less."""

FASTEST_TICKS_S = 5500.0
"""No wheel turns faster by itself: 80 rev/min, a third above the motors' limit."""

RESTART_TICKS = registers.TICKS_PER_TURN // 8
"""A motor counts from within one turn again when it has started, and has hardly turned since: it has no torque."""

WENT_ON, WENT_ON_S = 1.2, 1.3
"""A wheel may go on a fifth faster than over the last cycle, until its controller has stopped it: OpenCR that waits for
a dead motor needs up to a second to hear of it, and the wheel some time to come to a stand."""

LEAP_TICKS = registers.TICKS_PER_TURN // 2
"""Largest change of position, beyond what the time since explains, that is a movement: more means that the motor has
lost count of its turns."""


@dataclass(frozen=True)
class MotorState:
    """Whether a motor may be driven."""

    motor_id: int
    torque_on: bool
    watchdog_tripped: bool
    hardware_error: int
    """Hardware error status, 0 if all is well; `registers.hardware_error_text` puts it into words."""


@dataclass(frozen=True)
class MotorHealth(MotorState):
    """A motor's own report of its condition."""

    voltage_v: float
    temperature_c: int | None
    """None: the controller does not tell."""
    load: float
    """Effort, -1 to 1 of what the motor can do."""


class Encoder:
    """Makes an unbounded angle of a motor's 32-bit position; the motor's own count at first."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._ticks = 0
        self._ticks_s = 0.0

    def leaps(self, raw: int, dt_s: float) -> bool:
        """Whether no wheel can have moved there within `dt_s`; changes nothing."""
        if self._last is None:
            return False
        return abs(_wrap(raw - self._last, 1 << 32)) > LEAP_TICKS + FASTEST_TICKS_S * dt_s

    def follow(self, raw: int, dt_s: float = 0.0) -> int:
        """The ticks, from the present position; an overflow of 32 bits is no jump."""
        if self._last is None:
            self._ticks = raw
        else:
            way = _wrap(raw - self._last, 1 << 32)
            self._ticks += way
            self._ticks_s = way / dt_s if dt_s > 0.0 else self._ticks_s
        self._last = raw
        return self._ticks

    def rejoin(self, raw: int, dt_s: float = 0.0) -> None:
        """The motor may have lost count of its turns: assume the smallest change to the angle that it still knows.

        But a position that is not within the first turn was counted on, whatever befell the motor's torque; so was
        one that the wheel comes by if it went on as it did for some of the `dt_s` since it was last read.
        """
        if self._last is None:
            self._ticks = raw
        else:
            way = _wrap(raw - self._last, 1 << 32)
            first_turn = -RESTART_TICKS <= raw < registers.TICKS_PER_TURN + RESTART_TICKS
            went_on = 0.0 < way * self._ticks_s <= self._ticks_s**2 * min(dt_s, WENT_ON_S) * WENT_ON
            self._ticks += way if went_on or not first_turn else _wrap(way, registers.TICKS_PER_TURN)
        self._last, self._ticks_s = raw, 0.0


class Battery:
    """Raises an error when the voltage stays too low, until the battery is charged or changed."""

    def __init__(self) -> None:
        self._low_since_s: float | None = None
        self.empty = False
        """True: the wheels are not to be driven."""

    def check(self, voltage_v: float, now_s: float) -> None:
        """Add a measurement. Raises DeviceError while the battery is empty."""
        if voltage_v >= LOWEST_VOLTAGE_V:
            self._low_since_s = None
        elif self._low_since_s is None:
            self._low_since_s = now_s
        elif now_s - self._low_since_s >= SUSTAINED_S:
            self.empty = True
        if self.empty and voltage_v >= LOWEST_VOLTAGE_V + RECOVERED_V:
            self.empty = False
        if self.empty:
            raise DeviceError(
                f"the battery is empty: {voltage_v:.1f} V, {LOWEST_VOLTAGE_V:.1f} V are needed; "
                "the wheels are stopped. Charge or change the battery"
            )


def _wrap(difference: int, period: int) -> int:
    """`difference` brought into [-period/2, period/2)."""
    return (difference + period // 2) % period - period // 2
