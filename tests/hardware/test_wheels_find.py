"""Which port, which kind of wheels, and everything that is wrong with them."""

import os
from pathlib import Path
from typing import Literal

import pytest

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.opencr import FakeOpenCR
from hil_fakes.dynamixel.paced import PacedPort
from hvcpd.config.settings import WheelSettings
from hvcpd.errors import DeviceError
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.hardware.wheels_bus import DynamixelBus, MakePort
from hvcpd.hardware.wheels_find import FoundWheels, candidate_ports, examine, holders, stable_name
from hvcpd.hardware.wheels_opencr import OpenCRWheels
from hvcpd.ports import STANDSTILL, Wheels

pytestmark = pytest.mark.slow


@pytest.fixture
def devices(tmp_path: Path) -> Path:
    (tmp_path / "serial" / "by-id").mkdir(parents=True)
    return tmp_path


def paced(*buses: FakeBus) -> MakePort:
    """Ports that wait for these fakes as long as it takes them."""

    def make_port(path: str, baud_rate: int, timeout_s: float) -> PacedPort:
        bus = next(bus for bus in buses if Path(bus.path).resolve() == Path(path).resolve())
        return PacedPort(bus, path, baud_rate, timeout_s)

    return make_port


def plug(directory: Path, name: str, bus: FakeBus, by_id: str = "") -> None:
    (directory / name).symlink_to(os.path.realpath(bus.path))
    if by_id:
        (directory / "serial" / "by-id" / by_id).symlink_to(directory / name)


def test_opencr_is_found_behind_another_device(devices: Path) -> None:
    with FakeBus([FakeMotor(9)]) as arm, FakeBus([FakeOpenCR()]) as robot:
        plug(devices, "ttyACM0", arm)
        plug(devices, "ttyACM1", robot, "usb-ROBOTIS_OpenCR-if00")
        finding = examine(WheelSettings(), paced(arm, robot), devices)
    assert (finding.kind, finding.ok) == ("opencr", True)
    assert finding.port.endswith("usb-ROBOTIS_OpenCR-if00")
    assert finding.facts == ("12.0 V",)


@pytest.mark.parametrize("driver", ["opencr", "dynamixel"])
def test_the_wheels_that_are_wanted_are_found_behind_another_device(
    devices: Path, driver: Literal["dynamixel", "opencr"]
) -> None:
    """With the driver named, the first port was taken for theirs, whatever was there."""
    wanted = [FakeOpenCR()] if driver == "opencr" else turtlebot3_pair()
    with FakeBus([FakeMotor(9)]) as arm, FakeBus(wanted) as robot:
        plug(devices, "ttyUSB0", arm, "usb-1a86_USB_Serial-if00")
        plug(devices, "ttyACM0", robot, "usb-ROBOTIS_OpenCR-if00")
        finding = examine(WheelSettings(driver=driver), paced(arm, robot), devices)
        assert (finding.kind, finding.problems) == (driver, ())
        assert finding.port.endswith("usb-ROBOTIS_OpenCR-if00")


def test_of_each_port_it_is_told_why_it_is_not_the_wheels(devices: Path) -> None:
    with FakeBus([FakeMotor(9)]) as arm, FakeBus([FakeOpenCR()]) as robot:
        plug(devices, "ttyUSB0", arm)
        plug(devices, "ttyUSB1", robot)
        problems = " ".join(examine(WheelSettings(driver="dynamixel"), paced(arm, robot), devices).problems)
    assert "ttyUSB0: left motor (ID 1): no answer; the line has ID 9" in problems
    assert "ttyUSB1: OpenCR with TurtleBot3 firmware found, but wheels.driver is dynamixel" in problems


def test_motors_are_found_and_their_state_told(devices: Path) -> None:
    with FakeBus(turtlebot3_pair()) as robot:
        plug(devices, "ttyUSB0", robot)
        finding = examine(WheelSettings(), paced(robot), devices)
    assert finding.kind == "dynamixel"
    assert finding.facts == ("left motor (ID 1) 12.0 V, 30 °C", "right motor (ID 2) 12.0 V, 30 °C")


def test_no_port_at_all(devices: Path) -> None:
    assert "plug in the robot's USB cable" in examine(WheelSettings(), directory=devices).problems[0]


def test_motors_at_another_speed_are_told_with_the_remedy(devices: Path) -> None:
    with FakeBus([FakeMotor(1, baud_rate_hz=57_600), FakeMotor(2, baud_rate_hz=57_600)]) as robot:
        plug(devices, "ttyUSB0", robot)
        for driver in ("auto", "dynamixel"):
            problems = " ".join(examine(WheelSettings(driver=driver), paced(robot), devices).problems)
            assert "set wheels.baud_rate to 57600" in problems


