"""The XL430-W250's control table as data. Source: ROBOTIS e-Manual, page xl430-w250, "Control Table".

Written down apart from `hvcpd.hardware.registers`, so that a slip in one shows against the other.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Item:
    """An item of the control table: its address, the values that may be written, and its initial value."""

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
        """EEPROM items keep their value without power and are locked while torque is on."""
        return self.address < RAM_START


RAM_START = 64
TABLE_END = 252
"""Reads beyond the last indirect data item are refused. The second indirect block (578 to 661) is not modelled."""

INDIRECT_ADDRESS_START = 168
INDIRECT_DATA_START = 224
N_INDIRECT = 28

MODEL_NUMBER = 1060

POSITION_CONTROL = 3
VELOCITY_CONTROL = 1
OPERATING_MODES = (1, 3, 4, 16)
"""Velocity, position, extended position, PWM; other values are refused."""

_EEPROM = (
    Item("model_number", 0, 2, MODEL_NUMBER, writable=False),
    Item("model_information", 2, 4, writable=False),
    Item("firmware_version", 6, 1, 45, writable=False),  # 38 or newer has the bus watchdog; 45 is common
    Item("id", 7, 1, 1, low=0, high=252),
    Item("baud_rate", 8, 1, 1, low=0, high=7),
    Item("return_delay_time", 9, 1, 250, low=0, high=254),
    Item("drive_mode", 10, 1, 0, low=0, high=13),
    Item("operating_mode", 11, 1, POSITION_CONTROL, low=0, high=16),
    Item("secondary_id", 12, 1, 255, low=0, high=252),
    Item("protocol_type", 13, 1, 2, low=1, high=2),
    Item("homing_offset", 20, 4, 0, low=-1_044_479, high=1_044_479, signed=True),
    Item("moving_threshold", 24, 4, 10, low=0, high=1023),
    Item("temperature_limit", 31, 1, 72, low=0, high=100),
    Item("max_voltage_limit", 32, 2, 140, low=60, high=140),
    Item("min_voltage_limit", 34, 2, 60, low=60, high=140),
    Item("pwm_limit", 36, 2, 885, low=0, high=885),
    Item("velocity_limit", 44, 4, 265, low=0, high=1023),
    Item("max_position_limit", 48, 4, 4095, low=0, high=4095),
    Item("min_position_limit", 52, 4, 0, low=0, high=4095),
    Item("startup_configuration", 60, 1, 0),
    Item("shutdown", 63, 1, 52),
)

_RAM = (
    Item("torque_enable", 64, 1, 0, low=0, high=1),
    Item("led", 65, 1, 0, low=0, high=1),
    Item("status_return_level", 68, 1, 2, low=0, high=2),
    Item("registered_instruction", 69, 1, writable=False),
    Item("hardware_error_status", 70, 1, writable=False),
    Item("velocity_i_gain", 76, 2, 1000, low=0, high=16_383),
    Item("velocity_p_gain", 78, 2, 100, low=0, high=16_383),
    Item("position_d_gain", 80, 2, 4000, low=0, high=16_383),
    Item("position_i_gain", 82, 2, 0, low=0, high=16_383),
    Item("position_p_gain", 84, 2, 640, low=0, high=16_383),
    Item("feedforward_2nd_gain", 88, 2, 0, low=0, high=16_383),
    Item("feedforward_1st_gain", 90, 2, 0, low=0, high=16_383),
    Item("bus_watchdog", 98, 1, 0, low=0, high=127, signed=True),
    Item("goal_pwm", 100, 2, 885, low=-885, high=885, signed=True),
    Item("goal_velocity", 104, 4, signed=True),
    Item("profile_acceleration", 108, 4, 0, low=0, high=32_767),
    Item("profile_velocity", 112, 4, 0, low=0, high=32_767),
    Item("goal_position", 116, 4, signed=True),
    Item("realtime_tick", 120, 2, writable=False),
    Item("moving", 122, 1, writable=False),
    Item("moving_status", 123, 1, writable=False),
    Item("present_pwm", 124, 2, writable=False, signed=True),
    Item("present_load", 126, 2, writable=False, signed=True),
    Item("present_velocity", 128, 4, writable=False, signed=True),
    Item("present_position", 132, 4, writable=False, signed=True),
    Item("velocity_trajectory", 136, 4, writable=False, signed=True),
    Item("position_trajectory", 140, 4, writable=False, signed=True),
    Item("present_input_voltage", 144, 2, 120, writable=False),
    Item("present_temperature", 146, 1, 30, writable=False),
    Item("backup_ready", 147, 1, writable=False),
)

_INDIRECT = tuple(
    Item(f"indirect_address_{n + 1}", INDIRECT_ADDRESS_START + 2 * n, 2, INDIRECT_DATA_START + n, low=64, high=661)
    for n in range(N_INDIRECT)
)

ITEMS = _EEPROM + _RAM + _INDIRECT
BY_NAME = {item.name: item for item in ITEMS}
BY_ADDRESS = {item.address: item for item in ITEMS}

GOALS = ("goal_pwm", "goal_velocity", "goal_position")
"""The items that a tripped bus watchdog makes read-only."""

BAUD_RATES_HZ = (9600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""Bits a second, by the value of the baud rate item."""
