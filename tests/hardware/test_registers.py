"""Our control table against the fake's, which was written down apart from it."""

import pytest

from hil_fakes.dynamixel.control_table import BY_NAME
from hil_fakes.dynamixel.physics import VELOCITY_UNIT_RAD_S
from hvcpd.hardware import registers

REGISTERS = [value for value in vars(registers).values() if isinstance(value, registers.Register)]


@pytest.mark.parametrize("register", REGISTERS, ids=lambda register: register.name)
def test_both_tables_say_the_same(register: registers.Register) -> None:
    item = BY_NAME[register.name.replace(" ", "_")]
    assert (register.address, register.size, register.signed) == (item.address, item.size, item.signed)


def test_the_unit_of_velocity() -> None:
    assert pytest.approx(VELOCITY_UNIT_RAD_S) == registers.VELOCITY_UNIT_RAD_S


def test_decoding_takes_the_right_bytes_of_a_window() -> None:
    window = bytes(range(8))
    assert registers.PRESENT_POSITION.decode(window, 128) == 0x07060504
    with pytest.raises(ValueError, match="present input voltage"):
        registers.PRESENT_INPUT_VOLTAGE.decode(window, 128)


def test_hardware_errors_in_words() -> None:
    assert registers.hardware_error_text(0b100101) == "input voltage out of its limits, overheated, overload"
    assert "0x80" in registers.hardware_error_text(0x80)
