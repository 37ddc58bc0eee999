"""The XL430-W250's control table as data. Source: ROBOTIS e-Manual, page xl430-w250, "Control Table".

Written down apart from `hvcpd.hardware.registers`, so that a slip in one shows against the other.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Cell:
    """One entry: where it is, what may be written, and what it holds after power-up."""

    name: str
    address: int
    size: int
    initial: int = 0
    writable: bool = True
    low: int | None = None
    high: int | None = None
    signed: bool = False

    @property
    def in_eeprom(self) -> bool:
        """EEPROM cells keep their value without power and are locked while torque is on."""
        return self.address < RAM_START


RAM_START = 64
TABLE_END = 252
"""Reads beyond the last indirect data cell are refused. The second indirect block (578 to 661) is not modelled."""

INDIRECT_ADDRESS_START = 168
INDIRECT_DATA_START = 224
N_INDIRECT = 28

MODEL_NUMBER = 1060

POSITION_CONTROL = 3
VELOCITY_CONTROL = 1
OPERATING_MODES = (1, 3, 4, 16)
"""Velocity, position, extended position, PWM; other values are refused."""

_EEPROM = (
    Cell("model_number", 0, 2, MODEL_NUMBER, writable=False),
    Cell("model_information", 2, 4, writable=False),
    Cell("firmware_version", 6, 1, 45, writable=False),  # 38 or newer has the bus watchdog; 45 is common
    Cell("id", 7, 1, 1, low=0, high=252),
    Cell("baud_rate", 8, 1, 1, low=0, high=7),
    Cell("return_delay_time", 9, 1, 250, low=0, high=254),
    Cell("drive_mode", 10, 1, 0, low=0, high=13),
    Cell("operating_mode", 11, 1, POSITION_CONTROL, low=0, high=16),
    Cell("secondary_id", 12, 1, 255, low=0, high=252),
    Cell("protocol_type", 13, 1, 2, low=1, high=2),
    Cell("homing_offset", 20, 4, 0, low=-1_044_479, high=1_044_479, signed=True),
    Cell("moving_threshold", 24, 4, 10, low=0, high=1023),
    Cell("temperature_limit", 31, 1, 72, low=0, high=100),
    Cell("max_voltage_limit", 32, 2, 140, low=60, high=140),
    Cell("min_voltage_limit", 34, 2, 60, low=60, high=140),
    Cell("pwm_limit", 36, 2, 885, low=0, high=885),
    Cell("velocity_limit", 44, 4, 265, low=0, high=1023),
    Cell("max_position_limit", 48, 4, 4095, low=0, high=4095),
    Cell("min_position_limit", 52, 4, 0, low=0, high=4095),
    Cell("startup_configuration", 60, 1, 0),
    Cell("shutdown", 63, 1, 52),
)

_RAM = (
    Cell("torque_enable", 64, 1, 0, low=0, high=1),
    Cell("led", 65, 1, 0, low=0, high=1),
    Cell("status_return_level", 68, 1, 2, low=0, high=2),
    Cell("registered_instruction", 69, 1, writable=False),
    Cell("hardware_error_status", 70, 1, writable=False),
    Cell("velocity_i_gain", 76, 2, 1000, low=0, high=16_383),
    Cell("velocity_p_gain", 78, 2, 100, low=0, high=16_383),
    Cell("position_d_gain", 80, 2, 4000, low=0, high=16_383),
    Cell("position_i_gain", 82, 2, 0, low=0, high=16_383),
    Cell("position_p_gain", 84, 2, 640, low=0, high=16_383),
    Cell("feedforward_2nd_gain", 88, 2, 0, low=0, high=16_383),
    Cell("feedforward_1st_gain", 90, 2, 0, low=0, high=16_383),
    Cell("bus_watchdog", 98, 1, 0, low=0, high=127, signed=True),
    Cell("goal_pwm", 100, 2, 885, low=-885, high=885, signed=True),
    Cell("goal_velocity", 104, 4, signed=True),
    Cell("profile_acceleration", 108, 4, 0, low=0, high=32_767),
    Cell("profile_velocity", 112, 4, 0, low=0, high=32_767),
    Cell("goal_position", 116, 4, signed=True),
    Cell("realtime_tick", 120, 2, writable=False),
    Cell("moving", 122, 1, writable=False),
    Cell("moving_status", 123, 1, writable=False),
    Cell("present_pwm", 124, 2, writable=False, signed=True),
    Cell("present_load", 126, 2, writable=False, signed=True),
    Cell("present_velocity", 128, 4, writable=False, signed=True),
    Cell("present_position", 132, 4, writable=False, signed=True),
    Cell("velocity_trajectory", 136, 4, writable=False, signed=True),
    Cell("position_trajectory", 140, 4, writable=False, signed=True),
    Cell("present_input_voltage", 144, 2, 120, writable=False),
    Cell("present_temperature", 146, 1, 30, writable=False),
    Cell("backup_ready", 147, 1, writable=False),
)

_INDIRECT = tuple(
    Cell(f"indirect_address_{n + 1}", INDIRECT_ADDRESS_START + 2 * n, 2, INDIRECT_DATA_START + n, low=64, high=661)
    for n in range(N_INDIRECT)
)

CELLS = _EEPROM + _RAM + _INDIRECT
BY_NAME = {cell.name: cell for cell in CELLS}
BY_ADDRESS = {cell.address: cell for cell in CELLS}

GOALS = ("goal_pwm", "goal_velocity", "goal_position")
"""The cells that a tripped bus watchdog makes read-only."""

BAUD_RATES_HZ = (9600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""Bits a second, by the value of the baud rate cell."""
