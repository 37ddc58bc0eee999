"""The registers that we use of DYNAMIXEL X-series motors, as data, with their units. `motors.MODELS` has the motors.

Source: ROBOTIS e-Manual, page xl430-w250, "Control Table".
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Register:
    """A register of the motor: address, size in bytes, and whether it is signed (two's complement)."""

    name: str
    address: int
    size: int
    signed: bool = False

    def encode(self, value: int) -> bytes:
        """`value` as the motor wants it. Raises OverflowError if it does not fit."""
        return value.to_bytes(self.size, "little", signed=self.signed)

    def decode(self, window: bytes, start: int) -> int:
        """Return this register's value from `window`, the bytes read from address `start` on."""
        at = self.address - start
        if at < 0 or at + self.size > len(window):
            raise ValueError(f"{self.name} is not in the {len(window)} bytes from {start}")
        return int.from_bytes(window[at : at + self.size], "little", signed=self.signed)


FIRMWARE_VERSION = Register("firmware version", 6, 1)
OPERATING_MODE = Register("operating mode", 11, 1)
VELOCITY_LIMIT = Register("velocity limit", 44, 4)
TORQUE_ENABLE = Register("torque enable", 64, 1)
HARDWARE_ERROR_STATUS = Register("hardware error status", 70, 1)
BUS_WATCHDOG = Register("bus watchdog", 98, 1, signed=True)
GOAL_PWM = Register("goal pwm", 100, 2, signed=True)
GOAL_VELOCITY = Register("goal velocity", 104, 4, signed=True)
PROFILE_ACCELERATION = Register("profile acceleration", 108, 4)
PROFILE_VELOCITY = Register("profile velocity", 112, 4)
GOAL_POSITION = Register("goal position", 116, 4, signed=True)
PRESENT_LOAD = Register("present load", 126, 2, signed=True)
PRESENT_VELOCITY = Register("present velocity", 128, 4, signed=True)
PRESENT_POSITION = Register("present position", 132, 4, signed=True)
PRESENT_INPUT_VOLTAGE = Register("present input voltage", 144, 2)
PRESENT_TEMPERATURE = Register("present temperature", 146, 1)

VELOCITY_CONTROL = 1
"""Operating mode: goal velocity, without end stops."""

POSITION_CONTROL = 3
"""Operating mode: goal position within one turn, as fast as the profile velocity and as hard as the goal PWM allow."""

FULL_PWM = 885
"""The goal PWM for all of the voltage, and its limit as the motor leaves the factory."""

WATCHDOG_TRIPPED = -1
"""What the bus watchdog reads after a trip; goals are then read-only until 0 is written."""

VELOCITY_UNIT_RAD_S = 0.229 * 2.0 * math.pi / 60.0
"""One unit of velocity: 0.229 rev/min."""

TICKS_PER_TURN = 4096
"""Encoder steps in one turn of the shaft."""

RAD_PER_TICK = 2.0 * math.pi / TICKS_PER_TURN

WATCHDOG_UNIT_S = 0.020
"""One unit of the bus watchdog; 1 to 127 are allowed."""

WATCHDOG_UNITS = 12
"""Of all our motors: they stop by themselves after 0.24 s of silence. With up to 0.23 s of braking from top speed
wheels stand within half a second; the daemon talks to them every 50 ms, at rest every 100 ms."""

VOLTAGE_UNIT_V = 0.1
LOAD_UNIT = 0.001
"""Present load counts 0.1 % of the motor's full effort."""

HARDWARE_ERRORS = {
    0: "input voltage out of its limits",
    2: "overheated",
    3: "encoder fault",
    4: "electrical shock or too little power",
    5: "overload",
}
"""Bits of the hardware error status."""


def hardware_error_text(status: int) -> str:
    """The set bits of a hardware error status in words, comma separated."""
    known = [text for bit, text in HARDWARE_ERRORS.items() if status & (1 << bit)]
    return ", ".join(known) or f"unknown hardware error {status:#04x}"
