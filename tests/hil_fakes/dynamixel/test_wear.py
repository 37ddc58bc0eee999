"""What effort does to a fake motor: heat, sag, overload; and stops that end."""

import math

import pytest

from hil_fakes.dynamixel.faults import DELAY_S, ReplyFault
from hil_fakes.dynamixel.line import Line
from hil_fakes.dynamixel.motor import OVERLOAD_S, SAG_V, SHUTDOWN_OVERHEAT, SHUTDOWN_OVERLOAD, FakeMotor
from hil_fakes.dynamixel.physics import Shaft
from hil_fakes.dynamixel.protocol import Instruction, encode, encode_status
from hil_fakes.dynamixel.virtual import VirtualPort, VirtualTime

PING = encode(1, bytes((Instruction.PING,)))
PONG = encode_status(1, 0, b"\x24\x04\x2d")


def straining() -> FakeMotor:
    motor = FakeMotor()
    for name, value in (("operating_mode", 1), ("torque_enable", 1), ("goal_velocity", 200)):
        motor.memory.set(name, value)
    motor.blocked = True
    motor.advance(0.01)
    return motor


def test_a_lasting_overload_shuts_the_motor_down() -> None:
    motor = straining()
    for _ in range(round((OVERLOAD_S - 0.1) / 0.02)):
        motor.advance(0.02)
    assert motor.memory.get("torque_enable") == 1
    for _ in range(10):
        motor.advance(0.02)
    assert (motor.memory.get("torque_enable"), motor.memory.get("hardware_error_status")) == (0, SHUTDOWN_OVERLOAD)


def test_effort_lets_the_battery_sag() -> None:
    assert straining().memory.get("present_input_voltage") == round((12.0 - SAG_V) * 10)


def test_heat_shuts_the_motor_down() -> None:
    motor = straining()
    motor.temperature_c = 80.0
    motor.advance(0.01)
    assert motor.memory.get("hardware_error_status") & SHUTDOWN_OVERHEAT
    assert motor.memory.get("torque_enable") == 0


@pytest.mark.parametrize("step_s", [0.001, 0.01, 0.3])
def test_a_stop_ends_and_its_way_does_not_depend_on_the_steps(step_s: float) -> None:
    shaft = Shaft(speed_rad_s=6.0)
    for _ in range(round(0.3 / step_s)):
        shaft.coast(step_s)
    assert shaft.speed_rad_s == 0.0
    held = shaft.settings.friction_rad_s2 * 0.05
    way = 6.0 * 0.05 - held * 0.05 * math.log1p(6.0 / held)
    assert shaft.angle_rad == pytest.approx(way)


def test_a_delayed_reply_comes_by_itself() -> None:
    line = Line([FakeMotor(1)])
    line.faults.schedule(ReplyFault.DELAY)
    assert line.hear(PING, 1_000_000) == b""
    assert line.advance(DELAY_S / 2) == b""
    assert line.advance(DELAY_S / 2) == PONG


def test_babble_fills_the_line_for_a_while_and_a_seed_repeats_it() -> None:
    def bytes_of(seed: int) -> bytes:
        line = Line([FakeMotor(1)], seed)
        line.babble(0.05)
        return line.advance(0.03) + line.advance(0.1) + line.advance(0.1)

    assert len(bytes_of(1)) == 0.05 * 20_000
    assert bytes_of(1) == bytes_of(1) != bytes_of(2)


def test_waiting_in_vain_at_a_virtual_port_takes_virtual_time_only() -> None:
    line, time = Line([FakeMotor(1)]), VirtualTime()
    port = VirtualPort(line, time, 1_000_000, 0.034)
    port.openPort()
    port.setPacketTimeout(11)
    assert port.readPort(11) == b""
    assert time.now_s == pytest.approx(0.034 + 0.00011, abs=1e-4)
    assert line.now_s == pytest.approx(time.now_s)
    port.writePort(list(PING))
    assert port.readPort(100) == PONG
    port.plugged = False
    with pytest.raises(OSError, match="unplugged"):
        port.writePort(list(PING))
