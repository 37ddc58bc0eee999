"""What `open` says when something is missing or wrong: all of it, with the remedy."""

import errno
import grp
import os
import termios
from functools import partial
from pathlib import Path

import pytest
import serial

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.faults import ReplyFault
from hil_fakes.dynamixel.motor import SHUTDOWN_OVERLOAD, FakeMotor
from hil_fakes.dynamixel.paced import PacedPort
from hil_fakes.virtual_robot import Kind, VirtualRobot
from hvcpd.errors import DeviceError
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.hardware.wheels_bus import DynamixelBus, MakePort, port_remedy
from hvcpd.hardware.wheels_port import WaitingPort

pytestmark = pytest.mark.slow


def refusal(bus: FakeBus, baud_rate: int = 1_000_000, ids: tuple[int, int] = (1, 2)) -> str:
    return refusal_at(bus.path, baud_rate, ids, partial(PacedPort, bus))


def refusal_at(
    path: str, baud_rate: int = 1_000_000, ids: tuple[int, int] = (1, 2), make_port: MakePort = WaitingPort
) -> str:
    wheels = DynamixelWheels(path, baud_rate, ids, make_port=make_port)
    with pytest.raises(DeviceError) as caught:
        wheels.open()
    return str(caught.value)


def test_no_such_port(tmp_path: Path) -> None:
    text = refusal_at(str(tmp_path / "ttyUSB9"))
    assert "ttyUSB9: no such port" in text
    assert "U2D2" in text


def test_a_file_is_no_port(tmp_path: Path) -> None:
    (tmp_path / "tty").write_text("")
    assert "does not open (it is no serial port)" in refusal_at(str(tmp_path / "tty"))
    assert "does not open (Is a directory)" in refusal_at(str(tmp_path)), "the library tells it twice"


@pytest.mark.parametrize(
    ("error", "remedy"),
    [
        (PermissionError(13, "Permission denied"), "dialout"),
        (OSError(16, "Device or resource busy"), "ModemManager"),
        (BlockingIOError(11, "Resource temporarily unavailable"), "another hvcpd"),
    ],
)
def test_each_cause_has_its_remedy(error: OSError, remedy: str) -> None:
    assert remedy in port_remedy("/dev/ttyACM0", error)


def test_a_port_without_hardware_is_told_in_plain_words() -> None:
    """As /dev/ttyS1 on many a computer."""
    error = serial.SerialException("Could not configure port: (5, 'Input/output error')")
    error.__context__ = termios.error(errno.EIO, "Input/output error")  # where pyserial raises it
    assert "does not open (Input/output error). " in port_remedy("/dev/ttyS1", error)


def test_the_group_is_the_ports_own(tmp_path: Path) -> None:
    port = tmp_path / "ttyACM0"
    port.touch()
    if os.geteuid() == 0:
        os.chown(port, -1, grp.getgrnam("tty").gr_gid)
    own = grp.getgrgid(port.stat().st_gid).gr_name
    assert f"usermod -aG {own} " in port_remedy(str(port), PermissionError(13, "Permission denied"))


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file to any group")
def test_nobodys_group_is_no_remedy(tmp_path: Path) -> None:
    port = tmp_path / "ttyACM0"
    port.touch()
    os.chown(port, -1, 65534)  # as the service sees every group but its own and root's
    assert "usermod -aG dialout " in port_remedy(str(port), PermissionError(13, "Permission denied"))


@pytest.mark.parametrize(("there", "remedy"), [(1, "the other motor answers"), (5, "the line has ID 5 (XL430-W250)")])
def test_a_missing_motors_remedy_goes_by_what_else_answers(there: int, remedy: str) -> None:
    with FakeBus([FakeMotor(1), *([FakeMotor(there)] if there != 1 else [])]) as bus:
        text = refusal(bus)
    assert text.count("no answer") == 1
    assert "right motor (ID 2): no answer" in text
    assert remedy in text


def test_a_second_program_is_kept_out(bus: FakeBus) -> None:
    first = DynamixelBus(bus.path, 1_000_000, 0.03)
    first.open()
    assert "in use" in refusal(bus)
    first.close()


def test_one_id_for_both_wheels(bus: FakeBus) -> None:
    assert "same ID 1" in refusal(bus, ids=(1, 1))


def test_everything_wrong_is_told_at_once() -> None:
    with FakeBus([FakeMotor(1, voltage_v=9.5), FakeMotor(5)]) as bus:
        bus.motors[1].memory.set("firmware_version", 37)
        bus.motors[1].raise_hardware_error(SHUTDOWN_OVERLOAD)
        text = refusal(bus)
    for part in ("right motor (ID 2): no answer", "ID 5 (XL430-W250)", "firmware 37", "overload", "only 9.5 V"):
        assert part in text
    assert text.startswith(bus.path)


def test_another_model_is_named(bus: FakeBus) -> None:
    bus.motors[2].memory.set("model_number", 1020)
    text = refusal(bus)
    assert "right motor (ID 2): model number 1020 is not an XL430-W250 (1060)" in text
    assert "left" not in text


def test_a_wrong_speed_or_no_power(bus: FakeBus) -> None:
    text = refusal(bus, baud_rate=57_600)
    assert text.count("no answer") == 2
    assert "57600 baud" in text
    assert "power" in text


def test_a_speed_that_no_motor_knows(bus: FakeBus) -> None:
    assert "12345 baud" in refusal_at(bus.path, baud_rate=12_345)


def test_a_failed_open_leaves_the_motors_without_torque(bus: FakeBus) -> None:
    bus.motors[2].raise_hardware_error(SHUTDOWN_OVERLOAD)
    refusal(bus)
    assert [motor.memory.get("torque_enable") for motor in bus.motors.values()] == [0, 0]


@pytest.mark.parametrize("kind", ["dynamixel", "opencr"])
@pytest.mark.parametrize("fault", [ReplyFault.DROP, ReplyFault.CORRUPT, ReplyFault.DELAY])
def test_one_lost_reply_is_no_missing_motor(kind: Kind, fault: ReplyFault) -> None:
    for before in range(20):
        robot = VirtualRobot(kind)
        robot.line.faults.schedule(*[ReplyFault.NONE] * before, fault)
        robot.wheels.open()
        robot.wheels.close()
