"""Detects a stalled wheel: one that is commanded to turn, reports a high load, and does not move. Pure."""

from __future__ import annotations

import math

from hvcpd.ports import WheelCommand, WheelReading

STALL_EFFORT = 0.5
"""Half of what the motor can do; a Burger's wheels roll with 5 to 10 % (the fakes') and start with about 30 %."""
STALL_SHARE = 0.1
"""A wheel that turns with less than this share of the wanted speed does not turn."""
LEAST_COMMAND_RAD_S = 0.3
"""10 mm/s at the rim; below that, friction may well hold a wheel."""
STALL_S = 0.2
"""Duration of strain without motion that is a stall. With one control period and the motors' own stop the wheels stand
half a second after the obstacle."""


class StallWatch:
    """Call `stalled` with every new reading and the command that was in force before it."""

    def __init__(self) -> None:
        self._since_s: float | None = None

    def clear(self) -> None:
        """Forget what was seen."""
        self._since_s = None

    def stalled(self, command: WheelCommand, reading: WheelReading, now_s: float) -> bool:
        """Whether a wheel has been straining without turning for `STALL_S`."""
        blocked = _blocked(command.left_rad_s, reading.left_rad_s, reading.left_effort) or _blocked(
            command.right_rad_s, reading.right_rad_s, reading.right_effort
        )
        if not blocked:
            self._since_s = None
        elif self._since_s is None:
            self._since_s = now_s
        return self._since_s is not None and now_s - self._since_s >= STALL_S - 1e-9


def _blocked(wanted_rad_s: float, speed_rad_s: float, effort: float) -> bool:
    forward = math.copysign(1.0, wanted_rad_s)
    return (
        abs(wanted_rad_s) >= LEAST_COMMAND_RAD_S
        and forward * effort >= STALL_EFFORT
        and forward * speed_rad_s < STALL_SHARE * abs(wanted_rad_s)
    )