def test_silence_is_told_with_all_that_it_may_mean(devices: Path) -> None:
    silent = FakeMotor(1)
    silent.powered = False
    with FakeBus([silent]) as robot:
        plug(devices, "ttyUSB0", robot)
        (problem,) = examine(WheelSettings(), paced(robot), devices).problems
    assert "nothing answers, neither OpenCR (ID 200) nor motors 1 and 2" in problem
    assert "switched on" in problem


def test_motors_with_other_identifiers_are_named_with_the_settings_that_help(devices: Path) -> None:
    with FakeBus([FakeMotor(3), FakeMotor(4)]) as robot:
        plug(devices, "ttyUSB0", robot)
        (problem,) = examine(WheelSettings(), paced(robot), devices).problems
    assert "ID 3 (XL430-W250), ID 4 (XL430-W250)" in problem
    assert "set wheels.left_id and wheels.right_id" in problem


@pytest.mark.parametrize(
    ("driver", "there"), [("dynamixel", [FakeOpenCR()]), ("opencr", turtlebot3_pair())], ids=["opencr", "dynamixel"]
)
def test_the_other_kind_of_wheels_is_told_with_the_remedy(
    devices: Path, driver: Literal["dynamixel", "opencr"], there: list[FakeMotor | FakeOpenCR]
) -> None:
    with FakeBus(there) as robot:
        plug(devices, "ttyUSB0", robot)
        (problem,) = examine(WheelSettings(driver=driver), paced(robot), devices).problems
    assert (
        f"wheels.driver is {driver}: set it to {'opencr' if driver == 'dynamixel' else 'dynamixel'} or auto" in problem
    )


def test_holders_are_told_only_of_a_port_that_is_in_use(tmp_path: Path) -> None:
    port = tmp_path / "file"
    with port.open("w"):  # it is held by us, but that is not why it is no port
        (problem,) = examine(WheelSettings(port=str(port))).problems
    assert "does not open" in problem
    assert "held by" not in problem


def test_who_holds_the_port_is_named(devices: Path) -> None:
    with FakeBus(turtlebot3_pair()) as robot:
        holder = DynamixelBus(robot.path, 1_000_000, 0.03)
        holder.open()
        (problem,) = examine(WheelSettings(port=robot.path), directory=devices).problems
        assert "in use" in problem
        assert f"({os.getpid()})" in problem
        holder.close()


def test_the_holder_of_a_port_is_looked_up_in_proc(tmp_path: Path) -> None:
    port = tmp_path / "ttyACM0"
    port.touch()
    (tmp_path / "proc" / "812" / "fd").mkdir(parents=True)
    (tmp_path / "proc" / "812" / "comm").write_text("ModemManager\n")
    (tmp_path / "proc" / "812" / "fd" / "5").symlink_to(port)
    (tmp_path / "proc" / "900").mkdir()
    assert holders(str(port), tmp_path / "proc") == ["ModemManager (812)"]


def test_a_device_is_listed_once_by_its_stable_name(devices: Path) -> None:
    with FakeBus(turtlebot3_pair()) as robot:
        plug(devices, "ttyUSB3", robot, "usb-FTDI_U2D2")
        by_id = str(devices / "serial" / "by-id" / "usb-FTDI_U2D2")
        assert candidate_ports(devices) == [by_id]
        assert stable_name(str(devices / "ttyUSB3"), devices) == by_id
        assert stable_name("ttyUSB9", devices) == "ttyUSB9"


def test_an_adapter_that_comes_back_under_another_number_is_found_again(devices: Path) -> None:
    with FakeBus(turtlebot3_pair()) as robot:
        plug(devices, "ttyUSB0", robot, "usb-FTDI_U2D2")
        wheels = FoundWheels(WheelSettings(port=str(devices / "ttyUSB0")), paced(robot), devices)
        wheels.open()
        wheels.exchange(STANDSTILL)
        robot.unplug()
        (devices / "ttyUSB0").unlink()
        (devices / "serial" / "by-id" / "usb-FTDI_U2D2").unlink()
        with pytest.raises(DeviceError):
            wheels.exchange(STANDSTILL)
        robot.replug()
        plug(devices, "ttyUSB1", robot, "usb-FTDI_U2D2")
        wheels.exchange(STANDSTILL)
        assert robot.motors[1].memory.get("torque_enable") == 1
        wheels.close()


@pytest.mark.parametrize(("fake", "driver"), [(FakeOpenCR, OpenCRWheels), (turtlebot3_pair, DynamixelWheels)])
def test_found_wheels_are_driven_by_the_right_driver(devices: Path, fake: object, driver: type) -> None:
    made = fake()  # type: ignore[operator]
    with FakeBus(made if isinstance(made, tuple) else [made]) as robot:
        plug(devices, "ttyACM0", robot)
        found = FoundWheels(WheelSettings(), paced(robot), devices)
        wheels: Wheels = found
        with pytest.raises(DeviceError, match="not open"):
            wheels.exchange(STANDSTILL)
        wheels.open()
        assert isinstance(found.driver, driver)
        wheels.close()
        wheels.close()
